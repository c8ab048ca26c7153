#include "animation/sparse_view/sparse_view_driver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "animation/sparse_view/net_correction.h"
#include "base/median.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"

namespace weft {
namespace {

VertexState StateOf(int rays) {
  if (rays >= 3) return VertexState::kObserved;
  return rays == 2 ? VertexState::kTwoView : VertexState::kDriven;
}

// Rays of a view that err by themselves; the others repeat them, as the shape misses neighbours alike.
constexpr int kIndependentRays = 200;

// Of each place in the order of the cameras' names; `camera_at` says which camera it is of.
std::vector<CameraBias> BiasesOf(const std::vector<VertexRay>& rays,
                                 const std::vector<Eigen::Vector3d>& carrier_mm,
                                 const std::vector<const CameraModel*>& camera_at) {
  std::vector<CameraBias> out(camera_at.size());
  for (const VertexRay& ray : rays) {
    const Eigen::Vector3d& at = carrier_mm[ray.vertex];
    const Eigen::Vector3d way = camera_at[ray.view]->rotation * ray.OffsetTo(at);
    const Eigen::Vector2d off_px = way.head<2>() / (at - ray.origin_mm).norm() * ray.focal_px;
    CameraBias& bias = out[ray.view];
    ++bias.observations;
    bias.mean_px += off_px;
    bias.rms_px += off_px.squaredNorm();
  }
  for (CameraBias& bias : out) {
    if (bias.observations == 0) continue;
    bias.mean_px /= bias.observations;
    bias.rms_px = std::sqrt(bias.rms_px / bias.observations);
    const double sigma = bias.rms_px / std::sqrt(2.0 * std::min(bias.observations, kIndependentRays));
    bias.mean_sigma_px.setConstant(sigma);
    if (sigma > 0) bias.significance = bias.mean_px.norm() / sigma;
  }
  return out;
}

// Of this share of the rays that another camera has, a camera sees the garment whole.
constexpr double kWholeView = 0.9;

// The number of cameras, where one that the garment is leaving counts as what it sees of it.
double WholeCameras(const std::vector<int>& rays_of_view) {
  const int most = *std::max_element(rays_of_view.begin(), rays_of_view.end());
  double out = 0;
  for (const int rays : rays_of_view)
    if (most > 0) out += std::min(1.0, rays / (kWholeView * most));
  return out;
}

// Factors by a vertex's rays. Between two numbers of cameras they are geometric means; no vertex has more
// rays than there are cameras.
std::array<float, SigmaScale::kRays> FactorsAmong(const SigmaScale& scale, double cameras) {
  std::array<float, SigmaScale::kRays> out;
  for (int rays = 0; rays < SigmaScale::kRays; ++rays) {
    const double among = std::clamp<double>(std::max<double>(cameras, rays), 1, SigmaScale::kCameras) - 1;
    const int fewer = static_cast<int>(among), more = std::min(fewer + 1, SigmaScale::kCameras - 1);
    out[rays] = std::pow(scale.of[fewer][rays], static_cast<float>(fewer + 1 - among)) *
                std::pow(scale.of[more][rays], static_cast<float>(among - fewer));
  }
  return out;
}

double SizeOf(const std::vector<Eigen::Vector3d>& vertices_mm) {
  Eigen::Vector3d low = vertices_mm[0], high = low;
  for (const Eigen::Vector3d& v : vertices_mm) low = low.cwiseMin(v), high = high.cwiseMax(v);
  return (high - low).norm();
}

}  // namespace

absl::Status SparseViewOptions::Validate() const {
  if (!(cloth_sigma_px >= 0.01) || !std::isfinite(cloth_sigma_px))
    return absl::InvalidArgumentError("driving: cloth_sigma_px must be at least 0.01");
  return driver.Validate();
}

struct SparseViewDriver::State {
  State(const Template& garment, SparseViewAvatar learnt, const SparseViewOptions& given)
      : options(given),
        avatar(std::move(learnt)),
        model(garment),
        nodes(garment),
        size_mm(SizeOf(garment.rest.vertices_mm)) {}

  RegisteredMesh MeshOf(const RayDrivenFrame& driven, const std::vector<int>& rays_of_view) const {
    RegisteredMesh out;
    out.vertices_mm = driven.position_mm;
    out.views = driven.rays_of_vertex;
    const auto factors = FactorsAmong(avatar.sigma, WholeCameras(rays_of_view));
    for (size_t v = 0; v < out.vertices_mm.size(); ++v) {
      const int rays = driven.rays_of_vertex[v];
      out.state.push_back(StateOf(rays));
      out.sigma_mm.push_back(driven.track.lost
                                 ? static_cast<float>(size_mm)
                                 : SigmaScale::Sigma(factors, rays, driven.scale_mm[v], driven.growth_mm[v]));
    }
    return out;
  }

