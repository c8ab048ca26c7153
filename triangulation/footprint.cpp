#include "triangulation/footprint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/median.h"

namespace weft {
namespace {

// Standard deviation of the average where too little around a centre was seen to take it out; fitted as
// FootprintOptions::fold_error is.
constexpr double kUncorrectedEdges = 0.01;

// Points of one kind by their place on the board.
class Places {
 public:
  Places(const std::vector<CloudPoint>& points, NodeKind kind) {
    for (const CloudPoint& p : points) {
      if (p.node.kind != kind) continue;
      rows_ = std::max(rows_, p.node.row + 1);
      cols_ = std::max(cols_, p.node.col + 1);
    }
    at_.assign(static_cast<size_t>(rows_) * cols_, -1);
    for (size_t i = 0; i < points.size(); ++i) {
      const BoardNode& node = points[i].node;
      if (node.kind == kind) at_[static_cast<size_t>(node.row) * cols_ + node.col] = static_cast<int>(i);
    }
  }

  // -1 where there is none.
  int At(int row, int col) const {
    return row >= 0 && col >= 0 && row < rows_ && col < cols_ ? at_[static_cast<size_t>(row) * cols_ + col]
                                                              : -1;
  }

 private:
  int rows_ = 0, cols_ = 0;
  std::vector<int> at_;  // [rows][cols]
};

// How far the mean of the places around a centre lies from it.
struct Bend {
  Eigen::Vector3d value_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();  // of that mean
  double own_share = 0;                                      // of the centre's own error in value_mm, negated
  bool by_corners = false;
  int axes = 0;  // without corners: directions of the board, of two, in which both neighbours are there

  bool whole() const { return by_corners || axes == 2; }
};

class Bends {
 public:
  explicit Bends(const std::vector<CloudPoint>& points)
      : points_(points), centers_(points, NodeKind::kCenter), corners_(points, NodeKind::kCorner) {
    std::vector<double> lengths;
    for (const CloudPoint& p : points) {
      if (p.node.kind != NodeKind::kCenter) continue;
      for (const int other :
           {centers_.At(p.node.row, p.node.col + 1), centers_.At(p.node.row + 1, p.node.col)}) {
        if (other >= 0) lengths.push_back((points[other].position_mm - p.position_mm).norm());
      }
    }
    edge_mm_ = Median(std::move(lengths));
  }

  double edge_mm() const { return edge_mm_; }  // 0 where no two centres are next to each other

  // Sums over pairs of bends.
  struct Differences {
    Eigen::Matrix3d square_mm2 = Eigen::Matrix3d::Zero();
    int pairs = 0;
  };
  // Between a centre's bend and those of the four around it; `found` [points].
  Differences DifferencesAt(const CloudPoint& center, const Bend& own, const std::vector<Bend>& found) const {
    Differences out;
    if (!own.whole()) return out;
    const auto [row, col, kind] = center.node;
    for (const int i : {centers_.At(row, col - 1), centers_.At(row, col + 1), centers_.At(row - 1, col),
                        centers_.At(row + 1, col)}) {
      if (i < 0 || !found[i].whole()) continue;
      const Eigen::Vector3d difference_mm = found[i].value_mm - own.value_mm;
      out.square_mm2 += difference_mm * difference_mm.transpose();
      ++out.pairs;
    }
    return out;
  }
  // Mean square over a centre and the eight around it; `at` [points].
  Eigen::Matrix3d MeanAround(const CloudPoint& center, const std::vector<Differences>& at) const {
    Differences sum;
    for (int row = center.node.row - 1; row <= center.node.row + 1; ++row) {
      for (int col = center.node.col - 1; col <= center.node.col + 1; ++col) {
        const int i = centers_.At(row, col);
        if (i < 0) continue;
        sum.square_mm2 += at[i].square_mm2;
        sum.pairs += at[i].pairs;
      }
    }
    return sum.square_mm2 / std::max(1, sum.pairs);
  }

