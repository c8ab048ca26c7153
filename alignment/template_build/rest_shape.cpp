#include "alignment/template_build/rest_shape.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/status_macros.h"

namespace weft {
namespace {

struct Spring {
  int a, b;
  double length_mm, weight;
};

// Edges of the faces [first, last), ascending.
std::vector<std::pair<int, int>> EdgesOf(const std::vector<Face>& faces, size_t first, size_t last) {
  std::vector<std::pair<int, int>> edges;
  for (size_t f = first; f < last; ++f) {
    for (int i = 0; i < 3; ++i) edges.push_back(std::minmax(faces[f][i], faces[f][(i + 1) % 3]));
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

std::vector<std::pair<int, int>> PanelEdges(const RestShapeProblem& problem) {
  return EdgesOf(problem.faces, 0, problem.panel_faces);
}

std::vector<Spring> SpringsOf(const RestShapeProblem& problem, const RestShapeOptions& options) {
  std::vector<Spring> springs;
  const std::vector<std::pair<int, int>> within = PanelEdges(problem);
  for (const auto& [a, b] : within) {
    springs.push_back({a, b, (problem.flat_mm[b] - problem.flat_mm[a]).norm(), options.length_weight});
  }
  for (const auto& edge : EdgesOf(problem.faces, problem.panel_faces, problem.faces.size())) {
    if (std::binary_search(within.begin(), within.end(), edge)) continue;
    const auto [a, b] = edge;
    const double length_mm = (problem.start_mm[b] - problem.start_mm[a]).norm();
    springs.push_back(
        {a, b, std::min(length_mm, problem.most_seam_mm), options.length_weight * options.seam_weight});
  }
  for (const auto& [a, b, length_mm] : problem.measured) {
    springs.push_back({a, b, length_mm, options.length_weight});
  }
  return springs;
}

using Sparse = Eigen::SparseMatrix<double>;

Sparse Laplacian(int vertices, const std::vector<Spring>& springs, bool weighted) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(4 * springs.size());
  for (const Spring& spring : springs) {
    const double weight = weighted ? spring.weight : 1;
    entries.emplace_back(spring.a, spring.a, weight), entries.emplace_back(spring.b, spring.b, weight);
    entries.emplace_back(spring.a, spring.b, -weight), entries.emplace_back(spring.b, spring.a, -weight);
  }
  Sparse matrix(vertices, vertices);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// Only the rows of vertices at least so many edges inside a panel; those beside its border have no neighbours
// all around.
Sparse WithoutBorders(const Sparse& laplacian, const RestShapeProblem& problem, int border_rings) {
  std::vector<std::pair<int, int>> sides;
  std::vector<int> ring(laplacian.rows(), 0);  // 0 on borders and outside of panels, -1 for the others
  for (int f = 0; f < problem.panel_faces; ++f) {
    const Face& face = problem.faces[f];
    for (int i = 0; i < 3; ++i) {
      sides.push_back(std::minmax(face[i], face[(i + 1) % 3]));
      ring[face[i]] = -1;
    }
  }
  std::sort(sides.begin(), sides.end());
  for (size_t i = 0; i < sides.size(); ++i) {
    const bool shared =
        (i > 0 && sides[i - 1] == sides[i]) || (i + 1 < sides.size() && sides[i + 1] == sides[i]);
    if (!shared) ring[sides[i].first] = ring[sides[i].second] = 0;
  }
  for (int depth = 0; depth + 1 < border_rings; ++depth) {
    for (const auto& [a, b] : sides) {
      if (ring[a] == depth && ring[b] < 0) ring[b] = depth + 1;
      if (ring[b] == depth && ring[a] < 0) ring[a] = depth + 1;
    }
  }
  Eigen::VectorXd inside(laplacian.rows());
  for (Eigen::Index v = 0; v < inside.size(); ++v) inside[v] = ring[v] < 0 ? 1 : 0;
  return inside.asDiagonal() * laplacian;
}

// A linear system of which some unknowns are given.
class FreePart {
 public:
  FreePart(const Sparse& matrix, const std::vector<bool>& fixed) {
    std::vector<int> index(matrix.rows(), -1);
    for (int v = 0; v < matrix.rows(); ++v) {
      if (!fixed.empty() && fixed[v]) continue;
      index[v] = static_cast<int>(free_.size());
      free_.push_back(v);
    }
    std::vector<Eigen::Triplet<double>> inner, outer;
    for (const int v : free_) {
      for (Sparse::InnerIterator entry(matrix, v); entry; ++entry) {
        const int other = static_cast<int>(entry.row());
        if (index[other] >= 0) {
          inner.emplace_back(index[other], index[v], entry.value());
        } else {
          outer.emplace_back(index[v], other, entry.value());
        }
      }
    }
    Sparse system(free_.size(), free_.size());
    system.setFromTriplets(inner.begin(), inner.end());
    given_.resize(free_.size(), matrix.cols());
    given_.setFromTriplets(outer.begin(), outer.end());
    factor_.compute(system);
  }

  bool ok() const { return factor_.info() == Eigen::Success; }

  // Replaces the free rows of `values`.
  void Solve(const Eigen::MatrixX3d& right, Eigen::MatrixX3d* values) const {
    Eigen::MatrixX3d free_right = -(given_ * *values);
    for (size_t i = 0; i < free_.size(); ++i) free_right.row(i) += right.row(free_[i]);
    const Eigen::MatrixX3d solution = factor_.solve(free_right);
    for (size_t i = 0; i < free_.size(); ++i) values->row(free_[i]) = solution.row(i);
  }

 private:
  std::vector<int> free_;
  Sparse given_;
  Eigen::SimplicialLDLT<Sparse, Eigen::Lower> factor_;
};

}  // namespace

absl::Status RestShapeOptions::Validate() const {
  if (iterations < 1) return absl::InvalidArgumentError("iterations must be 1 or more");
  if (!(length_weight > 0)) return absl::InvalidArgumentError("length_weight must be above 0");
  if (!(seam_weight > 0)) return absl::InvalidArgumentError("seam_weight must be above 0");
  if (!(bending_weight >= 0)) return absl::InvalidArgumentError("bending_weight must be 0 or more");
  if (border_rings < 1) return absl::InvalidArgumentError("border_rings must be 1 or more");
  if (!(kept_bends >= 0 && kept_bends <= 1)) {
    return absl::InvalidArgumentError("kept_bends must be from 0 to 1");
  }
  if (!(seen_weight > 0)) return absl::InvalidArgumentError("seen_weight must be above 0");
  if (!(unseen_weight > 0)) return absl::InvalidArgumentError("unseen_weight must be above 0");
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Eigen::Vector3d>> RefineRestShape(const RestShapeProblem& problem,
                                                             const RestShapeOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  const int vertices = static_cast<int>(problem.start_mm.size());
  const std::vector<Spring> springs = SpringsOf(problem, options);
  const Sparse graph =
      WithoutBorders(Laplacian(vertices, springs, /*weighted=*/false), problem, options.border_rings);
  Sparse matrix = Laplacian(vertices, springs, /*weighted=*/true);
  const Sparse bending = options.bending_weight * (graph.transpose() * graph);
  matrix += bending;
  Eigen::MatrixX3d start(vertices, 3);
  Eigen::VectorXd hold(vertices);
  for (int v = 0; v < vertices; ++v) {
    start.row(v) = problem.start_mm[v];
    hold[v] = problem.seen[v] ? options.seen_weight : options.unseen_weight;
  }
  matrix += Sparse(hold.asDiagonal());
  const FreePart free(matrix, problem.fixed);
  if (!free.ok()) {
    return absl::InternalError("rest shape: the matrix of the edges could not be factorised");
  }
  const Eigen::MatrixX3d held = options.kept_bends * (bending * start) + hold.asDiagonal() * start;
  Eigen::MatrixX3d position = start;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    Eigen::MatrixX3d right = held;
    for (const Spring& spring : springs) {
      Eigen::RowVector3d edge = position.row(spring.b) - position.row(spring.a);
      const double length_mm = edge.norm();
      if (length_mm < 1e-9) continue;
      edge *= spring.weight * spring.length_mm / length_mm;
      right.row(spring.a) -= edge;
      right.row(spring.b) += edge;
    }
    free.Solve(right, &position);
  }
  std::vector<Eigen::Vector3d> rest_mm(vertices);
  for (int v = 0; v < vertices; ++v) rest_mm[v] = position.row(v);
  return rest_mm;
}

RestStrain MeasureRestStrain(const RestShapeProblem& problem, const std::vector<Eigen::Vector3d>& rest_mm) {
  RestStrain strain;
  std::vector<double> all, sum(rest_mm.size(), 0);
  std::vector<int> count(rest_mm.size(), 0);
  for (const auto& [a, b] : PanelEdges(problem)) {
    const double flat_mm = (problem.flat_mm[b] - problem.flat_mm[a]).norm();
    const double value = std::abs((rest_mm[b] - rest_mm[a]).norm() / flat_mm - 1);
    all.push_back(value);
    for (const int v : {a, b}) sum[v] += value, ++count[v];
  }
  for (size_t v = 0; v < sum.size(); ++v) strain.of_vertex.push_back(count[v] > 0 ? sum[v] / count[v] : 0);
  if (all.empty()) return strain;
  std::sort(all.begin(), all.end());
  strain.median = all[all.size() / 2];
  strain.p95 = all[all.size() * 95 / 100];
  strain.most = all.back();
  return strain;
}

}  // namespace weft
