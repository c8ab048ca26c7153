#include "triangulation/clean.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"

namespace weft {
namespace {

// Nodes at most so many rows and columns away are neighbours, and lie within kRadiusEdges: just over the
// diagonal of three cells.
constexpr int kReachCells = 3;
constexpr double kRadiusEdges = 4.3;

// A node may have so many edges longer than max_edge_ratio.
constexpr int kMaxLongEdges = 1;

// Bonds between pieces bridge so many cells.
constexpr int kMaxGapCells = 10;

using Offset = std::pair<int, int>;  // rows, columns
constexpr std::array<Offset, 4> kSides = {{{-1, 0}, {0, -1}, {0, 1}, {1, 0}}};

// The points of one kind, by their place on the board.
class Lattice {
 public:
  Lattice(const std::vector<CloudPoint>& points, NodeKind kind) : points_(points) {
    for (size_t i = 0; i < points.size(); ++i) {
      if (points[i].node.kind != kind) continue;
      members_.push_back(static_cast<int>(i));
      rows_ = std::max(rows_, points[i].node.row + 1);
      cols_ = std::max(cols_, points[i].node.col + 1);
    }
    at_.assign(static_cast<size_t>(rows_) * cols_, -1);
    for (const int i : members_) at_[Slot(points[i].node.row, points[i].node.col)] = i;
    edge_mm_ = MedianEdge();
  }

  const std::vector<int>& members() const { return members_; }
  double edge_mm() const { return edge_mm_; }  // 0 without edges

  // The point that many rows and columns from point i; -1 where there is none, or it was removed.
  int Neighbor(int i, const Offset& offset) const {
    const int row = points_[i].node.row + offset.first, col = points_[i].node.col + offset.second;
    return row >= 0 && row < rows_ && col >= 0 && col < cols_ ? at_[Slot(row, col)] : -1;
  }
  double Distance(int i, int j) const { return (points_[i].position_mm - points_[j].position_mm).norm(); }

  void Remove(const std::vector<int>& removed) {
    for (const int i : removed) at_[Slot(points_[i].node.row, points_[i].node.col)] = -1;
    std::erase_if(members_, [&](int i) { return Neighbor(i, {0, 0}) < 0; });
  }

 private:
  size_t Slot(int row, int col) const { return static_cast<size_t>(row) * cols_ + col; }

  double MedianEdge() const {
    std::vector<double> lengths;
    for (const int i : members_) {
      for (const Offset& side : {Offset{0, 1}, Offset{1, 0}}) {
        if (const int j = Neighbor(i, side); j >= 0) lengths.push_back(Distance(i, j));
      }
    }
    return Median(std::move(lengths));
  }

  const std::vector<CloudPoint>& points_;
  std::vector<int> members_;
  std::vector<int> at_;  // [rows][cols]
  int rows_ = 0, cols_ = 0;
  double edge_mm_ = 0;
};

// Offsets of up to `reach` rows and columns, (0, 0) left out.
std::vector<Offset> OffsetsWithin(int reach) {
  std::vector<Offset> offsets;
  for (int r = -reach; r <= reach; ++r) {
    for (int c = -reach; c <= reach; ++c) {
      if (r != 0 || c != 0) offsets.emplace_back(r, c);
    }
  }
  return offsets;
}

std::vector<int> FindIsolated(const Lattice& lattice, const CleaningOptions& options) {
  const std::vector<Offset> offsets = OffsetsWithin(kReachCells);
  const double radius_mm = kRadiusEdges * lattice.edge_mm();
  std::vector<int> isolated;
  for (const int i : lattice.members()) {
    int present = 0, near = 0;
    for (const Offset& offset : offsets) {
      const int j = lattice.Neighbor(i, offset);
      if (j < 0) continue;
      ++present;
      if (lattice.Distance(i, j) <= radius_mm) ++near;
    }
    if (near < options.min_neighbors || near < options.min_near_share * present) isolated.push_back(i);
  }
  return isolated;
}

// Takes the node with most long edges first, so that good nodes beside a bad one stay.
std::vector<int> FindStretched(const Lattice& lattice, size_t points, const CleaningOptions& options) {
  const double limit_mm = options.max_edge_ratio * lattice.edge_mm();
  std::vector<int> long_edges(points, 0);
  std::priority_queue<std::tuple<int, int>> worst;  // long edges, minus index
  for (const int i : lattice.members()) {
    for (const Offset& side : kSides) {
      const int j = lattice.Neighbor(i, side);
      if (j >= 0 && lattice.Distance(i, j) > limit_mm) ++long_edges[i];
    }
    if (long_edges[i] > kMaxLongEdges) worst.emplace(long_edges[i], -i);
  }
  std::vector<int> stretched;
  std::vector<bool> gone(points, false);
  while (!worst.empty()) {
    const auto [count, minus_index] = worst.top();
    worst.pop();
    const int i = -minus_index;
    if (gone[i] || count != long_edges[i]) continue;  // removed, or queued again with fewer
    gone[i] = true;
    stretched.push_back(i);
    for (const Offset& side : kSides) {
      const int j = lattice.Neighbor(i, side);
      if (j < 0 || gone[j] || lattice.Distance(i, j) <= limit_mm) continue;
      if (--long_edges[j] > kMaxLongEdges) worst.emplace(long_edges[j], -j);
    }
  }
  return stretched;
}

// Which nodes around a node belong to the same cloth.
class Bonds {
 public:
  Bonds(const Lattice& lattice, int reach, double max_edge_ratio)
      : lattice_(lattice), offsets_(OffsetsWithin(reach)) {
    for (const auto& [rows, cols] : offsets_) {
      limits_mm_.push_back(max_edge_ratio * std::hypot(rows, cols) * lattice.edge_mm());
    }
  }

