#include "alignment/template_build/zipper.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"

namespace weft {

namespace {

// Where two sides meet that go on from a and b in the directions u and v, equally far.
Eigen::Vector3d MeetingPoint(const Eigen::Vector3d& a, const Eigen::Vector3d& u, const Eigen::Vector3d& b,
                             const Eigen::Vector3d& v) {
  constexpr double kMostSlack = 0.15;  // of the way over the gap itself
  const double gap_mm = (b - a).norm(), turn2 = (u - v).squaredNorm();
  const double reach_mm = turn2 > 0 ? (b - a).dot(u - v) / turn2 : 0;
  const double half_mm = std::clamp(reach_mm, 0.5 * gap_mm, (0.5 + kMostSlack) * gap_mm);
  return 0.5 * (a + half_mm * u + b + half_mm * v);
}

// Positions in side_a and side_b of the ends of the edges across.
using Step = std::pair<int, int>;

std::vector<Step> StepsAcross(const Seam& seam, const std::vector<Eigen::Vector3d>& position_mm) {
  const int a_count = static_cast<int>(seam.side_a.size()), b_count = static_cast<int>(seam.side_b.size());
  // Least cost of a strip up to the edge across from a to b, and whether the last step moved along a.
  std::vector<double> cost(static_cast<size_t>(a_count) * b_count, 0);
  std::vector<bool> along_a(cost.size(), false);
  for (int a = 0; a < a_count; ++a) {
    for (int b = 0; b < b_count; ++b) {
      if (a == 0 && b == 0) continue;
      const double infinity = std::numeric_limits<double>::infinity();
      const double by_a = a > 0 ? cost[(a - 1) * b_count + b] : infinity;
      const double by_b = b > 0 ? cost[a * b_count + b - 1] : infinity;
      along_a[a * b_count + b] = by_a <= by_b;
      cost[a * b_count + b] =
          std::min(by_a, by_b) + (position_mm[seam.side_a[a]] - position_mm[seam.side_b[b]]).squaredNorm();
    }
  }
  std::vector<Step> steps = {{a_count - 1, b_count - 1}};
  while (steps.back() != Step(0, 0)) {
    const auto [a, b] = steps.back();
    steps.push_back(along_a[a * b_count + b] ? Step(a - 1, b) : Step(a, b - 1));
  }
  std::reverse(steps.begin(), steps.end());
  return steps;
}

}  // namespace

std::vector<Face> ZipSeam(const Seam& seam, const std::vector<Eigen::Vector3d>& position_mm) {
  const std::vector<Step> steps = StepsAcross(seam, position_mm);
  std::vector<Face> faces;
  for (size_t i = 1; i < steps.size(); ++i) {
    const auto [a, b] = steps[i];
    if (steps[i - 1].first < a) {
      faces.push_back({seam.side_a[a], seam.side_a[a - 1], seam.side_b[b]});
    } else {
      faces.push_back({seam.side_b[b - 1], seam.side_b[b], seam.side_a[a]});
    }
  }
  return faces;
}

std::vector<std::pair<int, int>> EdgesAcross(const Seam& seam,
                                             const std::vector<Eigen::Vector3d>& position_mm) {
  std::vector<std::pair<int, int>> edges;
  for (const auto& [a, b] : StepsAcross(seam, position_mm))
    edges.emplace_back(seam.side_a[a], seam.side_b[b]);
  return edges;
}

std::vector<Eigen::Vector3d> SeamMiddle(const Seam& seam, const std::vector<Eigen::Vector3d>& position_mm,
                                        const std::vector<Eigen::Vector3d>& outward, double spacing_mm) {
  std::vector<Eigen::Vector3d> path;
  std::vector<double> run_mm;  // along the path
  for (const auto& [a, b] : EdgesAcross(seam, position_mm)) {
    const Eigen::Vector3d middle = MeetingPoint(position_mm[a], outward[a], position_mm[b], outward[b]);
    run_mm.push_back(path.empty() ? 0 : run_mm.back() + (middle - path.back()).norm());
    path.push_back(middle);
  }
  const int intervals = std::max(1, static_cast<int>(std::lround(run_mm.back() / spacing_mm)));
  std::vector<Eigen::Vector3d> row;
  size_t at = 0;
  for (int k = 0; k <= intervals; ++k) {
    const double goal_mm = run_mm.back() * k / intervals;
    while (at + 2 < path.size() && run_mm[at + 1] < goal_mm) ++at;
    const double step_mm = run_mm[at + 1] - run_mm[at];
    const double share = step_mm > 0 ? std::clamp((goal_mm - run_mm[at]) / step_mm, 0.0, 1.0) : 0;
    row.push_back(path[at] + share * (path[at + 1] - path[at]));
  }
  return row;
}

absl::StatusOr<std::vector<Face>> FillHole(const std::vector<int>& loop,
                                           const std::vector<Eigen::Vector3d>& position_mm,
                                           const std::vector<Face>& faces) {
  constexpr int kMostVertices = 300;
  const int n = static_cast<int>(loop.size());
  if (n > kMostVertices) {
    return absl::FailedPreconditionError(
        absl::StrCat("a hole with ", n, " vertices is too large to be closed without new ones"));
  }
  std::set<std::pair<int, int>> taken;  // edges between vertices of the loop
  const std::set<int> on_loop(loop.begin(), loop.end());
  for (const Face& face : faces) {
    for (int i = 0; i < 3; ++i) {
      const int from = face[i], to = face[(i + 1) % 3];
      if (on_loop.contains(from) && on_loop.contains(to)) taken.insert(std::minmax(from, to));
    }
  }
  const auto chord_free = [&](int i, int j) {
    return j == i + 1 || (i == 0 && j == n - 1) || !taken.contains(std::minmax(loop[i], loop[j]));
  };
  const auto area = [&](int i, int j, int k) {
    const Eigen::Vector3d& corner = position_mm[loop[i]];
    return (position_mm[loop[j]] - corner).cross(position_mm[loop[k]] - corner).norm();
  };
  // Least area over the polygon from i to k, and the corner of its triangle at the chord from i to k.
  std::vector<double> least(static_cast<size_t>(n) * n, 0);
  std::vector<int> corner(least.size(), -1);
  for (int span = 2; span < n; ++span) {
    for (int i = 0, k = span; k < n; ++i, ++k) {
      double& best = least[i * n + k];
      best = std::numeric_limits<double>::infinity();
      if (!chord_free(i, k)) continue;
      for (int j = i + 1; j < k; ++j) {
        const double sum = least[i * n + j] + least[j * n + k] + area(i, j, k);
        if (sum < best) best = sum, corner[i * n + k] = j;
      }
    }
  }
  if (n < 3 || corner[n - 1] < 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("a hole with ", n, " vertices cannot be closed without doubling an edge"));
  }
  std::vector<Face> filling;
  const std::function<void(int, int)> add = [&](int i, int k) {
    if (k - i < 2) return;
    const int j = corner[i * n + k];
    filling.push_back({loop[k], loop[j], loop[i]});
    add(i, j);
    add(j, k);
  };
  add(0, n - 1);
  return filling;
}

}  // namespace weft
