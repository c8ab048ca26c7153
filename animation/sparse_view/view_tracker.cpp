#include "animation/sparse_view/view_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "animation/rays/view_poses.h"
#include "base/median.h"

namespace weft {
namespace {

// Components and steps with which starts are compared.
constexpr int kTrialComponents = 8, kTrialSteps = 6;
// A step this small, in units of z, ends the iteration.
constexpr double kSmallStep = 1e-3;
// Longer gaps say nothing about the shape any more.
constexpr double kLongestGap = 30;
// No shape space is better than this, in mm.
constexpr double kLeastSpread = 1;

}  // namespace

absl::Status TrackerOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("tracking: ", what));
  };
  if (max_rays < 100) return bad("max_rays must be at least 100");
  if (min_rays < 10) return bad("min_rays must be at least 10");
  if (!(agreeing_size > 0)) return bad("agreeing_size must be positive");
  if (!(min_agreeing_share >= 0 && min_agreeing_share <= 1)) return bad("min_agreeing_share must be 0 to 1");
  if (!(robust_spreads > 0)) return bad("robust_spreads must be positive");
  if (!(rays_of_view > 0)) return bad("rays_of_view must be positive");
  if (max_steps < 1) return bad("max_steps must be at least 1");
  return local.Validate();
}

ViewTracker::ViewTracker(const AlignmentModel& model, const ShapeSpace& space, std::span<const float> left_mm,
                         std::span<const float> acceleration, const TrackerOptions& options)
    : shape_(space, DivideShape(model.rest(), model.graph(), options.local), options.local),
      left_mm_(left_mm),
      acceleration_(acceleration),
      options_(options),
      long_axis_(LongAxis(space.Shape(Eigen::VectorXd::Zero(space.components())))) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : model.rest().vertices_mm) box.extend(p);
  size_mm_ = box.diagonal().norm();
}

void ViewTracker::Reset() { memory_.known = 0; }

absl::Status ViewTracker::Restore(TrackMemory memory) {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("tracking: what is to be recalled ", what));
  };
  if (memory.known < 0 || memory.known > 2) return bad("is of a number of frames that is not 0 to 2");
  if (memory.known > 0) {
    const int components = shape_.space().components();
    const ShapeState& state = memory.state;
    const bool has_regions = state.local.size() > 0;
    if (state.z.size() != components || memory.z_before.size() != components)
      return bad("is of another avatar");
    if (has_regions &&
        (state.local.rows() != shape_.regions().count || state.local.cols() != shape_.local_components()))
      return bad("is of other regions");
    if (!state.root.matrix().allFinite() || !state.z.allFinite() || !memory.z_before.allFinite() ||
        (has_regions && !state.local.allFinite()))
      return bad("is not finite");
  }
  memory_ = std::move(memory);
  return absl::OkStatus();
}

std::vector<VertexRay> ViewTracker::Choose(const std::vector<VertexRay>& rays) const {
  const size_t most = static_cast<size_t>(options_.max_rays);
  if (rays.size() <= most) return rays;
  std::vector<VertexRay> out;
  for (size_t i = 0; i < most; ++i) out.push_back(rays[i * rays.size() / most]);
  return out;
}

std::vector<Eigen::Isometry3d> ViewTracker::Starts(const std::vector<VertexRay>& rays) const {
  ShapeState mean;
  mean.z = Eigen::VectorXd::Zero(shape_.space().components());
  return PosesFromViews(rays, shape_.PointsOf(rays, mean), long_axis_);
}

// The rays' weights at the present shape. Where all rays fit worse than in training, the robust function's
// scale follows: a shape that was never seen is no reason to set rays aside.
std::vector<double> ViewTracker::Weigh(const std::vector<VertexRay>& rays, const ShapeState& state,
                                       double widening, double* cost) const {
  const std::vector<Eigen::Vector3d> points = shape_.PointsOf(rays, state);
  std::vector<double> spread(rays.size()), off(rays.size());
  int views = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Vector3d at = state.root * points[i];
    spread[i] = std::hypot(static_cast<double>(left_mm_[rays[i].vertex]), rays[i].SigmaMm(at), kLeastSpread);
    off[i] = rays[i].OffsetTo(at).norm() / spread[i];
    views = std::max(views, rays[i].view + 1);
  }
  const double misfit = std::max(1.0, Median(off) / kMedianAcross);
  const double share = std::min(1.0, options_.rays_of_view * views / static_cast<double>(rays.size()));
  *cost = 0;
  std::vector<double> out(rays.size());
  for (size_t i = 0; i < rays.size(); ++i) {
    const double ratio = off[i] / (options_.robust_spreads * misfit * widening);
    // Compared in mm, or a start that fits nothing would look as good as any.
    const double far = off[i] * spread[i] / (options_.agreeing_size * size_mm_);
    *cost += far * far / (1 + far * far);
    out[i] = share * GemanMcClureWeight(ratio) / (spread[i] * spread[i]);
  }
  return out;
}