  // True if `visit(neighbour)` was true for one of the nodes bound to i; stops there.
  template <typename Visit>
  bool AnyOf(int i, const Visit& visit) const {
    for (size_t k = 0; k < offsets_.size(); ++k) {
      const int j = lattice_.Neighbor(i, offsets_[k]);
      if (j >= 0 && lattice_.Distance(i, j) <= limits_mm_[k] && visit(j)) return true;
    }
    return false;
  }

 private:
  const Lattice& lattice_;
  std::vector<Offset> offsets_;
  std::vector<double> limits_mm_;
};

// In the order of their first point.
std::vector<std::vector<int>> FindPieces(const Lattice& lattice, size_t points, const Bonds& bonds) {
  std::vector<std::vector<int>> pieces;
  std::vector<bool> visited(points, false);
  for (const int seed : lattice.members()) {
    if (visited[seed]) continue;
    visited[seed] = true;
    std::vector<int> piece = {seed};
    for (size_t next = 0; next < piece.size(); ++next) {
      bonds.AnyOf(piece[next], [&](int j) {
        if (!visited[j]) piece.push_back(j);
        visited[j] = true;
        return false;
      });
    }
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

std::vector<int> FindSmallPieces(const Lattice& lattice, size_t points, const CleaningOptions& options) {
  const std::vector<std::vector<int>> pieces =
      FindPieces(lattice, points, Bonds(lattice, kReachCells, options.max_edge_ratio));
  size_t largest = 0;
  for (const auto& piece : pieces) largest = std::max(largest, piece.size());
  const size_t enough = std::min(largest, static_cast<size_t>(options.min_component));
  std::vector<bool> trusted(points, false);
  for (const auto& piece : pieces) {
    for (const int i : piece) trusted[i] = piece.size() >= enough;
  }
  const Bonds wide(lattice, kMaxGapCells, options.max_edge_ratio);
  std::vector<int> small;
  for (const auto& piece : pieces) {
    if (piece.size() >= enough) continue;
    const bool attached = std::any_of(
        piece.begin(), piece.end(), [&](int i) { return wide.AnyOf(i, [&](int j) { return trusted[j]; }); });
    if (!attached) small.insert(small.end(), piece.begin(), piece.end());
  }
  return small;
}

std::vector<int> FindUnconfirmed(const Lattice& lattice, const std::vector<CloudPoint>& points,
                                 const CleaningOptions& options) {
  const std::vector<Offset> offsets = OffsetsWithin(kReachCells);
  std::vector<int> unconfirmed;
  for (const int i : lattice.members()) {
    if (points[i].views > 2) continue;
    int witnesses = 0;
    bool contradicted = false;
    for (const Offset& offset : offsets) {
      const int j = lattice.Neighbor(i, offset);
      if (j < 0 || points[j].views <= 2) continue;
      ++witnesses;
      const double cloth_mm = std::hypot(offset.first, offset.second) * lattice.edge_mm();
      contradicted = contradicted ||
                     lattice.Distance(i, j) > (1 + options.max_strain) * cloth_mm + 3 * points[i].sigma_mm;
    }
    if (contradicted || witnesses < options.min_witnesses) unconfirmed.push_back(i);
  }
  return unconfirmed;
}

}  // namespace

absl::Status CleaningOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("cleaning.", what));
  };
  if (min_neighbors < 0) return bad("min_neighbors must not be negative");
  if (!(min_near_share >= 0 && min_near_share <= 1)) return bad("min_near_share must lie in 0 to 1");
  if (!(max_edge_ratio > 1)) return bad("max_edge_ratio must be greater than 1");
  if (min_component < 1) return bad("min_component must be at least 1");
  if (min_witnesses < 0) return bad("min_witnesses must not be negative");
  if (!(max_strain >= 0)) return bad("max_strain must not be negative");
  return absl::OkStatus();
}

Cloud CleanCloud(Cloud cloud, const CleaningOptions& options) {
  const size_t points = cloud.points.size();
  std::vector<std::optional<RejectReason>> reason(points);
  for (const NodeKind kind : {NodeKind::kCenter, NodeKind::kCorner}) {
    Lattice lattice(cloud.points, kind);
    const auto reject = [&](const std::vector<int>& failed, RejectReason why) {
      for (const int i : failed) reason[i] = why;
      lattice.Remove(failed);
    };
    reject(FindIsolated(lattice, options), RejectReason::kIsolated);
    reject(FindStretched(lattice, points, options), RejectReason::kStretchedEdges);
    reject(FindSmallPieces(lattice, points, options), RejectReason::kSmallComponent);
    reject(FindUnconfirmed(lattice, cloud.points, options), RejectReason::kUnconfirmed);
  }
  Cloud clean;
  clean.rejected = std::move(cloud.rejected);
  for (size_t i = 0; i < points; ++i) {
    const CloudPoint& point = cloud.points[i];
    if (reason[i]) {
      clean.rejected.push_back({point.node, point.views, *reason[i]});
    } else {
      clean.points.push_back(point);
    }
  }
  std::stable_sort(clean.rejected.begin(), clean.rejected.end(), [](const auto& a, const auto& b) {
    return std::tuple(a.node.kind, a.node.row, a.node.col) < std::tuple(b.node.kind, b.node.row, b.node.col);
  });
  return clean;
}

}  // namespace weft
