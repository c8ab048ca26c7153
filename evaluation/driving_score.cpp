#include "evaluation/driving_score.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "evaluation/chamfer.h"

namespace weft {

double VertexRays::AcrossMm(size_t vertex, const Eigen::Vector3d& error_mm) const {
  if (count_[vertex] == 0) return error_mm.norm();
  return std::sqrt(std::max(0.0, error_mm.dot(across_[vertex] * error_mm) / count_[vertex]));
}

absl::Status DrivingScore::Add(const ScoredMesh& mesh, const std::vector<Eigen::Vector3d>& truth_mm,
                               const VertexRays& rays, bool follows) {
  const size_t vertices = truth_mm.size();
  if (mesh.vertices_mm.size() != vertices || rays.size() != vertices || vertices == 0 ||
      (!mesh.sigma_mm.empty() && mesh.sigma_mm.size() != vertices))
    return absl::InvalidArgumentError(
        absl::StrCat("the driven mesh has ", mesh.vertices_mm.size(), " vertices, the truth ", vertices));
  for (size_t v = 0; v < vertices; ++v)
    if (!mesh.vertices_mm[v].allFinite())
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " of the driven mesh is not finite"));
  Moment moment{std::vector<Eigen::Vector3d>(vertices), std::vector<bool>(vertices)};
  for (size_t v = 0; v < vertices; ++v) {
    const Eigen::Vector3d error = mesh.vertices_mm[v] - truth_mm[v];
    moment.error_mm[v] = error;
    const double distance = error.norm();
    moment.seen[v] = rays.CountAt(v) > 0;
    all_mm_.push_back(distance);
    (moment.seen[v] ? seen_mm_ : unseen_mm_).push_back(distance);
    if (rays.CountAt(v) >= 2) crossed_mm_.push_back(distance);
    if (moment.seen[v]) across_mm_.push_back(rays.AcrossMm(v, error));
    lost_ += distance > kLostMm ? 1 : 0;
    if (mesh.sigma_mm.empty()) continue;
    const double sigma = mesh.sigma_mm[v];
    ++with_sigma_;
    within_one_ += distance < sigma ? 1 : 0;
    within_two_ += distance < 2 * sigma ? 1 : 0;
  }
  chamfer_mm_.push_back(ChamferMm(mesh.vertices_mm, truth_mm));
  ++frames_;
  if (!follows) recent_.clear();
  if (recent_.size() == 2) AddErrorJitter(moment);
  if (recent_.size() == 2) recent_.erase(recent_.begin());
  recent_.push_back(std::move(moment));
  return absl::OkStatus();
}

void DrivingScore::AddErrorJitter(const Moment& last) {
  const Moment &first = recent_[0], &middle = recent_[1];
  for (size_t v = 0; v < last.error_mm.size(); ++v) {
    const double jitter_mm = (first.error_mm[v] - 2 * middle.error_mm[v] + last.error_mm[v]).norm();
    (middle.seen[v] ? error_jitter_seen_mm_ : error_jitter_unseen_mm_).push_back(jitter_mm);
  }
}

DrivingScore& DrivingScore::operator+=(const DrivingScore& other) {
  frames_ += other.frames_;
  lost_ += other.lost_;
  with_sigma_ += other.with_sigma_, within_one_ += other.within_one_, within_two_ += other.within_two_;
  all_mm_ += other.all_mm_, seen_mm_ += other.seen_mm_, unseen_mm_ += other.unseen_mm_;
  crossed_mm_ += other.crossed_mm_, across_mm_ += other.across_mm_;
  chamfer_mm_ += other.chamfer_mm_;
  error_jitter_seen_mm_ += other.error_jitter_seen_mm_,
      error_jitter_unseen_mm_ += other.error_jitter_unseen_mm_;
  recent_.clear();
  return *this;
}

std::optional<double> DrivingScore::ShareWithin(int sigmas) const {
  if (with_sigma_ == 0) return std::nullopt;
  const int64_t within = sigmas == 1 ? within_one_ : within_two_;
  return static_cast<double>(within) / static_cast<double>(with_sigma_);
}

std::optional<double> DrivingScore::UnseenShare() const {
  if (all_mm_.empty()) return std::nullopt;
  return static_cast<double>(unseen_mm_.size()) / static_cast<double>(all_mm_.size());
}

}  // namespace weft
