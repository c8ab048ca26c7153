#include "animation/sparse_view/ray_driver.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "absl/strings/str_cat.h"
#include "animation/sparse_view/net_correction.h"
#include "base/median.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"

namespace weft {
namespace {

// Over this way along the cloth, what crossing rays say about their neighbours is forgotten.
constexpr double kReachMm = 150;
constexpr double kLeastMisfit = 0.05;
// Sigma grows with the share of vertices without a ray, up to this one. Before two cameras at a T-shirt's
// front and back that is 0.2, and errors along rays are 0.78 mm (68 %); before cameras that see it from
// aslant 0.33 and 1.24, from the sides 0.5 and 1.57, with more misfit (held-out frames of what `weft avatar
// train shirt-drive-12` fits sigma to).
constexpr double kLeastHole = 0.05, kMostHole = 0.35;
// And with this power of the misfit. The loss of errors along rays (SigmaCheck, of the same frames; all of it
// is what accuracy_drive prints) is 1.124 with 0.7, 1.113 with 0.85, 1.120 with 1 before two cameras, and
// .079, .088, .112 before three.
constexpr double kMisfitPower = 0.85;
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
    off[i] = rays[i].OffsetTo(carrier_mm[v]).squaredNorm() / (2.0 * left_mm[v] * left_mm[v]);
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
  WEFT_RETURN_IF_ERROR(tracker.Validate());
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

absl::Status RayDriver::Restore(RayDriverMemory memory) {
  if (!memory.mesh_mm.empty() && memory.mesh_mm.size() != static_cast<size_t>(model_.graph().vertices))
    return absl::InvalidArgumentError(absl::StrCat("the driver's memory has ", memory.mesh_mm.size(),
                                                   " vertices, the garment ", model_.graph().vertices));
  for (const Eigen::Vector3f& p : memory.mesh_mm)
    if (!p.allFinite())
      return absl::InvalidArgumentError("the driver's memory has a vertex that is not finite");
  WEFT_RETURN_IF_ERROR(tracker_.Restore(std::move(memory.track)));
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

void RayDriver::AddScales(const std::vector<VertexRay>& rays, RayDrivenFrame* frame) const {
  const MeshGraph& graph = model_.graph();
  std::vector<RayEvidence> evidence(graph.vertices);
  std::vector<bool> seen(graph.vertices, false), crossed(graph.vertices, false);
  for (size_t i = 0; i < rays.size(); ++i) {
    if (frame->rejected[i]) continue;
    const int v = rays[i].vertex;
    evidence[v].Add(rays[i], frame->position_mm[v], 1);
    seen[v] = true;
    crossed[v] = evidence[v].rays >= 2;
  }
  const std::vector<int> from_seen = RingDistance(graph, seen), from_crossed = RingDistance(graph, crossed);
  const double edge_mm = model_.mean_edge_mm();
  const auto holes =
      std::count_if(evidence.begin(), evidence.end(), [](const RayEvidence& of) { return of.rays == 0; });
  const double hole = std::clamp(static_cast<double>(holes) / graph.vertices, kLeastHole, kMostHole);
  frame->scale_mm.resize(graph.vertices);
  frame->growth_mm.resize(graph.vertices);
  for (int v = 0; v < graph.vertices; ++v) {
    const double off_mm = std::pow(frame->misfit[v], kMisfitPower) * mean_left_mm_;
    double scale_mm = hole * off_mm;
    if (crossed[v]) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(evidence[v].information,
                                                                Eigen::EigenvaluesOnly);
      scale_mm = std::min(off_mm, 1 / std::sqrt(std::max(axes.eigenvalues()[0], 1e-12)));
    } else if (from_crossed[v] >= 0) {
      scale_mm *= std::sqrt(1 - std::exp(-from_crossed[v] * edge_mm / kReachMm));
    }
    // Where no vertex has a ray, the frame is lost.
    frame->scale_mm[v] = static_cast<float>(scale_mm);
    frame->growth_mm[v] = static_cast<float>(off_mm * std::max(0, from_seen[v]) * edge_mm / kReachMm);
  }
}

absl::Status RayDriver::Correct(const std::vector<VertexRay>& rays, RayDrivenFrame* out) {
  Stopwatch watch;
  WEFT_ASSIGN_OR_RETURN(CorrectedMesh corrected, net_->Correct(*out, rays));
  out->times.push_back({"net", 1000 * watch.Seconds()});
  watch = Stopwatch();
  WEFT_ASSIGN_OR_RETURN(PolishedMesh polished,
                        second_polish_->Polish(corrected.position_mm, corrected.position_mm, rays));
  out->uncorrected_mm = std::move(out->position_mm);
  out->position_mm = std::move(polished.position_mm);
  out->rejected = std::move(polished.rejected);
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
    WEFT_ASSIGN_OR_RETURN(PolishedMesh polished, polish_.Polish(out.carrier_mm, StartOf(out, before), rays));
    out.position_mm = std::move(polished.position_mm);
    out.rejected = std::move(polished.rejected);
    out.times.push_back({"polish", 1000 * watch.Seconds()});
  }
  out.misfit = Misfits(tracker_.regions(), rays, out.carrier_mm, avatar_.left_mm);
  if (net_ != nullptr && !out.track.lost && out.cameras >= AvatarNet::kLeastCameras)
    WEFT_RETURN_IF_ERROR(Correct(rays, &out));
  last_mm_.clear();
  if (!out.track.lost)
    for (const Eigen::Vector3d& p : out.position_mm) last_mm_.push_back(p.cast<float>());
  for (size_t i = 0; i < rays.size(); ++i) {
    out.rays_of_vertex[rays[i].vertex] += out.rejected[i] ? 0 : 1;
    out.rejected_rays += out.rejected[i] ? 1 : 0;
  }
  watch = Stopwatch();
  AddScales(rays, &out);
  out.times.push_back({"sigma", 1000 * watch.Seconds()});
  return out;
}

}  // namespace weft
