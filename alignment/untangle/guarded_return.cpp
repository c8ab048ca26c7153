#include "alignment/untangle/guarded_return.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "absl/strings/str_cat.h"
#include "alignment/untangle/contact_planes.h"

namespace weft {
namespace {

constexpr double kMaxStepMm = 0.5;  // of a vertex in one iteration
constexpr double kSmoothness = 1;   // how much a vertex that is held up holds up its neighbours
constexpr int kMaxIterations = 60;
constexpr double kTolerance = 0.01;  // ends when iterations lower the energy by less than this share

constexpr double kPush = 30;              // pull of a push, against kSmoothness
constexpr double kTouchingRoomMm = 0.02;  // a vertex with less room is stopped

constexpr int kReturnSweeps = 12;
constexpr int kProjections = 4;
constexpr double kAtRestMm = 0.005;
constexpr int kIdleIterations = 3;  // iterations of little use in a row

// The nearest move, or nearly so, within the planes and the greatest step.
Eigen::Vector3d Admissible(Eigen::Vector3d move, std::span<const ContactPlane> planes, double max_step_mm) {
  for (int i = 0; i < kProjections; ++i) {
    bool clear = true;
    for (const ContactPlane& plane : planes) {
      const double beyond = plane.normal.dot(move) + plane.room_mm;
      if (beyond >= -1e-12) continue;
      move -= beyond * plane.normal;
      clear = false;
    }
    if (clear) break;
  }
  double share = std::min(1.0, max_step_mm / std::max(move.norm(), 1e-12));
  for (const ContactPlane& plane : planes) {
    const double against = -plane.normal.dot(move), room = std::max(plane.room_mm, 0.0);
    if (plane.normal.isZero()) share = 0;
    if (against > room) share = std::min(share, room / against);
  }
  return share * move;
}

// The part of the way from `start` (within the bound) to `end` that lies within it.
Eigen::Vector3d UpToBound(const Eigen::Vector3d& start, const Eigen::Vector3d& end, double bound_mm) {
  if (end.norm() <= bound_mm) return end;
  const Eigen::Vector3d way = end - start;
  const double a = way.squaredNorm(), b = start.dot(way), c = start.squaredNorm() - bound_mm * bound_mm;
  if (!(a > 0) || c >= 0) return start;
  return start + (std::sqrt(b * b - a * c) - b) / a * way;
}

class GuardedReturn {
 public:
  GuardedReturn(const ReturnOptions& options, UntanglePatch* patch)
      : options_(options),
        patch_(patch),
        start_(patch->vertex.size(), Eigen::Vector3d::Zero()),
        push_(patch->vertex.size(), Eigen::Vector3d::Zero()),
        moves_(patch->vertex.size(), false) {
    std::fill_n(moves_.begin(), patch->free, true);
  }

  double Energy() const {
    double energy = 0;
    for (int v = 0; v < patch_->free; ++v) {
      const Eigen::Vector3d u = patch_->position_mm[v] - patch_->observed_mm[v];
      energy += patch_->weight[v] * u.squaredNorm();
      for (const int w : patch_->NeighborsOf(v)) {
        const Eigen::Vector3d other = patch_->position_mm[w] - patch_->observed_mm[w];
        energy += (w < patch_->free ? 0.5 : 1.0) * kSmoothness * (u - other).squaredNorm();
      }
    }
    return energy;
  }