  Bend At(const CloudPoint& center) const {
    const auto [row, col, kind] = center.node;
    Bend bend;
    const std::array<int, 4> around = {corners_.At(row, col), corners_.At(row, col + 1),
                                       corners_.At(row + 1, col), corners_.At(row + 1, col + 1)};
    if (std::ranges::all_of(around, [](int i) { return i >= 0; })) {
      bend.by_corners = true;
      for (const int i : around) Add(center, i, 0.25, &bend);
      return bend;
    }
    const std::array<std::array<int, 2>, 2> sides = {
        {{centers_.At(row, col - 1), centers_.At(row, col + 1)},
         {centers_.At(row - 1, col), centers_.At(row + 1, col)}}};
    for (const auto& [low, high] : sides) {
      if (low < 0 || high < 0) continue;
      ++bend.axes;
      for (const int i : {low, high}) Add(center, i, 0.25, &bend);
    }
    return bend;
  }

 private:
  void Add(const CloudPoint& center, int other, double share, Bend* bend) const {
    bend->value_mm += share * (points_[other].position_mm - center.position_mm);
    bend->covariance_mm2 += share * share * points_[other].covariance_mm2;
    bend->own_share += share;
  }

  const std::vector<CloudPoint>& points_;
  Places centers_, corners_;
  double edge_mm_ = 0;
};

// Share of the variance of the average that a bend by neighbouring centres leaves.
constexpr std::array<double, 3> kLeftByAxes = {1, 0.65, 0.45};

}  // namespace

absl::Status FootprintOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("triangulation.footprint.", what));
  };
  if (!(neighbor_share >= 0 && neighbor_share <= 0.8)) return bad("neighbor_share must lie in 0 to 0.8");
  if (!(fold_error >= 0)) return bad("fold_error must not be negative");
  if (!(shared_edges >= 0)) return bad("shared_edges must not be negative");
  return absl::OkStatus();
}

Cloud SharpenCenters(Cloud cloud, const FootprintOptions& options) {
  if (options.neighbor_share == 0) return cloud;
  const Cloud measured = cloud;
  const Bends bends(measured.points);
  const double edge_mm = bends.edge_mm();
  const double residual_mm2 = std::pow(edge_mm * kUncorrectedEdges, 2);
  std::vector<Bend> found(measured.points.size());
  std::vector<Bends::Differences> differences(measured.points.size());
  const auto for_centers = [&](const auto& step) {
    for (size_t i = 0; i < found.size(); ++i) {
      if (measured.points[i].node.kind == NodeKind::kCenter) step(i);
    }
  };
  for_centers([&](size_t i) { found[i] = bends.At(measured.points[i]); });
  for_centers([&](size_t i) { differences[i] = bends.DifferencesAt(measured.points[i], found[i], found); });
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    CloudPoint& point = cloud.points[i];
    if (point.node.kind == NodeKind::kCenter) {
      const Bend& bend = found[i];
      // Of corners, who average themselves, (1 - share) of the bend is left; of neighbours about all of it.
      const double gain = options.neighbor_share / (bend.by_corners ? 1 - options.neighbor_share : 1);
      const double left_mm2 = bend.by_corners ? 0 : kLeftByAxes[bend.axes] * residual_mm2;
      point.position_mm -= gain * bend.value_mm;
      point.covariance_mm2 =
          (1 + gain * bend.own_share) * (1 + gain * bend.own_share) * point.covariance_mm2 +
          gain * gain * bend.covariance_mm2 + left_mm2 * Eigen::Matrix3d::Identity();
      point.fold_covariance_mm2 =
          options.fold_error * options.fold_error * bends.MeanAround(measured.points[i], differences);
      point.covariance_mm2 += point.fold_covariance_mm2;
    }
    point.covariance_mm2.diagonal().array() += std::pow(edge_mm * options.shared_edges, 2);
    point.sigma_mm = std::sqrt(point.covariance_mm2.trace() / 3);
  }
  return cloud;
}

}  // namespace weft
