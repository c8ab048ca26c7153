#include "animation/paper/graph_fit.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "alignment/placement.h"

namespace weft {
namespace {

// Keeps the system definite where nodes lie so that no turn of theirs is seen, in the units of its terms.
constexpr double kLeastInformation = 1e-6;

// How a point moves with the turn of a node about `about`, and with its shift.
Eigen::Matrix<double, 3, 6> PointWays(const Eigen::Vector3d& point, const Eigen::Vector3d& about) {
  const Eigen::Vector3d a = point - about;
  Eigen::Matrix<double, 3, 6> out;
  out << 0, a.z(), -a.y(), 1, 0, 0, -a.z(), 0, a.x(), 0, 1, 0, a.y(), -a.x(), 0, 0, 0, 1;
  return out;
}

}  // namespace

absl::Status GraphFitOptions::Validate() const {
  if (!(distortion > 0)) return absl::InvalidArgumentError("graph fit: distortion must be positive");
  if (max_steps < 1) return absl::InvalidArgumentError("graph fit: max_steps must be at least 1");
  if (!(tolerance_mm >= 0)) return absl::InvalidArgumentError("graph fit: tolerance_mm must not be negative");
  return absl::OkStatus();
}

GraphFit::GraphFit(const DeformationGraph& graph, const GraphFitOptions& options)
    : graph_(graph), options_(options), slots_(static_cast<size_t>(graph.nodes())) {
  int slot = graph.nodes();
  for (const auto& [a, b] : graph.adjacent) slots_[static_cast<size_t>(a)].emplace_back(b, slot++);
  blocks_.resize(static_cast<size_t>(slot));
}

int GraphFit::SlotOf(int a, int b) const {
  if (a == b) return a;
  const auto& of_node = slots_[static_cast<size_t>(a)];
  return std::lower_bound(of_node.begin(), of_node.end(), std::pair(b, 0))->second;
}

void GraphFit::AddVertices(const std::vector<Eigen::Vector3d>& mesh_mm,
                           const std::vector<Eigen::Isometry3d>& motions, Eigen::VectorXd* right) {
  const auto count = static_cast<size_t>(graph_.nodes_of_vertex);
  std::vector<Eigen::Matrix<double, 3, 6>> ways(count);
  for (size_t v = 0; v < mesh_mm.size(); ++v) {
    const int* nodes = &graph_.skin_node[v * count];
    const double* weights = &graph_.skin_weight[v * count];
    Eigen::Vector3d left = mesh_mm[v];
    for (size_t k = 0; k < count; ++k) {
      const Eigen::Isometry3d& motion = motions[static_cast<size_t>(nodes[k])];
      const Eigen::Vector3d at = motion * graph_.rest_mm[v];
      left -= weights[k] * at;
      ways[k] = weights[k] * PointWays(at, motion * graph_.NodeMm(nodes[k]));
    }
    for (size_t a = 0; a < count; ++a) {
      if (weights[a] == 0) continue;
      right->segment<6>(6 * nodes[a]) += ways[a].transpose() * left;
      for (size_t b = 0; b < count; ++b)
        if (weights[b] != 0 && nodes[a] <= nodes[b])
          blocks_[static_cast<size_t>(SlotOf(nodes[a], nodes[b]))] += ways[a].transpose() * ways[b];
    }
  }
}

void GraphFit::AddDistortion(const std::vector<Eigen::Isometry3d>& motions, Eigen::VectorXd* right) {
  const auto add = [&](int i, int j, size_t slot, bool is_first) {  // T_i g_j - T_j g_j
    const Eigen::Isometry3d &of_i = motions[static_cast<size_t>(i)], &of_j = motions[static_cast<size_t>(j)];
    const Eigen::Vector3d there = of_j * graph_.NodeMm(j), told = of_i * graph_.NodeMm(j);
    const Eigen::Matrix<double, 3, 6> ways_i = PointWays(told, of_i * graph_.NodeMm(i)),
                                      ways_j = -PointWays(there, there);
    const Eigen::Vector3d left = there - told;
    right->segment<6>(6 * i) += options_.distortion * ways_i.transpose() * left;
    right->segment<6>(6 * j) += options_.distortion * ways_j.transpose() * left;
    blocks_[static_cast<size_t>(i)] += options_.distortion * ways_i.transpose() * ways_i;
    blocks_[static_cast<size_t>(j)] += options_.distortion * ways_j.transpose() * ways_j;
    const Block mixed = options_.distortion * ways_i.transpose() * ways_j;
    blocks_[slot] += is_first ? mixed : Block(mixed.transpose());
  };
  auto slot = static_cast<size_t>(graph_.nodes());
  for (const auto& [a, b] : graph_.adjacent) {
    add(a, b, slot, true);
    add(b, a, slot, false);
    ++slot;
  }
}

bool GraphFit::Solve(const Eigen::VectorXd& right, Eigen::VectorXd* step) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(36 * blocks_.size());
  // The lower half: rows of the larger node.
  const auto put = [&](int row, int column, const Block& block) {
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c) entries.emplace_back(6 * row + r, 6 * column + c, block(c, r));
  };
  for (int i = 0; i < graph_.nodes(); ++i) put(i, i, blocks_[static_cast<size_t>(i)]);
  auto slot = static_cast<size_t>(graph_.nodes());
  for (const auto& [a, b] : graph_.adjacent) put(b, a, blocks_[slot++]);
  const Eigen::Index size = 6 * graph_.nodes();
  Eigen::SparseMatrix<double> system(size, size);
  system.setFromTriplets(entries.begin(), entries.end());
  if (!is_analyzed_) solver_.analyzePattern(system);
  is_analyzed_ = true;
  solver_.factorize(system);
  if (solver_.info() != Eigen::Success) return false;
  *step = solver_.solve(right);
  return step->allFinite();
}

