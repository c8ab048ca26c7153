#include "alignment/guarded_return.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "absl/strings/str_cat.h"
#include "alignment/contact_planes.h"

namespace weft {
namespace {

constexpr int kSweeps = 12;
constexpr int kProjections = 4;

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

}  // namespace

absl::Status ReturnOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("untangle.back.", what));
  };
  if (!(gap_mm > 0)) return bad("gap_mm must be positive");
  if (!(max_step_mm > 0)) return bad("max_step_mm must be positive");
  if (!(smoothness >= 0)) return bad("smoothness must not be negative");
  if (max_iterations < 0) return bad("max_iterations must not be negative");
  if (!(tolerance_mm >= 0)) return bad("tolerance_mm must not be negative");
  return absl::OkStatus();
}

int ReturnGuarded(const ReturnOptions& options, TanglePatch* patch) {
  const auto displacement = [&](int v) -> Eigen::Vector3d {
    return patch->position_mm[v] - patch->observed_mm[v];
  };
  int iteration = 0;
  std::vector<Eigen::Vector3d> u(patch->vertex.size(), Eigen::Vector3d::Zero());
  while (iteration < options.max_iterations) {
    ++iteration;
    const ContactPlanes contacts =
        FindContactPlanes(*patch, 2 * options.max_step_mm + options.gap_mm, options.gap_mm);
    for (int v = 0; v < patch->free; ++v) u[v] = displacement(v);
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (int i = 0; i < patch->free; ++i) {
        const int v = sweep % 2 == 0 ? i : patch->free - 1 - i;
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const int w : patch->NeighborsOf(v)) sum += u[w];
        const double degree = static_cast<double>(patch->NeighborsOf(v).size());
        const Eigen::Vector3d best =
            options.smoothness * sum / (patch->weight[v] + options.smoothness * degree);
        const std::span<const ContactPlane> planes(contacts.planes.data() + contacts.first[v],
                                                   contacts.planes.data() + contacts.first[v + 1]);
        u[v] = displacement(v) + Admissible(best - displacement(v), planes, options.max_step_mm);
      }
    }
    double largest = 0;
    for (int v = 0; v < patch->free; ++v) {
      largest = std::max(largest, (u[v] - displacement(v)).norm());
      patch->position_mm[v] = patch->observed_mm[v] + u[v];
    }
    if (largest < options.tolerance_mm) break;
  }
  return iteration;
}

}  // namespace weft
