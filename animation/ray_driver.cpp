#include "animation/ray_driver.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "absl/strings/str_cat.h"
#include "animation/net_correction.h"
#include "base/median.h"
#include "base/stopwatch.h"

namespace weft {
namespace {

// Over this way along the cloth, what crossing rays say about their neighbours is forgotten.
constexpr double kReachMm = 150;
constexpr double kLeastMisfit = 0.05;
// Sigma grows with this power of the share of vertices without a ray. Before cameras at a T-shirt's sides
// that is 0.46, before its front and back 0.24, and errors there were 1.26 times larger against all else that
// sigma is made of (what `weft avatar train shirt-drive-12` fits sigma to, two cameras).
constexpr double kHolePower = 0.35, kLeastHole = 0.05;
// A ray counts as this many medians off at most.
constexpr double kMostOff = 5;
// What all rays say counts in a region as much as this share of an average region's rays.
constexpr double kCommonShare = 0.05;

// How badly the rays around a vertex fit the carrier, in units of what the space leaves: 1 where the frame is
// like those that were learnt. Root mean square by region, and of all rays where a region has few. Rays that
// were set aside count as well: where the cloth does what the carrier cannot, many are.
std::vector<double> Misfits(const ShapeRegions& regions, const std::vector<VertexRay>& rays,
                            const std::vector<Eigen::Vector3d>& carrier_mm,
                            const std::vector<float>& left_mm) {
  if (rays.empty()) return std::vector<double>(carrier_mm.size(), 1);
  std::vector<double> off(rays.size());  // squared, per axis
  for (size_t i = 0; i < rays.size(); ++i) {
    const int v = rays[i].vertex;
    off[i] = rays[i].WayTo(carrier_mm[v]).squaredNorm() / (2.0 * left_mm[v] * left_mm[v]);
  }
  const auto count = static_cast<double>(rays.size());
  const double most = kMostOff * kMostOff * Median(off);
  std::vector<double> sum(regions.count, 0), weight(regions.count, 0);
  double all = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const double squared = std::min(off[i], most);
    all += squared / count;
    for (const auto& [region, share] : regions.of_vertex[rays[i].vertex])
      sum[region] += share * squared, weight[region] += share;
  }
  const double common = kCommonShare * count / std::max(1, regions.count);
  std::vector<double> out;
  for (const auto& parts : regions.of_vertex) {
    double misfit = parts.empty() ? std::sqrt(all) : 0;
    for (const auto& [region, share] : parts)
      misfit += share * std::sqrt((sum[region] + common * all) / (weight[region] + common));
    out.push_back(std::max(kLeastMisfit, misfit));
  }
  return out;
}

}  // namespace

absl::Status RayDriverOptions::Validate() const {
  if (absl::Status status = tracker.Validate(); !status.ok()) return status;
  return polish.Validate();
}

RayDriver::RayDriver(const AlignmentModel& model, const SparseViewAvatar& avatar,
                     const RayDriverOptions& options, NetCorrection* net)
    : model_(model),
      avatar_(avatar),
      options_(options),
      net_(net),
      tracker_(model, avatar.space, avatar.left_mm, avatar.acceleration, options.tracker),
      polish_(model, avatar.edges(), options.polish),
      mean_left_mm_(std::accumulate(avatar.left_mm.begin(), avatar.left_mm.end(), 0.0) /
                    static_cast<double>(avatar.left_mm.size())) {
  if (net_ == nullptr) return;
  PolishOptions second = options.polish;
  second.carrier_sigma_mm = options.corrected_sigma_mm;
  second_polish_.emplace(model, avatar.edges(), second);
}

void RayDriver::Reset() {
  tracker_.Reset();
  last_mm_.clear();
}

absl::Status RayDriver::Recall(RayDriverMemory memory) {
  if (!memory.mesh_mm.empty() && memory.mesh_mm.size() != static_cast<size_t>(model_.graph().vertices))
    return absl::InvalidArgumentError(absl::StrCat("the driver's memory has ", memory.mesh_mm.size(),
                                                   " vertices, the garment ", model_.graph().vertices));
  for (const Eigen::Vector3f& p : memory.mesh_mm)
    if (!p.allFinite())
      return absl::InvalidArgumentError("the driver's memory has a vertex that is not finite");
  if (absl::Status status = tracker_.Recall(std::move(memory.track)); !status.ok()) return status;
  last_mm_ = std::move(memory.mesh_mm);
  return absl::OkStatus();
}

std::vector<Eigen::Vector3d> RayDriver::StartOf(const RayDrivenFrame& frame,
                                                const TrackMemory& before) const {
  std::vector<Eigen::Vector3d> out = frame.carrier_mm;
  if (before.known == 0 || last_mm_.empty() || frame.track.started_anew) return out;
  const std::vector<Eigen::Vector3d> carrier_mm = tracker_.MeshOf(before.state);
  const Eigen::Matrix3d turn = frame.track.state.root.linear() * before.state.root.linear().transpose();
  for (size_t v = 0; v < out.size(); ++v) out[v] += turn * (last_mm_[v].cast<double>() - carrier_mm[v]);
  return out;
}

