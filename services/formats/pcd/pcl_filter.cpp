#include "services/formats/pcd/pcl_filter.h"

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_types.h>

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace weft {

absl::StatusOr<Ply> WithoutOutliers(Ply ply, const OutlierOptions& options) {
  std::erase_if(ply.elements, [](const PlyElement& element) { return element.name != "vertex"; });
  if (ply.elements.empty()) return absl::InvalidArgumentError("has no element vertex");
  PlyElement& vertex = ply.elements[0];
  std::erase_if(vertex.properties, [](const PlyProperty& property) { return property.is_list; });
  const PlyProperty* axes[3] = {vertex.Find("x"), vertex.Find("y"), vertex.Find("z")};
  auto points = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (int i = 0; i < 3; ++i) {
    if (!axes[i])
      return absl::InvalidArgumentError(absl::StrCat("has no property ", std::string(1, "xyz"[i])));
  }
  for (size_t i = 0; i < vertex.rows; ++i) {
    const auto at = [&](int axis) { return static_cast<float>(axes[axis]->values[i]); };
    points->emplace_back(at(0), at(1), at(2));
  }
  if (points->size() <= static_cast<size_t>(options.neighbors)) return ply;
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(points);
  filter.setMeanK(options.neighbors);
  filter.setStddevMulThresh(options.most_sigmas);
  std::vector<int> kept;  // ascending
  filter.filter(kept);
  for (PlyProperty& property : vertex.properties) {
    for (size_t i = 0; i < kept.size(); ++i) property.values[i] = property.values[kept[i]];
    property.values.resize(kept.size());
  }
  vertex.rows = kept.size();
  return ply;
}

}  // namespace weft
