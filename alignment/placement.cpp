#include "alignment/placement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/fill.h"
#include "alignment/print_scale.h"
#include "base/median.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Of neighbouring targets against the template, either way. Knitted cloth stretches by some tenths, and noise
// of a fifth of a cell adds one.
constexpr double kMaxScale = 1.5;

absl::Status CheckScale(double scale) {
  if (scale == 0 || (scale <= kMaxScale && scale >= 1 / kMaxScale)) return absl::OkStatus();
  const auto of_cloud = UnitOfScale(scale), of_template = UnitOfScale(1 / scale);
  std::string why = "they are of different sizes, or do not belong together";
  if (of_template)
    why = absl::StrCat("the template is in ", of_template->plural, ", import its mesh with --unit ",
                       of_template->name);
  else if (of_cloud)
    why = absl::StrCat("the cloud is in ", of_cloud->plural,
                       ", as the rig's positions may be; give them in mm");
  return absl::FailedPreconditionError(absl::StrCat("alignment: neighbouring points of the cloud lie ", scale,
                                                    " times as far apart as on the template: ", why));
}

// Standard deviations along the second principal axis: 0 for points on a line.
double SpreadAcrossLine(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / points.size();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) scatter += (p - mean) * (p - mean).transpose() / points.size();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(scatter, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, axes.eigenvalues()[1]));
}

}  // namespace

double ClothScale(const AlignmentModel& model, const std::vector<VertexTarget>& targets) {
  const MeshGraph& graph = model.graph();
  std::vector<int> target_of(graph.vertices, -1);
  for (size_t i = 0; i < targets.size(); ++i) target_of[targets[i].vertex] = static_cast<int>(i);
  std::vector<double> ratios;
  for (const MeshEdge& edge : graph.edges) {
    if (target_of[edge.a] < 0 || target_of[edge.b] < 0) continue;
    const double rest = (model.rest().vertices_mm[edge.a] - model.rest().vertices_mm[edge.b]).norm();
    const Eigen::Vector3d now =
        targets[target_of[edge.a]].position_mm - targets[target_of[edge.b]].position_mm;
    if (rest > 0) ratios.push_back(now.norm() / rest);
  }
  return Median(std::move(ratios));
}

absl::Status CheckTargets(const std::vector<VertexTarget>& targets, int vertices) {
  std::vector<bool> seen(vertices, false);
  for (size_t i = 0; i < targets.size(); ++i) {
    const VertexTarget& t = targets[i];
    const auto bad = [&](const std::string& why) {
      return absl::InvalidArgumentError(absl::StrCat("target ", i, " (vertex ", t.vertex, "): ", why));
    };
    if (t.vertex < 0 || t.vertex >= vertices) {
      return bad(absl::StrCat("the template has ", vertices, " vertices, numbered from 0"));
    }
    if (seen[t.vertex]) return bad("the vertex has a target already");
    if (!t.position_mm.allFinite()) return bad("position_mm is not finite");
    if (!(t.sigma_mm >= 0) || !std::isfinite(t.sigma_mm)) return bad("sigma_mm must be a number from 0");
    if (!(t.fold_covariance_mm2.trace() <= 3 * t.sigma_mm * t.sigma_mm)) {
      return bad("fold_covariance_mm2 must be a part of the whole");
    }
    seen[t.vertex] = true;
  }
  return absl::OkStatus();
}

absl::Status CheckStart(const std::vector<Eigen::Vector3d>& start_mm, int vertices) {
  if (start_mm.size() != static_cast<size_t>(vertices)) {
    return absl::InvalidArgumentError(
        absl::StrCat("start: has ", start_mm.size(), " vertices, the template ", vertices));
  }
  for (int v = 0; v < vertices; ++v) {
    if (!start_mm[v].allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("start: vertex ", v, " is not finite"));
    }
  }
  return absl::OkStatus();
}

Eigen::Isometry3d RigidFit(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to) {
  const auto size = static_cast<Eigen::Index>(from.size());
  return Eigen::Isometry3d(Eigen::umeyama(Eigen::Map<const Eigen::Matrix3Xd>(from[0].data(), 3, size),
                                          Eigen::Map<const Eigen::Matrix3Xd>(to[0].data(), 3, size), false));
}

double LeastTargets(int vertices, double min_target_share) {
  return std::max(3.0, std::ceil(min_target_share * vertices));
}

absl::StatusOr<Eigen::Isometry3d> PlaceTemplate(const AlignmentModel& model,
                                                const std::vector<VertexTarget>& targets,
                                                double min_target_share) {
  const double needed = LeastTargets(model.graph().vertices, min_target_share);
  if (static_cast<double>(targets.size()) < needed) {
    return absl::FailedPreconditionError(absl::StrCat(
        "alignment: ", targets.size(), " of the template's ", model.graph().vertices,
        " vertices were measured, ", needed, " are needed; too little of the cloth was seen in this frame"));
  }
  // First: what is of another size looks like a point, or a line.
  WEFT_RETURN_IF_ERROR(CheckScale(ClothScale(model, targets)));
  std::vector<Eigen::Vector3d> rest, now;
  for (const VertexTarget& t : targets) {
    rest.push_back(model.rest().vertices_mm[t.vertex]);
    now.push_back(t.position_mm);
  }
  const double least = 0.1 * model.mean_edge_mm();
  if (SpreadAcrossLine(rest) < least || SpreadAcrossLine(now) < least) {
    return absl::FailedPreconditionError(
        "alignment: the observed vertices lie on a line and do not determine the template's pose");
  }
  return RigidFit(rest, now);
}

FillStart PrepareFill(const MeshGraph& graph, const std::vector<VertexTarget>& targets,
                      std::vector<Eigen::Vector3d> base_mm) {
  FillStart start{std::move(base_mm), std::vector<bool>(graph.vertices, false)};
  std::vector<int> count(graph.components, 0);
  std::vector<Eigen::Vector3d> shift(graph.components, Eigen::Vector3d::Zero());
  for (const VertexTarget& t : targets) {
    ++count[graph.component[t.vertex]];
    shift[graph.component[t.vertex]] += t.position_mm - start.position_mm[t.vertex];
  }
  for (int v = 0; v < graph.vertices; ++v) {
    const int c = graph.component[v];
    if (count[c] >= 3) continue;
    if (count[c] > 0) start.position_mm[v] += shift[c] / count[c];
    start.known[v] = true;
  }
  for (const VertexTarget& t : targets) {
    start.position_mm[t.vertex] = t.position_mm;
    start.known[t.vertex] = true;
  }
  return start;
}

absl::StatusOr<std::vector<Eigen::Vector3d>> MovedWithTargets(const MeshGraph& graph,
                                                              const std::vector<VertexTarget>& targets,
                                                              const std::vector<Eigen::Vector3d>& start_mm) {
  FillStart filled = PrepareFill(graph, targets, start_mm);
  std::vector<Eigen::Vector3d>& move_mm = filled.position_mm;
  for (size_t v = 0; v < start_mm.size(); ++v) move_mm[v] -= start_mm[v];
  WEFT_RETURN_IF_ERROR(LaplacianFill(graph, filled.known, &move_mm));
  for (size_t v = 0; v < start_mm.size(); ++v) move_mm[v] += start_mm[v];
  return move_mm;
}

}  // namespace weft
