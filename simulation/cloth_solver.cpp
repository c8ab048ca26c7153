#include "simulation/cloth_solver.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace weft {
namespace {

constexpr double kPairMarginCells = 0.6;  // pairs are listed this much before they touch
constexpr double kNeighborCells = 1.6;    // vertices closer than this at rest are no contact pair
constexpr double kKgPerMm2PerKgPerM2 = 1e-6;
constexpr double kKgMm2PerS2PerNm = 1e6;  // 1 N m = 1e6 kg mm^2 / s^2
constexpr double kKgPerS2PerNPerM = 1;    // 1 N/m = 1 kg / s^2

// Grid spacing that a vertex stands for along one grid line, in cells.
std::vector<double> LineShares(const std::vector<double>& positions, bool closed, int cells) {
  const size_t n = positions.size();
  std::vector<double> share(n, 0);
  for (size_t i = 0; i + 1 < n; ++i) {
    share[i] += (positions[i + 1] - positions[i]) / 2;
    share[i + 1] += (positions[i + 1] - positions[i]) / 2;
  }
  if (closed) {
    const double gap = cells + positions.front() - positions.back();
    share.front() += gap / 2, share.back() += gap / 2;
  }
  return share;
}

}  // namespace

ClothSolver::ClothSolver(const Cloth& cloth, const FabricOptions& fabric)
    : fabric_(fabric),
      cell_mm_(cloth.options.cell_mm),
      thickness_mm_(fabric.thickness_cells * cloth.options.cell_mm),
      rest_(cloth.rest.vertices_mm),
      x_(rest_),
      previous_(rest_),
      v_(rest_.size(), Eigen::Vector3d::Zero()),
      inverse_mass_(rest_.size(), 0) {
  const std::vector<double> down = LineShares(cloth.row_position, false, cloth.options.rows);
  const std::vector<double> across = LineShares(cloth.col_position, cloth.closed, cloth.options.cols);
  const double cell_kg = fabric.density_kg_m2 * kKgPerMm2PerKgPerM2 * cell_mm_ * cell_mm_;
  for (int i = 0; i < cloth.grid_rows; ++i)
    for (int j = 0; j < cloth.grid_cols; ++j)
      inverse_mass_[cloth.vertex_at(i, j)] = 1 / (cell_kg * down[i] * across[j]);
  AddEdges(cloth);
  AddBends(cloth);
}

void ClothSolver::AddEdges(const Cloth& cloth) {
  const auto add = [&](int a, int b, double compliance) {
    edges_.push_back({a, b, (rest_[a] - rest_[b]).norm(), compliance});
  };
  const double shear = 1 / (fabric_.shear_n_per_m * kKgPerS2PerNPerM);
  const int quads_across = cloth.closed ? cloth.grid_cols : cloth.grid_cols - 1;
  for (int i = 0; i < cloth.grid_rows; ++i) {
    for (int j = 0; j < quads_across; ++j) {
      const int next = (j + 1) % cloth.grid_cols;
      add(cloth.vertex_at(i, j), cloth.vertex_at(i, next), 0);
    }
    if (i + 1 == cloth.grid_rows) break;
    for (int j = 0; j < cloth.grid_cols; ++j) add(cloth.vertex_at(i, j), cloth.vertex_at(i + 1, j), 0);
    for (int j = 0; j < quads_across; ++j) {
      const int next = (j + 1) % cloth.grid_cols;
      add(cloth.vertex_at(i, j), cloth.vertex_at(i + 1, next), shear);
      add(cloth.vertex_at(i, next), cloth.vertex_at(i + 1, j), shear);
    }
  }
}

