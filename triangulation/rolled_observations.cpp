#include "triangulation/rolled_observations.h"

#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>

namespace weft {
namespace {

constexpr int kReach = 2;  // cells
constexpr int kFewestNeighbors = 3;

struct Displacement {
  double x_px, y_px;
};

// Displacements of nodes that both frames show, to time 0.
class MotionField {
 public:
  MotionField(const SeenAt& own, const SeenAt& other, double share) {
    std::map<BoardNode, const Observation*> others;
    for (const Observation& seen : other.observations) others.emplace(seen.node, &seen);
    for (const Observation& seen : own.observations) {
      const auto match = others.find(seen.node);
      if (match == others.end()) continue;
      moved_[seen.node] = {share * (match->second->x_px - seen.x_px),
                           share * (match->second->y_px - seen.y_px)};
      sigmas_[seen.node] = match->second->sigma_px;
    }
  }

  const Displacement* Of(const BoardNode& node) const {
    const auto found = moved_.find(node);
    return found == moved_.end() ? nullptr : &found->second;
  }
  float SigmaInOther(const BoardNode& node) const { return sigmas_.at(node); }

  struct Mean {
    Displacement displacement;
    double spread_px;
  };
  // Of nodes of the same kind around this one.
  std::optional<Mean> Around(const BoardNode& node) const {
    double n = 0, x = 0, y = 0, squares = 0;
    for (int row = node.row - kReach; row <= node.row + kReach; ++row)
      for (int col = node.col - kReach; col <= node.col + kReach; ++col) {
        const Displacement* near = Of({row, col, node.kind});
        if (near == nullptr) continue;
        ++n;
        x += near->x_px, y += near->y_px;
        squares += near->x_px * near->x_px + near->y_px * near->y_px;
      }
    if (n < kFewestNeighbors) return std::nullopt;
    x /= n, y /= n;
    return Mean{{x, y}, std::sqrt(std::max(0.0, squares / n - x * x - y * y) / 2)};  // per axis
  }

 private:
  std::map<BoardNode, Displacement> moved_;
  std::map<BoardNode, float> sigmas_;
};

}  // namespace

std::vector<Observation> RollToMoment(const SeenAt& own, const SeenAt& other) {
  if (own.time_s == other.time_s) return own.observations;
  const double share = own.time_s / (own.time_s - other.time_s);  // of the way to the other frame
  const MotionField motion(own, other, share);
  std::vector<Observation> rolled;
  for (Observation seen : own.observations) {
    if (const Displacement* moved = motion.Of(seen.node)) {
      seen.x_px += moved->x_px;
      seen.y_px += moved->y_px;
      seen.sigma_px = static_cast<float>(std::hypot(
          (1 - share) * seen.sigma_px, share * static_cast<double>(motion.SigmaInOther(seen.node))));
    } else if (const auto mean = motion.Around(seen.node)) {
      seen.x_px += mean->displacement.x_px;
      seen.y_px += mean->displacement.y_px;
      seen.sigma_px = static_cast<float>(std::hypot(static_cast<double>(seen.sigma_px), mean->spread_px));
    } else {
      continue;
    }
    rolled.push_back(seen);
  }
  return rolled;
}

}  // namespace weft
