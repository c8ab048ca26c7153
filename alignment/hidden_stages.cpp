#include "alignment/hidden_stages.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "alignment/vertex_normals.h"

namespace weft {

absl::Status PushOptions::Validate() const {
  if (!(weight >= 0) || !std::isfinite(weight)) {
    return absl::InvalidArgumentError("push.weight must not be negative");
  }
  if (!std::isfinite(depth_mm)) return absl::InvalidArgumentError("push.depth_mm must be finite");
  return absl::OkStatus();
}

absl::Status ReconOptions::Validate() const {
  const auto bad = [](const char* what) { return absl::InvalidArgumentError(absl::StrCat("recon.", what)); };
  if (!(weight >= 0) || !std::isfinite(weight)) return bad("weight must not be negative");
  if (!(tangential_share >= 0 && tangential_share <= 1)) return bad("tangential_share must lie in 0 to 1");
  return association.Validate();
}

void AddPush(const std::vector<Eigen::Vector3d>& position_mm, const std::vector<Face>& faces,
             const std::vector<bool>& hidden, const PushOptions& options, ElasticProblem* problem) {
  const std::vector<Eigen::Vector3d> normals = VertexNormals(position_mm, faces);
  const Eigen::Matrix3d weight = options.weight * Eigen::Matrix3d::Identity();
  for (size_t v = 0; v < position_mm.size(); ++v) {
    if (!hidden[v]) continue;
    problem->Add(static_cast<int>(v), position_mm[v] - options.depth_mm * normals[v], weight);  // Eq. 3
  }
}

int AddRecon(const Scan& scan, const std::vector<Eigen::Vector3d>& position_mm,
             const std::vector<Face>& faces, const std::vector<bool>& hidden, const ReconOptions& options,
             ElasticProblem* problem) {
  const std::vector<ScanPull> pulls = AssociateScan(scan, position_mm, faces, hidden, options.association);
  for (const ScanPull& pull : pulls) {
    const Eigen::Matrix3d along_normal = pull.normal * pull.normal.transpose();
    const Eigen::Matrix3d along_surface = Eigen::Matrix3d::Identity() - along_normal;
    const double share = options.tangential_share;
    problem->Add(pull.vertex, pull.position_mm,
                 options.weight * (along_normal + share * along_surface));  // Eq. 4
  }
  return static_cast<int>(pulls.size());
}

}  // namespace weft
