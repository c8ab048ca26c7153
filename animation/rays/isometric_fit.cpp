#include "animation/rays/isometric_fit.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace weft {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Longer steps leave the range in which lengths are linear, [mm].
constexpr double kLongestStepMm = 20;
constexpr int kHalvings = 4;

}  // namespace

absl::Status IsometricOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(std::string("isometric fit: ") + what);
  };
  if (!(least_strain > 0)) return bad("least_strain must be positive");
  if (!(tail_freedom > 0)) return bad("tail_freedom must be positive");
  if (!(bend_share > 0)) return bad("bend_share must be positive");
  if (max_steps < 1) return bad("max_steps must be at least 1");
  if (steps_of_factor < 1) return bad("steps_of_factor must be at least 1");
  if (!(tolerance_mm > 0)) return bad("tolerance_mm must be positive");
  return absl::OkStatus();
}

IsometricFit::IsometricFit(const MeshGraph& graph, const EdgeLengths& lengths,
                           const IsometricOptions& options)
    : graph_(graph), lengths_(lengths), options_(options) {
  const int n = 3 * graph.vertices;
  // In a column stand the vertex's own block, below the diagonal, and those of its later neighbours in turn.
  std::vector<Eigen::Triplet<double>> entries;
  const auto block = [&](int row, int column) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (row != column || i >= j)
          entries.emplace_back(3 * row + i, 3 * column + j, row == column && i == j);
  };
  for (int v = 0; v < graph.vertices; ++v) block(v, v);
  for (const MeshEdge& e : graph.edges) block(e.b, e.a);
  matrix_.resize(n, n);
  matrix_.setFromTriplets(entries.begin(), entries.end());
  std::vector<int> later(graph.vertices, 0);
  for (const MeshEdge& e : graph.edges) {
    for (int j = 0; j < 3; ++j)
      first_of_edge_.push_back(matrix_.outerIndexPtr()[3 * e.a + j] + 3 - j + 3 * later[e.a]);
    ++later[e.a];
  }
  double mean_mm = 0;
  for (size_t e = 0; e < graph.edges.size(); ++e) {
    const double length = lengths.mean_mm[e];
    spread_mm_.push_back(std::max(options.least_strain * length, static_cast<double>(lengths.spread_mm[e])));
    mean_mm += length / static_cast<double>(graph.edges.size());
  }
  bend_information_ = 1 / std::pow(options.bend_share * mean_mm, 2);
  expected_mm_.resize(graph.edges.size());
  gradient_.resize(n);
  factor_.analyzePattern(matrix_);
}

double IsometricFit::Energy(std::span<const RayEvidence> evidence, std::span<const Vector3d> carrier_mm,
                            std::span<const Vector3d> x) const {
  double sum = 0;
  for (size_t v = 0; v < evidence.size(); ++v)
    sum += x[v].dot(evidence[v].information * x[v] - 2 * evidence[v].moment);
  const double freedom = options_.tail_freedom, bend = bend_information_;
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    const auto [a, b] = graph_.edges[e];
    const Vector3d way = x[a] - x[b];
    const double off = (way.norm() - expected_mm_[e]) / spread_mm_[e];
    sum += (freedom + 1) * std::log1p(off * off / freedom);
    sum += bend * (way - carrier_mm[a] + carrier_mm[b]).squaredNorm();
  }
  return sum;
}

void IsometricFit::Build(std::span<const RayEvidence> evidence, std::span<const Vector3d> carrier_mm,
                         std::span<const Vector3d> x, bool with_matrix) {
  double* const values = matrix_.valuePtr();
  const int* const first = matrix_.outerIndexPtr();
  const auto diagonal = [&](int v, const Matrix3d& block) {
    for (int j = 0; j < 3; ++j)
      for (int i = j; i < 3; ++i) values[first[3 * v + j] + i - j] += block(i, j);
  };
  if (with_matrix) std::fill(values, values + matrix_.nonZeros(), 0.0);
  for (int v = 0; v < graph_.vertices; ++v) {
    if (with_matrix) diagonal(v, evidence[v].information);
    gradient_.segment<3>(3 * v) = evidence[v].information * x[v] - evidence[v].moment;
  }
  const double freedom = options_.tail_freedom, bend = bend_information_;
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    const auto [a, b] = graph_.edges[e];
    const Vector3d way = x[a] - x[b];
    const double length = std::max(1e-6, way.norm());
    const Vector3d along = way / length;
    const double too_long = length - expected_mm_[e], off = too_long / spread_mm_[e];
    const double weight = (freedom + 1) / (freedom + off * off) / (spread_mm_[e] * spread_mm_[e]);
    const Vector3d force = weight * too_long * along + bend * (way - carrier_mm[a] + carrier_mm[b]);
    gradient_.segment<3>(3 * a) += force;
    gradient_.segment<3>(3 * b) -= force;
    if (!with_matrix) continue;
    const Matrix3d block = weight * along * along.transpose() + bend * Matrix3d::Identity();
    diagonal(a, block), diagonal(b, block);
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) values[first_of_edge_[3 * e + j] + i] -= block(i, j);
  }
}

absl::Status IsometricFit::Solve(std::span<const RayEvidence> evidence, std::span<const Vector3d> carrier_mm,
                                 std::vector<Vector3d>* position_mm, bool is_alike) {
  std::vector<Vector3d>& x = *position_mm;
  std::vector<Vector3d> next(x.size());
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    const double mean = lengths_.mean_mm[e];
    const double length = (carrier_mm[graph_.edges[e].a] - carrier_mm[graph_.edges[e].b]).norm();
    expected_mm_[e] = mean + lengths_.follow[e] * (length - mean);
  }
  double energy = Energy(evidence, carrier_mm, x);
  // Steps that the factor is good for.
  int left = is_alike && has_factor_ ? options_.steps_of_factor : 0;
  for (int step = 1; step <= options_.max_steps; ++step) {
    const bool is_new = left == 0;
    Build(evidence, carrier_mm, x, is_new);
    if (is_new) {
      factor_.factorize(matrix_);
      has_factor_ = factor_.info() == Eigen::Success;
      if (!has_factor_) return absl::InternalError("isometric fit: the matrix could not be factorised");
      left = options_.steps_of_factor;
    }
    --left;
    const Eigen::VectorXd way = factor_.solve(gradient_);
    double longest = 0;
    for (size_t v = 0; v < x.size(); ++v)
      longest = std::max(longest, way.segment<3>(3 * static_cast<Eigen::Index>(v)).norm());
    const double typical = way.norm() / std::sqrt(static_cast<double>(x.size()));
    double scale = std::min(1.0, kLongestStepMm / std::max(longest, 1e-9));
    bool is_better = false;
    for (int halving = 0; halving <= kHalvings && !is_better; ++halving, scale *= 0.5) {
      for (size_t v = 0; v < x.size(); ++v)
        next[v] = x[v] - scale * way.segment<3>(3 * static_cast<Eigen::Index>(v));
      const double now = Energy(evidence, carrier_mm, next);
      is_better = now < energy;
      if (is_better) energy = now, std::swap(x, next);
    }
    if (!is_better && !is_new) {
      left = 0;
      continue;
    }
    if (!is_better || typical < options_.tolerance_mm) break;
  }
  return absl::OkStatus();
}

}  // namespace weft
