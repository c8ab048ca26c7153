// Poses of a deformation graph in the meshes that a garment is learnt from.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/paper/deformation_graph.h"
#include "animation/paper/graph_fit.h"
#include "animation/paper/graph_prior.h"
#include "services/work/animation/training_takes.h"

namespace weft {

struct GraphPoses {
  std::vector<Eigen::VectorXd> learnt, held_out;    // NumbersOf
  double learnt_left_mm = 0, held_out_left_mm = 0;  // mean distance of the vertices from the graph's mesh
};

// Fits the graph to every `every`-th frame of the takes, each from the one before it. Parallel over the
// takes; the same at any thread count. `on_progress` may be empty. Errors of the takes and of GraphFit;
// Cancelled when `stop` is requested.
absl::StatusOr<GraphPoses> FitGraphPoses(TrainingTakes& takes, const DeformationGraph& graph,
                                         const GraphFitOptions& options, int every,
                                         const std::function<void(double share)>& on_progress,
                                         const std::stop_token& stop);

// What `weft-train prior` learns a prior from: the poses in these units, and the graph. The tables of
// space.bin (docs/file-formats.md).
std::string EncodePriorTask(const DeformationGraph& graph, const std::vector<float>& unit,
                            const GraphPoses& poses);
// What it writes. InvalidArgument or DataLoss names the source.
absl::StatusOr<GraphPrior> DecodePrior(std::string_view bytes, std::vector<float> unit,
                                       const std::string& source_name);

}  // namespace weft
