#include "services/formats/pcd/scan_file.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/mesh_file.h"

namespace weft {
namespace {

// A point that cannot say on which side of the cloth it is may lie on the wrong one.
void TidyNormals(ScanFile& file) {
  Scan& scan = file.scan;
  std::vector<bool> has_normal(scan.normals.size());
  for (size_t i = 0; i < scan.normals.size(); ++i) {
    Eigen::Vector3d& n = scan.normals[i];
    const double largest = n.cwiseAbs().maxCoeff();
    has_normal[i] = n.allFinite() && largest > 0;
    file.without_normal += !has_normal[i];
    if (has_normal[i])
      n = (n / largest).normalized();  // squares of very short or long normals are no doubles
  }
  if (file.without_normal == 0) return;
  if (2 * static_cast<size_t>(file.without_normal) >= scan.normals.size()) {
    scan.normals.clear();
    return;
  }
  const Scan all = std::exchange(scan, {.name = scan.name});
  for (size_t i = 0; i < all.normals.size(); ++i) {
    if (!has_normal[i]) continue;
    scan.points_mm.push_back(all.points_mm[i]);
    scan.normals.push_back(all.normals[i]);
  }
}

}  // namespace

absl::StatusOr<ScanFile> ReadScan(const std::string& path) {
  const absl::StatusOr<Points> points = ReadPoints(path);
  return points.ok() ? ScanFromPoints(*points, path) : points.status();
}

absl::StatusOr<ScanFile> ScanFromPoints(const Points& points, const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const auto vertex, FindElement(points.ply, "vertex", path));
  WEFT_ASSIGN_OR_RETURN(auto positions, PositionsFromPly(*vertex, path));
  ScanFile file;
  file.scan.name = path;
  file.scan.points_mm = std::move(positions);
  file.unmeasured = static_cast<int>(points.unmeasured);
  file.points = file.unmeasured + static_cast<int>(file.scan.points_mm.size());
  if (file.scan.points_mm.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        path, ": has no measured point", file.points > 0 ? ", x, y or z of each is no number" : ""));
  }
  const PlyProperty* normals[3] = {vertex->Find("nx"), vertex->Find("ny"), vertex->Find("nz")};
  for (const PlyProperty* column : normals) {
    if (!column || column->is_list) return file;
  }
  for (size_t i = 0; i < file.scan.points_mm.size(); ++i) {
    file.scan.normals.emplace_back(normals[0]->values[i], normals[1]->values[i], normals[2]->values[i]);
  }
  TidyNormals(file);
  return file;
}

}  // namespace weft
