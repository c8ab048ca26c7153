#include "alignment/local_stretch.h"

#include <Eigen/LU>
#include <array>

#include "alignment/fill.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Pull of no stretch, in squared mean edges; an edge alone tells nothing across itself.
constexpr double kNoStretch = 0.1;

using Columns = std::array<std::vector<Eigen::Vector3d>, 3>;  // of a matrix per vertex

// The stretch that the edges between targets show; `known` where there are any.
Columns MeasureStretch(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
                       const std::vector<Eigen::Matrix3d>& rotation, std::vector<bool>* known) {
  const MeshGraph& graph = model.graph();
  const std::vector<Eigen::Vector3d>& rest = model.rest().vertices_mm;
  std::vector<const VertexTarget*> target_of(graph.vertices, nullptr);
  for (const VertexTarget& t : targets) target_of[t.vertex] = &t;
  Columns columns;
  for (auto& column : columns) column.assign(graph.vertices, Eigen::Vector3d::Zero());
  known->assign(graph.vertices, false);
  const double hold = kNoStretch * model.mean_edge_mm() * model.mean_edge_mm();
  for (int v = 0; v < graph.vertices; ++v) {
    Eigen::Matrix3d moment = hold * Eigen::Matrix3d::Identity(), spread = moment;
    for (int i = graph.first[v]; target_of[v] && i < graph.first[v + 1]; ++i) {
      const int other = graph.neighbor[i];
      if (!target_of[other]) continue;
      const Eigen::Vector3d edge = rest[other] - rest[v];
      const Eigen::Vector3d now = target_of[other]->position_mm - target_of[v]->position_mm;
      moment += rotation[v].transpose() * now * edge.transpose();
      spread += edge * edge.transpose();
      (*known)[v] = true;
    }
    const Eigen::Matrix3d stretch = moment * spread.inverse();
    for (int c = 0; c < 3; ++c) columns[c][v] = 0.5 * (stretch.col(c) + stretch.row(c).transpose());
  }
  return columns;
}

// Mean over each known vertex and its known neighbours, `rings` times.
void Smooth(const MeshGraph& graph, const std::vector<bool>& known, int rings,
            std::vector<Eigen::Vector3d>* values) {
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<Eigen::Vector3d> before = *values;
    for (int v = 0; v < graph.vertices; ++v) {
      int count = 1;
      for (int i = graph.first[v]; known[v] && i < graph.first[v + 1]; ++i) {
        if (!known[graph.neighbor[i]]) continue;
        (*values)[v] += before[graph.neighbor[i]];
        ++count;
      }
      (*values)[v] /= count;
    }
  }
}

}  // namespace

absl::StatusOr<SlicedMesh> StretchToTargets(const AlignmentModel& model,
                                            const std::vector<VertexTarget>& targets,
                                            const std::vector<Eigen::Matrix3d>& rotation, int rings) {
  const MeshGraph& graph = model.graph();
  std::vector<bool> known;
  Columns columns = MeasureStretch(model, targets, rotation, &known);
  for (auto& column : columns) {
    Smooth(graph, known, rings, &column);
    WEFT_RETURN_IF_ERROR(LaplacianFill(graph, known, &column));
  }
  SlicedMesh mesh = model.slices();
  for (int slice = 0; slice < mesh.slices; ++slice) {
    for (int slot = mesh.first_slot[slice]; slot < mesh.first_slot[slice + 1]; ++slot) {
      for (int lane = 0; lane < kSliceLanes; ++lane) {
        const int v = slice * kSliceLanes + lane, at = slot * kSliceLanes + lane, other = mesh.neighbor[at];
        if (v >= mesh.vertices || other == v) continue;
        const Eigen::Vector3d edge(mesh.rest_x[at], mesh.rest_y[at], mesh.rest_z[at]);
        Eigen::Vector3d stretched = Eigen::Vector3d::Zero();
        for (int c = 0; c < 3; ++c) stretched += 0.5 * edge[c] * (columns[c][v] + columns[c][other]);
        mesh.rest_x[at] = static_cast<float>(stretched.x());
        mesh.rest_y[at] = static_cast<float>(stretched.y());
        mesh.rest_z[at] = static_cast<float>(stretched.z());
      }
    }
  }
  return mesh;
}

}  // namespace weft
