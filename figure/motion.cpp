#include "figure/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"

namespace weft {

FigurePose Motion::PoseAt(double time_s) const {
  const double last = static_cast<double>(poses.size() - 1);
  const double at = std::clamp(time_s * fps, 0.0, last);
  const auto before = static_cast<size_t>(std::min(std::floor(at), std::max(0.0, last - 1)));
  const double t = at - static_cast<double>(before);
  const auto pose = [&](size_t back, size_t ahead) -> const FigurePose& {
    return poses[std::min(before + ahead - std::min(back, before + ahead), poses.size() - 1)];
  };
  const std::array<const FigurePose*, 4> around = {&pose(1, 0), &pose(0, 0), &pose(0, 1), &pose(0, 2)};
  const std::array<double, 4> weight = {0.5 * t * (t * (2 - t) - 1), 0.5 * (t * t * (3 * t - 5) + 2),
                                        0.5 * t * (t * (4 - 3 * t) + 1), 0.5 * t * t * (t - 1)};
  FigurePose out;
  out.root_mm.setZero();
  for (size_t k = 0; k < 4; ++k) out.root_mm += weight[k] * around[k]->root_mm;
  for (size_t j = 0; j < kJoints; ++j) {
    const Eigen::Vector4d middle = around[1]->rotation[j].coeffs();
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (size_t k = 0; k < 4; ++k) {
      const Eigen::Vector4d& q = around[k]->rotation[j].coeffs();
      sum += (q.dot(middle) < 0 ? -weight[k] : weight[k]) * q;
    }
    out.rotation[j].coeffs() = sum.normalized();
  }
  return out;
}

absl::Status Motion::Validate() const {
  if (!(fps >= 1 && fps <= 1000))
    return absl::InvalidArgumentError(absl::StrCat("motion: fps is ", fps, ", expected 1 to 1000"));
  if (poses.empty()) return absl::InvalidArgumentError("motion: holds no pose");
  for (size_t k = 0; k < poses.size(); ++k) {
    const auto bad = [&](const std::string& what) {
      return absl::InvalidArgumentError(absl::StrCat("motion: pose ", k, ": ", what));
    };
    // 1e7 mm: nobody walks 10 km in a studio.
    if (!poses[k].root_mm.allFinite() || poses[k].root_mm.cwiseAbs().maxCoeff() > 1e7)
      return bad("root_mm is not a position");
    for (size_t j = 0; j < kJoints; ++j) {
      const double length = poses[k].rotation[j].norm();
      if (std::abs(length - 1) < 1e-3) continue;
      return bad(absl::StrCat("the quaternion of ", std::string(NameOf(static_cast<Joint>(j))),
                              " has length ", length, ", expected 1"));
    }
  }
  return absl::OkStatus();
}

}  // namespace weft