void ViewTracker::Improve(const std::vector<VertexRay>& rays, const ShapePrior& prior, int components,
                          int steps, bool with_regions, Fit* fit) const {
  for (int step = 0; step < steps; ++step) {
    const double widening = with_regions ? 1 : WideningAt(step);
    const std::vector<double> weight = Weigh(rays, fit->state, widening, &fit->cost);
    const double change = shape_.Step(rays, weight, prior, components, with_regions, &fit->state);
    if (change < 0 || (step > 1 && change < kSmallStep)) break;
  }
  Weigh(rays, fit->state, 1, &fit->cost);
}

ViewTracker::Fit ViewTracker::StartAnew(const std::vector<VertexRay>& rays) const {
  const int components = shape_.space().components(), trial = std::min(kTrialComponents, components);
  const ShapePrior none{Eigen::VectorXd::Zero(components), Eigen::VectorXd::Zero(components)};
  Fit best;
  best.state.z = Eigen::VectorXd::Zero(components);
  bool found = false;
  for (const Eigen::Isometry3d& start : Starts(rays)) {
    Fit fit;
    fit.state.root = start;
    fit.state.z = Eigen::VectorXd::Zero(components);
    Improve(rays, none, trial, kTrialSteps, false, &fit);
    if (!found || fit.cost < best.cost) best = fit;
    found = true;
  }
  if (found) Improve(rays, none, components, 2 * options_.max_steps, false, &best);
  return best;
}

double ViewTracker::AgreeingShare(const std::vector<VertexRay>& rays, const ShapeState& state) const {
  int agreeing = 0;
  const std::vector<Eigen::Vector3d> points = shape_.PointsOf(rays, state);
  for (size_t i = 0; i < rays.size(); ++i) {
    agreeing += rays[i].OffsetTo(state.root * points[i]).norm() <= options_.agreeing_size * size_mm_ ? 1 : 0;
  }
  return rays.empty() ? 0 : static_cast<double>(agreeing) / static_cast<double>(rays.size());
}

GarmentTrack ViewTracker::Follow(double frames, const std::vector<VertexRay>& rays) {
  const int components = shape_.space().components();
  GarmentTrack out;
  out.state.z = Eigen::VectorXd::Zero(components);
  if (static_cast<int>(rays.size()) < options_.min_rays) {
    if (memory_.known > 0) out.state = memory_.state;
    Reset();
    out.lost = true;
    out.reason = absl::StrCat(rays.size(), " cells of the garment were seen, at least ", options_.min_rays,
                              " are needed");
    return out;
  }
  const std::vector<VertexRay> chosen = Choose(rays);
  ShapePrior prior{Eigen::VectorXd::Zero(components), Eigen::VectorXd::Zero(components)};
  Fit fit;
  if (memory_.known > 0 && frames <= kLongestGap) {
    fit.state = memory_.state;
    if (memory_.known > 1) {
      prior.expected = memory_.state.z + frames * (memory_.state.z - memory_.z_before);
      for (int k = 0; k < components; ++k)
        prior.information[k] = 1 / std::pow(acceleration_[k] * frames * frames, 2);
    }
    Improve(chosen, prior, components, options_.max_steps, false, &fit);
    out.agreeing_share = AgreeingShare(chosen, fit.state);
  }
  if (out.agreeing_share < options_.min_agreeing_share) {
    fit = StartAnew(chosen);
    out.started_anew = true;
    out.agreeing_share = AgreeingShare(chosen, fit.state);
    prior.information.setZero();
    memory_.known = 0;
  }
  if (out.agreeing_share < options_.min_agreeing_share) {
    out.state = fit.state;
    out.lost = true;
    out.reason = absl::StrFormat(
        "only %.0f %% of the cells seen agree with a shape of the garment, at least "
        "%.0f %% are needed",
        100 * out.agreeing_share, 100 * options_.min_agreeing_share);
    Reset();
    return out;
  }
  if (options_.local.regions > 0) Improve(chosen, prior, components, options_.local.steps, true, &fit);
  out.state = fit.state;
  memory_.z_before = memory_.known > 0 ? memory_.state.z : fit.state.z;
  memory_.state = fit.state;
  memory_.known = std::min(2, memory_.known + 1);
  return out;
}

}  // namespace weft