void ClothSolver::AddBends(const Cloth& cloth) {
  const auto add = [&](int a, int b, int c) {
    const double before = (rest_[b] - rest_[a]).norm(), after = (rest_[c] - rest_[b]).norm();
    const double wa = 2 / (before * (before + after)), wc = 2 / (after * (before + after));
    // Energy of curvature k on the area of a cell: B k^2 area / 2.
    const double stiffness = fabric_.bending_n_m * kKgMm2PerS2PerNm * cell_mm_ * cell_mm_;
    bends_.push_back({a, b, c, wa, -wa - wc, wc, 1 / stiffness});
  };
  const int n = cloth.grid_cols;
  for (int i = 0; i < cloth.grid_rows; ++i) {
    for (int j = 0; j < n; ++j) {
      if (i >= 1 && i + 1 < cloth.grid_rows)
        add(cloth.vertex_at(i - 1, j), cloth.vertex_at(i, j), cloth.vertex_at(i + 1, j));
      if (cloth.closed || (j >= 1 && j + 1 < n))
        add(cloth.vertex_at(i, (j + n - 1) % n), cloth.vertex_at(i, j), cloth.vertex_at(i, (j + 1) % n));
    }
  }
}

void ClothSolver::Pin(const std::vector<int>& vertices) {
  pinned_ = vertices;
  for (const int v : pinned_) inverse_mass_[v] = 0;
}

void ClothSolver::Step(double step_s, const Eigen::Vector3d& acceleration_mm_s2,
                       const std::vector<Eigen::Vector3d>& pinned_mm) {
  const double keep = std::max(0.0, 1 - fabric_.air_drag_per_s * step_s);
  previous_ = x_;
  for (size_t i = 0; i < x_.size(); ++i) {
    if (inverse_mass_[i] == 0) continue;
    x_[i] += step_s * (keep * v_[i] + step_s * acceleration_mm_s2);
  }
  for (size_t k = 0; k < pinned_.size(); ++k) x_[pinned_[k]] = pinned_mm[k];
  RefreshContacts();
  SolveBends(step_s);
  SolveEdges(step_s);
  SolveContacts();
  SolveBody();
  // No vertex crosses more than a fifth of a layer's thickness in a step, so none slips through a layer.
  const double longest = 0.2 * thickness_mm_;
  for (size_t i = 0; i < x_.size(); ++i) {
    Eigen::Vector3d move = x_[i] - previous_[i];
    const double length = move.norm();
    if (length > longest && inverse_mass_[i] != 0) {
      move *= longest / length;
      x_[i] = previous_[i] + move;
    }
    v_[i] = move / step_s;
  }
}

void ClothSolver::SolveEdges(double step_s) {
  const double per_step = 1 / (step_s * step_s);
  const auto solve = [&](const Edge& e) {
    const double wa = inverse_mass_[e.a], wb = inverse_mass_[e.b];
    const Eigen::Vector3d d = x_[e.a] - x_[e.b];
    const double length = d.norm();
    const double w = wa + wb;
    if (w == 0 || length < 1e-9) return;
    const double lambda = (e.rest_mm - length) / (w + e.compliance * per_step);
    const Eigen::Vector3d push = d * (lambda / length);
    x_[e.a] += wa * push;
    x_[e.b] -= wb * push;
  };
  // One order, from the upper border down. Alternating it would carry corrections faster, but excites a
  // standing wave of period two.
  for (const Edge& e : edges_) solve(e);
}

void ClothSolver::SolveBends(double step_s) {
  const double per_step = 1 / (step_s * step_s);
  for (const Bend& b : bends_) {
    const double ma = inverse_mass_[b.a], mb = inverse_mass_[b.b], mc = inverse_mass_[b.c];
    const double w = ma * b.wa * b.wa + mb * b.wb * b.wb + mc * b.wc * b.wc;
    if (w == 0) continue;
    // The constraint |k| = 0 of the curvature vector k has the unit gradient k / |k|, which cancels.
    const Eigen::Vector3d k = b.wa * x_[b.a] + b.wb * x_[b.b] + b.wc * x_[b.c];
    const Eigen::Vector3d push = k / (w + b.compliance * per_step);
    x_[b.a] -= ma * b.wa * push;
    x_[b.b] -= mb * b.wb * push;
    x_[b.c] -= mc * b.wc * push;
  }
}