  SparseViewOptions options;
  SparseViewAvatar avatar;
  AlignmentModel model;
  NodeVertices nodes;
  std::optional<NetCorrection> net;
  std::optional<RayDriver> driver;
  double size_mm = 0;
  std::optional<int64_t> last_ns;
};

SparseViewDriver::SparseViewDriver(std::unique_ptr<State> state) : state_(std::move(state)) {}
SparseViewDriver::SparseViewDriver(SparseViewDriver&&) noexcept = default;
SparseViewDriver& SparseViewDriver::operator=(SparseViewDriver&&) noexcept = default;
SparseViewDriver::~SparseViewDriver() = default;

absl::StatusOr<SparseViewDriver> SparseViewDriver::Create(const Template& garment, SparseViewAvatar avatar,
                                                          const SparseViewOptions& options) {
  absl::Status status = options.Validate();
  if (status.ok()) status = avatar.CheckFits(garment);
  if (status.ok()) status = avatar.Validate();
  if (!status.ok()) return status;
  auto state = std::make_unique<State>(garment, std::move(avatar), options);
  const size_t edges = state->model.graph().edges.size();
  if (state->avatar.edge_mm.size() != edges)
    return absl::InvalidArgumentError(absl::StrCat("avatar: has lengths of ", state->avatar.edge_mm.size(),
                                                   " edges, the template has ", edges));
  if (!state->avatar.net.onnx.empty()) {
    WEFT_ASSIGN_OR_RETURN(auto net, NetCorrection::Create(garment, state->model, state->avatar));
    state->net.emplace(std::move(net));
  }
  state->driver.emplace(state->model, state->avatar, options.driver, state->net ? &*state->net : nullptr);
  return SparseViewDriver(std::move(state));
}

absl::StatusOr<DrivenFrame> SparseViewDriver::Drive(int64_t time_ns, std::span<const DrivingView> views) {
  State& state = *state_;
  if (views.empty()) return absl::InvalidArgumentError("driving: a frame without views");
  if (state.last_ns && time_ns <= *state.last_ns)
    return absl::InvalidArgumentError(
        absl::StrCat("driving: a frame at ", time_ns, " ns comes after one at ", *state.last_ns, " ns"));
  const Stopwatch watch;
  WEFT_ASSIGN_OR_RETURN(const auto rays, RaysOf(views, state.nodes, state.options.cloth_sigma_px));
  DrivenFrame out;
  out.times.push_back({"rays", 1000 * watch.Seconds()});
  const double frames =
      state.last_ns ? 1e-9 * static_cast<double>(time_ns - *state.last_ns) * state.avatar.fps : 1;
  WEFT_ASSIGN_OR_RETURN(RayDrivenFrame driven, state.driver->Drive(frames, rays));
  state.last_ns = time_ns;
  out.lost = driven.track.lost;
  out.reason = driven.track.reason;
  out.started_anew = driven.track.started_anew;
  out.rays = static_cast<int>(rays.size());
  out.rejected_rays = driven.rejected_rays;
  const std::vector<int> places = PlacesByName(views);
  std::vector<int> by_place(views.size(), 0);
  for (const VertexRay& ray : rays) ++by_place[ray.view];
  out.mesh = state.MeshOf(driven, by_place);
  std::vector<double> residuals;
  for (const VertexRay& ray : rays) {
    const Eigen::Vector3d& at = out.mesh.vertices_mm[ray.vertex];
    residuals.push_back(ray.OffsetTo(at).norm() / (at - ray.origin_mm).norm() * ray.focal_px);
  }
  std::vector<const CameraModel*> camera_at(views.size());
  for (size_t k = 0; k < views.size(); ++k) camera_at[places[k]] = views[k].camera;
  const std::vector<CameraBias> biases = BiasesOf(rays, driven.carrier_mm, camera_at);
  for (const int place : places) {
    out.rays_of_view.push_back(by_place[place]);
    out.bias_of_view.push_back(biases[place]);
  }
  if (!residuals.empty()) out.residual_px = Median(std::move(residuals));
  out.carrier_mm = std::move(driven.carrier_mm);
  out.uncorrected_mm = std::move(driven.uncorrected_mm);
  out.times.insert(out.times.end(), driven.times.begin(), driven.times.end());
  return out;
}

DriverMemory SparseViewDriver::Memory() const { return {state_->last_ns, state_->driver->Memory()}; }

absl::Status SparseViewDriver::Restore(DriverMemory memory) {
  WEFT_RETURN_IF_ERROR(state_->driver->Restore(std::move(memory.drive)));
  state_->last_ns = memory.last_ns;
  return absl::OkStatus();
}

void SparseViewDriver::Reset() {
  state_->driver->Reset();
  state_->last_ns.reset();
}

}  // namespace weft
