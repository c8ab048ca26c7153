#include "animation/paper/pixel_driver.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/mesh_graph.h"
#include "animation/sparse_view/driving_features.h"
#include "animation/sparse_view/net_correction.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "base/status_macros.h"

namespace weft {

std::vector<float> PixelFeatures(std::span<const DrivingView> views, const NodeVertices& nodes,
                                 const std::vector<Eigen::Vector3d>& carrier_mm) {
  const std::vector<int> places = PlacesByName(views);
  std::vector<float> out(carrier_mm.size() * kPixelFeatures, 0), confidence(carrier_mm.size());
  for (size_t c = 0; c < views.size(); ++c) {
    if (places[c] >= kPixelCameras) continue;
    confidence.assign(carrier_mm.size(), -1);
    for (const Observation& seen : views[c].observations) {
      const int vertex = nodes.VertexOf(seen.node);
      if (vertex < 0) continue;
      const auto v = static_cast<size_t>(vertex);
      const std::optional<Eigen::Vector2d> there = views[c].camera->Project(carrier_mm[v]);
      if (!there || seen.confidence <= confidence[v]) continue;
      confidence[v] = seen.confidence;
      float* of = &out[v * kPixelFeatures + 2 * static_cast<size_t>(places[c])];
      of[0] = static_cast<float>((seen.x_px - there->x()) / kPixelUnitPx);
      of[1] = static_cast<float>((seen.y_px - there->y()) / kPixelUnitPx);
    }
  }
  // The trainer cuts there, too.
  for (float& value : out) value = std::clamp(value, -kMostFeature, kMostFeature);
  return out;
}

struct PixelDriver::State {
  PixelAvatar avatar;
  DeformationGraph graph;
  NodeVertices nodes;
  Atlas atlas;
  Net net;
  std::optional<GraphTracker> tracker;  // of graph and prior above
};

PixelDriver::PixelDriver(std::unique_ptr<State> state) : state_(std::move(state)) {}
PixelDriver::PixelDriver(PixelDriver&&) noexcept = default;
PixelDriver& PixelDriver::operator=(PixelDriver&&) noexcept = default;
PixelDriver::~PixelDriver() = default;

absl::StatusOr<PixelDriver> PixelDriver::Create(const Template& garment, PixelAvatar avatar,
                                                const GraphTrackerOptions& options) {
  absl::Status status = avatar.CheckFits(garment);
  if (status.ok()) status = avatar.Validate();
  if (status.ok()) status = options.Validate();
  if (!status.ok()) return status;
  WEFT_ASSIGN_OR_RETURN(DeformationGraph graph,
                        BuildDeformationGraph(garment.rest, BuildMeshGraph(garment.rest), avatar.graph));
  if (status = avatar.prior.Validate(graph.nodes()); !status.ok()) return status;
  WEFT_ASSIGN_OR_RETURN(Atlas atlas, Atlas::Build(garment, ChartsOnBoard(garment), avatar.net.atlas));
  WEFT_ASSIGN_OR_RETURN(Net net, LoadNet(avatar.net, {kPixelFeatures, kPixelAnswers}));
  auto state = std::make_unique<State>(State{std::move(avatar), std::move(graph), NodeVertices(garment),
                                             std::move(atlas), std::move(net), std::nullopt});
  state->tracker.emplace(state->graph, state->avatar.prior, options);
  return PixelDriver(std::move(state));
}

absl::StatusOr<PixelDrivenFrame> PixelDriver::Drive(std::span<const DrivingView> views) {
  if (views.size() != kPixelCameras)
    return absl::InvalidArgumentError(
        absl::StrCat("an avatar of pixels is driven by ", kPixelCameras, " cameras, not by ", views.size()));
  WEFT_ASSIGN_OR_RETURN(const std::vector<VertexRay> rays,
                        RaysOf(views, state_->nodes, SparseViewOptions().cloth_sigma_px));
  PixelDrivenFrame out;
  const TrackedGraph track = state_->tracker->Follow(rays);
  out.lost = track.lost;
  if (out.lost) return out;
  out.carrier_mm = state_->tracker->MeshOf(track.state);
  AtlasImage image =
      state_->atlas.Gather(PixelFeatures(views, state_->nodes, out.carrier_mm), kPixelFeatures);
  WEFT_ASSIGN_OR_RETURN(const AtlasImage answer, AskNet(state_->net, std::move(image)));
  const std::vector<float> values = state_->atlas.Scatter(answer);
  for (size_t v = 0; v < out.carrier_mm.size(); ++v)
    out.position_mm.push_back(out.carrier_mm[v] + kAnswerUnitMm * Eigen::Vector3d(values[3 * v],
                                                                                  values[3 * v + 1],
                                                                                  values[3 * v + 2]));
  return out;
}

}  // namespace weft