std::vector<float> RayDriver::Scales(const RayDrivenFrame& frame, const std::vector<VertexRay>& rays) const {
  const MeshGraph& graph = model_.graph();
  std::vector<RayEvidence> evidence(graph.vertices);
  std::vector<bool> crossed(graph.vertices, false);
  for (size_t i = 0; i < rays.size(); ++i) {
    if (frame.rejected[i]) continue;
    const int v = rays[i].vertex;
    evidence[v].Add(rays[i], frame.position_mm[v], 1);
    crossed[v] = evidence[v].rays >= 2;
  }
  const std::vector<int> rings = RingDistance(graph, crossed);
  const auto holes =
      std::count_if(evidence.begin(), evidence.end(), [](const RayEvidence& of) { return of.rays == 0; });
  const double hole = std::pow(std::max(kLeastHole, static_cast<double>(holes) / graph.vertices), kHolePower);
  std::vector<float> out(graph.vertices);
  for (int v = 0; v < graph.vertices; ++v) {
    const double unseen_mm = hole * frame.misfit[v] * avatar_.left_mm[v];
    const double along_mm = hole * frame.misfit[v] * mean_left_mm_;
    if (crossed[v]) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(evidence[v].information,
                                                                Eigen::EigenvaluesOnly);
      const double crossing_mm = 1 / std::sqrt(std::max(axes.eigenvalues()[0], 1e-12));
      out[v] = static_cast<float>(std::min(crossing_mm, unseen_mm));
    } else {
      const double way_mm = rings[v] < 0 ? 1e9 : rings[v] * model_.mean_edge_mm();
      const bool has_ray = evidence[v].rays > 0;
      out[v] =
          static_cast<float>((has_ray ? along_mm : unseen_mm) * std::sqrt(1 - std::exp(-way_mm / kReachMm)));
    }
  }
  return out;
}

absl::Status RayDriver::Correct(const std::vector<VertexRay>& rays, RayDrivenFrame* out) {
  Stopwatch watch;
  absl::StatusOr<CorrectedMesh> corrected = net_->Correct(*out, rays);
  if (!corrected.ok()) return corrected.status();
  out->times.push_back({"net", 1000 * watch.Seconds()});
  watch = Stopwatch();
  absl::StatusOr<PolishedMesh> polished =
      second_polish_->Polish(corrected->position_mm, corrected->position_mm, rays);
  if (!polished.ok()) return polished.status();
  out->uncorrected_mm = std::move(out->position_mm);
  out->position_mm = std::move(polished->position_mm);
  out->rejected = std::move(polished->rejected);
  out->times.push_back({"second polish", 1000 * watch.Seconds()});
  return absl::OkStatus();
}

absl::StatusOr<RayDrivenFrame> RayDriver::Drive(double frames, const std::vector<VertexRay>& rays) {
  RayDrivenFrame out;
  Stopwatch watch;
  const TrackMemory before = tracker_.memory();
  out.track = tracker_.Follow(frames, rays);
  out.carrier_mm = tracker_.MeshOf(out.track.state);
  out.times.push_back({"track", 1000 * watch.Seconds()});
  std::set<int> cameras;
  for (const VertexRay& ray : rays) cameras.insert(ray.view);
  out.cameras = static_cast<int>(cameras.size());
  out.rays_of_vertex.assign(out.carrier_mm.size(), 0);
  out.rejected.assign(rays.size(), true);
  out.position_mm = out.carrier_mm;
  if (!out.track.lost) {
    watch = Stopwatch();
    absl::StatusOr<PolishedMesh> polished = polish_.Polish(out.carrier_mm, StartOf(out, before), rays);
    if (!polished.ok()) return polished.status();
    out.position_mm = std::move(polished->position_mm);
    out.rejected = std::move(polished->rejected);
    out.times.push_back({"polish", 1000 * watch.Seconds()});
  }
  out.misfit = Misfits(tracker_.regions(), rays, out.carrier_mm, avatar_.left_mm);
  if (net_ != nullptr && !out.track.lost && out.cameras >= AvatarNet::kLeastCameras)
    if (absl::Status status = Correct(rays, &out); !status.ok()) return status;
  last_mm_.clear();
  if (!out.track.lost)
    for (const Eigen::Vector3d& p : out.position_mm) last_mm_.push_back(p.cast<float>());
  for (size_t i = 0; i < rays.size(); ++i) {
    out.rays_of_vertex[rays[i].vertex] += out.rejected[i] ? 0 : 1;
    out.rejected_rays += out.rejected[i] ? 1 : 0;
  }
  watch = Stopwatch();
  out.scale_mm = Scales(out, rays);
  out.times.push_back({"sigma", 1000 * watch.Seconds()});
  return out;
}

}  // namespace weft