void ClothSolver::SolveContacts() {
  const double squared = thickness_mm_ * thickness_mm_;
  for (const Pair& p : pairs_) {
    const Eigen::Vector3d d = x_[p.a] - x_[p.b];
    const double length2 = d.squaredNorm();
    if (length2 >= squared || length2 < 1e-12) continue;
    const double w = inverse_mass_[p.a] + inverse_mass_[p.b];
    if (w == 0) continue;
    const double length = std::sqrt(length2);
    const Eigen::Vector3d push = d * ((thickness_mm_ - length) / (length * w));
    x_[p.a] += inverse_mass_[p.a] * push;
    x_[p.b] -= inverse_mass_[p.b] * push;
    // Layers that touch stick to each other a little: half of their relative motion is lost.
    const Eigen::Vector3d slip = (x_[p.a] - previous_[p.a]) - (x_[p.b] - previous_[p.b]);
    x_[p.a] -= 0.5 * inverse_mass_[p.a] / w * slip;
    x_[p.b] += 0.5 * inverse_mass_[p.b] / w * slip;
  }
}

void ClothSolver::SolveBody() {
  if (body_radius_mm_ <= 0) return;
  const double squared = body_radius_mm_ * body_radius_mm_;
  for (size_t i = 0; i < x_.size(); ++i) {
    const double r2 = x_[i].x() * x_[i].x() + x_[i].z() * x_[i].z();
    if (r2 >= squared || r2 < 1e-12 || inverse_mass_[i] == 0) continue;
    const double grow = body_radius_mm_ / std::sqrt(r2);
    x_[i].x() *= grow;
    x_[i].z() *= grow;
  }
}

void ClothSolver::RefreshContacts() {
  const double limit = 0.5 * kPairMarginCells * cell_mm_;
  bool moved = at_refresh_.empty();
  for (size_t i = 0; i < x_.size() && !moved; ++i)
    moved = (x_[i] - at_refresh_[i]).squaredNorm() > limit * limit;
  if (!moved) return;
  at_refresh_ = x_;
  FindPairs();
}

void ClothSolver::FindPairs() {
  const double reach = thickness_mm_ + kPairMarginCells * cell_mm_;
  const double apart_at_rest = kNeighborCells * cell_mm_;
  // Vertices sorted by the key of their grid box; boxes of a pair differ by at most 1 in each axis.
  struct Entry {
    uint64_t key;
    int vertex;
  };
  const auto key_of = [](int64_t x, int64_t y, int64_t z) {
    const uint64_t bias = 1 << 20;
    return (x + bias) << 42 | (y + bias) << 21 | (z + bias);
  };
  const auto box_of = [reach](double v) { return static_cast<int64_t>(std::floor(v / reach)); };
  std::vector<Entry> entries(x_.size());
  for (size_t i = 0; i < x_.size(); ++i)
    entries[i] = {key_of(box_of(x_[i].x()), box_of(x_[i].y()), box_of(x_[i].z())), static_cast<int>(i)};
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.key != b.key ? a.key < b.key : a.vertex < b.vertex;
  });
  pairs_.clear();
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      // A run of three boxes in z is contiguous in the sorted list; it slides along with the vertices.
      size_t first = 0;
      for (const Entry& e : entries) {
        const Eigen::Vector3d& p = x_[e.vertex];
        const int64_t bx = box_of(p.x()) + dx, by = box_of(p.y()) + dy, bz = box_of(p.z());
        const uint64_t low = key_of(bx, by, bz - 1), high = key_of(bx, by, bz + 1);
        while (first < entries.size() && entries[first].key < low) ++first;
        for (size_t k = first; k < entries.size() && entries[k].key <= high; ++k) {
          const int other = entries[k].vertex;
          if (other <= e.vertex || (x_[other] - p).squaredNorm() > reach * reach) continue;
          if ((rest_[other] - rest_[e.vertex]).norm() > apart_at_rest) pairs_.push_back({e.vertex, other});
        }
      }
    }
  }
}

bool ClothSolver::IsFinite() const {
  return std::all_of(x_.begin(), x_.end(), [](const Eigen::Vector3d& p) { return p.allFinite(); });
}

}  // namespace weft
