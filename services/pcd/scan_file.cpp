#include "services/pcd/scan_file.h"

#include "services/files/mesh_file.h"
#include "services/pcd/pcd_file.h"

namespace weft {
namespace {

// Normals of length 1, or none at all.
void TidyNormals(Scan& scan) {
  for (Eigen::Vector3d& n : scan.normals) {
    const double largest = n.cwiseAbs().maxCoeff();
    if (!n.allFinite() || largest == 0) {
      scan.normals.clear();
      return;
    }
    n = (n / largest).normalized();  // squares of very short or long normals are no doubles
  }
}

}  // namespace

absl::StatusOr<Scan> ScanFromPly(const Ply& ply, const std::string& source_name) {
  const auto vertex = FindElement(ply, "vertex", source_name);
  if (!vertex.ok()) return vertex.status();
  auto positions = PositionsFromPly(**vertex, source_name);
  if (!positions.ok()) return positions.status();
  Scan scan;
  scan.points_mm = *std::move(positions);
  const PlyProperty* normals[3] = {(*vertex)->Find("nx"), (*vertex)->Find("ny"), (*vertex)->Find("nz")};
  for (const PlyProperty* column : normals) {
    if (!column || column->is_list) return scan;
  }
  for (size_t i = 0; i < scan.points_mm.size(); ++i) {
    scan.normals.emplace_back(normals[0]->values[i], normals[1]->values[i], normals[2]->values[i]);
  }
  TidyNormals(scan);
  return scan;
}

absl::StatusOr<Scan> ReadScan(const std::string& path) {
  const absl::StatusOr<Ply> ply = ReadPoints(path);
  return ply.ok() ? ScanFromPly(*ply, path) : ply.status();
}

}  // namespace weft