absl::StatusOr<std::vector<Eigen::Isometry3d>> GraphFit::Fit(const std::vector<Eigen::Vector3d>& mesh_mm,
                                                             std::vector<Eigen::Isometry3d> start) {
  if (mesh_mm.size() != graph_.rest_mm.size())
    return absl::InvalidArgumentError(absl::StrCat("graph fit: the mesh has ", mesh_mm.size(),
                                                   " vertices, the graph ", graph_.rest_mm.size()));
  if (!std::all_of(mesh_mm.begin(), mesh_mm.end(), [](const auto& p) { return p.allFinite(); }))
    return absl::InvalidArgumentError("graph fit: the mesh has a vertex that is not finite");
  std::vector<Eigen::Isometry3d> motions = std::move(start);
  if (motions.size() != static_cast<size_t>(graph_.nodes()))
    motions.assign(static_cast<size_t>(graph_.nodes()), RigidFit(graph_.rest_mm, mesh_mm));
  for (int round = 0; round < options_.max_steps; ++round) {
    for (Block& block : blocks_) block.setZero();
    for (int i = 0; i < graph_.nodes(); ++i)
      blocks_[static_cast<size_t>(i)].diagonal().setConstant(kLeastInformation);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(6 * graph_.nodes()), step;
    AddVertices(mesh_mm, motions, &right);
    AddDistortion(motions, &right);
    if (!Solve(right, &step)) return absl::InternalError("graph fit: the system has no solution");
    double furthest = 0;
    for (int i = 0; i < graph_.nodes(); ++i) {
      Eigen::Isometry3d& motion = motions[static_cast<size_t>(i)];
      const Eigen::Vector3d at = motion * graph_.NodeMm(i), turn = step.segment<3>(6 * i),
                            shift = step.segment<3>(6 * i + 3);
      const double angle = turn.norm();
      const Eigen::Matrix3d rotation =
          angle > 0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
      motion.linear() = Eigen::Quaterniond(rotation * motion.linear()).normalized().toRotationMatrix();
      motion.translation() = at + shift - motion.linear() * graph_.NodeMm(i);
      furthest = std::max(furthest, shift.norm());
    }
    if (furthest < options_.tolerance_mm) break;
  }
  return motions;
}

}  // namespace weft
