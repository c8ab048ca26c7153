#include "alignment/template_build/lift.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/fill.h"
#include "base/median.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr double kUnseenWeight = 0.001;  // of a place that only the fill gives, against 1 of a measured one
constexpr int kOutlierRounds = 2;
constexpr double kOutlierRatio =
    5;  // times the median distance of a point from the surface, and more than ...
constexpr double kOutlierPitches = 1.5;
constexpr int kMinPanelPoints = 30;  // a panel with fewer has no place

// The rotation that maps the flat edges at a vertex closest to those in space (Kabsch).
Eigen::Matrix3d RotationAt(const MeshGraph& graph, const std::vector<Eigen::Vector3d>& flat,
                           const std::vector<Eigen::Vector3d>& position, int v) {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (int i = graph.first[v]; i < graph.first[v + 1]; ++i) {
    const int other = graph.neighbor[i];
    covariance += (position[other] - position[v]) * (flat[other] - flat[v]).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

// Points further from the surface than cloth explains are no longer believed. Returns how many.
int SetOutliersAside(const std::vector<Eigen::Vector3d>& points, double ratio, double least_mm,
                     const Deformation& state, LiftedPanels* lifted) {
  std::vector<double> distance_mm;
  for (size_t v = 0; v < points.size(); ++v) {
    if (lifted->seen[v]) distance_mm.push_back((points[v] - state.position_mm[v]).norm());
  }
  if (distance_mm.empty()) return 0;
  const double limit_mm = std::max(ratio * Median(std::move(distance_mm)), least_mm);
  int outliers = 0;
  for (size_t v = 0; v < points.size(); ++v) {
    if (!lifted->seen[v] || (points[v] - state.position_mm[v]).norm() <= limit_mm) continue;
    lifted->seen[v] = false;
    ++outliers;
  }
  return outliers;
}

}  // namespace

PanelLifter::PanelLifter(const PanelSheet& sheet)
    : sheet_(sheet), graph_(BuildMeshGraph(sheet.flat)), slices_(SliceMesh(sheet.flat, graph_)) {}

absl::Status PanelLifter::Solve(const LiftedPanels& lifted, const std::vector<Eigen::Vector3d>& points,
                                Deformation* state) const {
  ElasticProblem problem{points, {}, {}};
  problem.weights.resize(points.size());
  for (size_t v = 0; v < points.size(); ++v) {
    if (!lifted.seen[v]) problem.targets_mm[v] = state->position_mm[v];
    problem.weights[v] = (lifted.seen[v] ? 1 : kUnseenWeight) * Eigen::Matrix3d::Identity();
  }
  return SolveElastic(slices_, graph_, problem, ElasticOptions{}, state).status();
}

absl::StatusOr<LiftedPanels> PanelLifter::Lift(const CellGrid& grid, double cell_mm) const {
  const size_t vertices = sheet_.cell_of_vertex.size();
  std::vector<Eigen::Vector3d> points = sheet_.flat.vertices_mm;
  LiftedPanels lifted{{}, std::vector<bool>(vertices, false), std::vector<bool>(sheet_.panels, false)};
  std::vector<int> panel_points(sheet_.panels, 0);
  for (size_t v = 0; v < vertices; ++v) {
    const int cell = grid.Index(sheet_.cell_of_vertex[v].row, sheet_.cell_of_vertex[v].col);
    if (!grid.seen[cell]) continue;
    points[v] = grid.position_mm[cell];
    lifted.seen[v] = true;
    ++panel_points[sheet_.panel_of_vertex[v]];
  }
  bool any = false;
  for (int panel = 0; panel < sheet_.panels; ++panel) {
    lifted.panel_placed[panel] = panel_points[panel] >= kMinPanelPoints;
    any = any || lifted.panel_placed[panel];
  }
  if (!any) return absl::FailedPreconditionError("the cloud shows none of the panels");
  for (size_t v = 0; v < vertices; ++v) {
    lifted.seen[v] = lifted.seen[v] && lifted.panel_placed[sheet_.panel_of_vertex[v]];
  }

  Deformation state{points, {}};
  for (int round = 0;; ++round) {
    // Panels without a place stay on the board.
    WEFT_RETURN_IF_ERROR(LaplacianFill(graph_, lifted.seen, &state.position_mm));
    state.rotation.resize(vertices);
    for (size_t v = 0; v < vertices; ++v) {
      state.rotation[v] = RotationAt(graph_, sheet_.flat.vertices_mm, state.position_mm, static_cast<int>(v));
    }
    WEFT_RETURN_IF_ERROR(Solve(lifted, points, &state));
    if (round == kOutlierRounds ||
        SetOutliersAside(points, kOutlierRatio, kOutlierPitches * cell_mm, state, &lifted) == 0) {
      break;
    }
  }
  lifted.position_mm = std::move(state.position_mm);
  return lifted;
}

}  // namespace weft