  void Step() {
    const ContactPlanes contacts =
        FindContactPlanes(*patch_, moves_, 2 * kMaxStepMm + options_.gap_mm, options_.gap_mm);
    std::vector<int> moving;
    for (int v = 0; v < patch_->free; ++v) {
      start_[v] = patch_->position_mm[v] - patch_->observed_mm[v];
      if (moves_[v]) moving.push_back(v);
    }
    std::vector<Eigen::Vector3d> u = start_;
    for (int sweep = 0; sweep < kReturnSweeps; ++sweep) {
      for (const int v : moving) {
        const std::span<const ContactPlane> planes(contacts.planes.data() + contacts.first[v],
                                                   contacts.planes.data() + contacts.first[v + 1]);
        u[v] = start_[v] + Admissible(Wish(v, u) - start_[v], planes, kMaxStepMm);
        u[v] = UpToBound(start_[v], u[v], patch_->MostWayMm(v));
      }
      std::reverse(moving.begin(), moving.end());
    }
    std::vector<bool> eager(patch_->free, false);
    for (const int v : moving) {
      eager[v] = std::max((u[v] - start_[v]).norm(), (Wish(v, u) - u[v]).norm()) > kAtRestMm;
      patch_->position_mm[v] = patch_->observed_mm[v] + u[v];
    }
    FindPushes(contacts, u);
    for (int v = 0; v < patch_->free; ++v) eager[v] = eager[v] || IsPushed(v);
    // Those that came to rest, among others at rest, stay there.
    for (int v = 0; v < patch_->free; ++v) {
      moves_[v] = eager[v];
      for (const int w : patch_->NeighborsOf(v)) moves_[v] = moves_[v] || (w < patch_->free && eager[w]);
    }
  }

 private:
  // The best displacement of the vertex while its neighbours keep theirs.
  Eigen::Vector3d Wish(int v, const std::vector<Eigen::Vector3d>& u) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int w : patch_->NeighborsOf(v)) sum += u[w];
    const double degree = static_cast<double>(patch_->NeighborsOf(v).size());
    const double pull = IsPushed(v) ? kPush : 0;
    return (kSmoothness * sum + pull * (start_[v] + push_[v])) /
           (patch_->weight[v] + kSmoothness * degree + pull);
  }

  bool IsPushed(int v) const { return !push_[v].isZero(); }

  // What measured and pushed vertices, now at the displacements `u`, could not go for another layer is asked
  // of that layer in the next step.
  void FindPushes(const ContactPlanes& contacts, const std::vector<Eigen::Vector3d>& u) {
    std::vector<Eigen::Vector3d> push(patch_->vertex.size(), Eigen::Vector3d::Zero());
    for (int v = 0; v < patch_->free; ++v) {
      if (!moves_[v] || !(patch_->IsMeasured(v) || IsPushed(v))) continue;
      const Eigen::Vector3d moved = u[v] - start_[v], left = Wish(v, u) - u[v];
      if (left.norm() <= kAtRestMm) continue;
      for (int i = contacts.first[v]; i < contacts.first[v + 1]; ++i) {
        const ContactPlane& plane = contacts.planes[i];
        const double against_mm = std::min(-plane.normal.dot(left), kMaxStepMm);
        if (against_mm <= kAtRestMm || plane.room_mm + plane.normal.dot(moved) > kTouchingRoomMm) continue;
        for (const int w : contacts.contacts[plane.contact].Opposite(v)) {
          if (w >= patch_->free || patch_->IsMeasured(w)) continue;
          const double more_mm = against_mm + plane.normal.dot(push[w]);
          if (more_mm > 0) push[w] -= more_mm * plane.normal;
        }
      }
    }
    push_ = std::move(push);
  }

  const ReturnOptions& options_;
  UntanglePatch* patch_;
  std::vector<Eigen::Vector3d> start_;  // [n], displacements before the step
  std::vector<Eigen::Vector3d> push_;   // [n], moves that others ask for; 0 where none does
  std::vector<bool> moves_;             // [n]
};

}  // namespace

absl::Status ReturnOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("untangle.back.", what));
  };
  if (!(gap_mm > 0)) return bad("gap_mm must be positive");
  return absl::OkStatus();
}

int ReturnGuarded(const ReturnOptions& options, UntanglePatch* patch) {
  GuardedReturn run(options, patch);
  double energy = run.Energy();
  int iteration = 0, idle = 0;
  while (iteration < kMaxIterations && idle < kIdleIterations) {
    ++iteration;
    run.Step();
    const double before = energy;
    energy = run.Energy();
    idle = before - energy < kTolerance * before ? idle + 1 : 0;
  }
  return iteration;
}

}  // namespace weft
