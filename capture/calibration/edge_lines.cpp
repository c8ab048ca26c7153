#include "capture/calibration/edge_lines.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/median.h"

namespace weft {
namespace {

constexpr double kStepPx = 0.25;   // between samples of a profile
constexpr double kMinShare = 0.6;  // of the profiles that must show the step

// Bilinear; NaN outside.
double LightAt(const LightImage& image, const Eigen::Vector2d& at) {
  const double fx = std::floor(at.x()), fy = std::floor(at.y());
  if (!(fx >= 0 && fy >= 0 && fx + 1 < image.width_px && fy + 1 < image.height_px))
    return std::numeric_limits<double>::quiet_NaN();
  const double u = at.x() - fx, v = at.y() - fy;
  const float* row = &image.values[static_cast<size_t>(fy) * image.width_px + static_cast<size_t>(fx)];
  const float* below = row + image.width_px;
  return (1 - v) * ((1 - u) * row[0] + u * row[1]) + v * ((1 - u) * below[0] + u * below[1]);
}

struct Step {
  double offset_px = 0;  // along the normal
  double variance_px2 = 0;
  double height = 0;
};

// Moves the step to the mean of the slope over a window of half width `reach_px` about it, again and again.
bool MoveOnto(const LightImage& image, const Eigen::Vector2d& at, const Eigen::Vector2d& normal,
              double reach_px, double limit_px, Step* step) {
  constexpr int kRounds = 8;
  constexpr double kSettledPx = 1e-3;
  const int half = static_cast<int>(reach_px / kStepPx);
  double mean = 2 * kSettledPx;
  for (int round = 0; round < kRounds && std::abs(mean) > kSettledPx; ++round) {
    double sum = 0, first = 0, second = 0;
    double before = LightAt(image, at + (step->offset_px - (half + 0.5) * kStepPx) * normal);
    for (int i = -half; i <= half; ++i) {
      const double after = LightAt(image, at + (step->offset_px + (i + 0.5) * kStepPx) * normal);
      const double slope = after - before, t = i * kStepPx;
      sum += slope;
      first += slope * t;
      second += slope * t * t;
      before = after;
    }
    if (!(sum > 0)) return false;
    mean = first / sum;
    step->offset_px += mean;
    step->variance_px2 = second / sum - mean * mean;
    step->height = sum;
    if (!(std::abs(step->offset_px) < limit_px)) return false;
  }
  return true;
}

// The brightness step along `normal` through `at`, looked for within `reach_px`.
std::optional<Step> FindStep(const LightImage& image, const Eigen::Vector2d& at,
                             const Eigen::Vector2d& normal, double reach_px) {
  Step step;
  if (!MoveOnto(image, at, normal, reach_px, reach_px, &step)) return std::nullopt;
  // Refines its position from its steepest part, since the tails of the steps on both sides reach into the
  // wide window, one of them where the module behind the border is white.
  constexpr double kSteepSigmas = 1.5;
  const double steep_px = kSteepSigmas * std::sqrt(std::max(0.0, step.variance_px2));
  if (steep_px >= reach_px) return step;
  Step steep = step;
  if (!MoveOnto(image, at, normal, std::max(steep_px, 2 * kStepPx), reach_px, &steep)) return std::nullopt;
  step.offset_px = steep.offset_px;
  return step;
}

// Offset from the straight side, as a function of the place along it from -1 to 1.
struct Side {
  Eigen::Vector2d middle, along, normal;  // along: half of the side
  Eigen::Vector3d curve = Eigen::Vector3d::Zero();
  double blur_px = 0;

  Eigen::Vector2d At(double s) const {
    return middle + s * along + (curve[0] + s * (curve[1] + s * curve[2])) * normal;
  }
  Eigen::Vector2d Slope(double s) const { return along + (curve[1] + 2 * s * curve[2]) * normal; }
};

// Least squares, once more without what is far off.
Eigen::Vector3d FitCurve(std::vector<Eigen::Vector2d> points, bool bends) {
  Eigen::Vector3d curve = Eigen::Vector3d::Zero();
  for (int round = 0; round < 2; ++round) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
    for (const Eigen::Vector2d& p : points) {
      const Eigen::Vector3d terms(1, p.x(), bends ? p.x() * p.x() : 0);
      sum += terms * terms.transpose();
      rhs += terms * p.y();
    }
    if (!bends) sum(2, 2) = 1;
    curve = sum.ldlt().solve(rhs);
    const auto off = [&](const Eigen::Vector2d& p) {
      return std::abs(p.y() - curve.dot(Eigen::Vector3d(1, p.x(), p.x() * p.x())));
    };
    std::vector<double> sizes;
    for (const Eigen::Vector2d& p : points) sizes.push_back(off(p));
    const double limit = 4 * Median(std::move(sizes)) + 0.02;
    std::erase_if(points, [&](const Eigen::Vector2d& p) { return off(p) > limit; });
  }
  return curve;
}

std::optional<Side> FindSide(const LightImage& image, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                             double reach_px, const SquareOptions& options) {
  Side side;
  side.middle = (from + to) / 2;
  side.along = (to - from) / 2;
  const double length_px = 2 * side.along.norm();
  // Clockwise in a picture whose y points down, so this is outwards.
  const Eigen::Vector2d outwards = Eigen::Vector2d(side.along.y(), -side.along.x()).normalized();
  side.normal = options.bright_outside ? outwards : Eigen::Vector2d(-outwards);
  const int profiles = std::clamp(static_cast<int>(length_px), 8, 60);
  std::vector<Eigen::Vector2d> points;
  std::vector<double> variances, heights;
  for (int i = 0; i < profiles; ++i) {
    const double s = (1 - 2 * kCornerShare) * (2 * (i + 0.5) / profiles - 1);
    const std::optional<Step> step = FindStep(image, side.middle + s * side.along, side.normal, reach_px);
    if (!step || step->height < options.min_contrast) continue;
    points.emplace_back(s, step->offset_px);
    variances.push_back(step->variance_px2);
    heights.push_back(step->height);
  }
  if (static_cast<double>(points.size()) < kMinShare * profiles) return std::nullopt;
  side.curve = FitCurve(points, length_px > kBendsFromPx);
  side.blur_px = std::sqrt(std::max(0.0, Median(std::move(variances))));
  return side;
}

// Where the end of one side meets the start of the next.
std::optional<Eigen::Vector2d> Meet(const Side& first, const Side& second) {
  double s = 1, t = -1;
  for (int round = 0; round < 4; ++round) {
    const Eigen::Vector2d gap = second.At(t) - first.At(s), a = first.Slope(s), b = -second.Slope(t);
    const double det = a.x() * b.y() - a.y() * b.x();
    if (std::abs(det) < 0.1 * a.norm() * b.norm()) return std::nullopt;
    s += (gap.x() * b.y() - gap.y() * b.x()) / det;
    t += (a.x() * gap.y() - a.y() * gap.x()) / det;
  }
  if (std::abs(s - 1) > 0.3 || std::abs(t + 1) > 0.3) return std::nullopt;
  return first.At(s);
}

}  // namespace

std::optional<SharpSquare> SharpenSquare(const LightImage& image,
                                         const std::array<Eigen::Vector2d, 4>& rough_px,
                                         const SquareOptions& options) {
  std::array<Eigen::Vector2d, 4> corners = rough_px;
  SharpSquare out;
  // A second time, from better corners.
  for (int round = 0; round < 2; ++round) {
    double area = 0;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2d& a = corners[k];
      const Eigen::Vector2d& b = corners[(k + 1) % 4];
      area += 0.5 * (a.x() * b.y() - a.y() * b.x());
    }
    std::array<Side, 4> sides;
    out.blur_px = 0;
    out.blur_limit_px = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2d &from = corners[k], &to = corners[(k + 1) % 4];
      const double depth_px = area / (to - from).norm();  // of the square behind this side
      const double reach_px = std::clamp(0.48 * depth_px / options.modules, 1.0, 6.0);
      const std::optional<Side> side = FindSide(image, from, to, reach_px, options);
      if (!side) return std::nullopt;
      sides[k] = *side;
      out.blur_px = std::max(out.blur_px, side->blur_px);
      const double half = std::floor(reach_px / kStepPx);
      out.blur_limit_px = std::min(out.blur_limit_px, kStepPx * std::sqrt(half * (half + 1) / 3));
    }
    for (int k = 0; k < 4; ++k) {
      const std::optional<Eigen::Vector2d> corner = Meet(sides[(k + 3) % 4], sides[k]);
      if (!corner) return std::nullopt;
      corners[k] = *corner;
    }
  }
  out.corners_px = corners;
  return out;
}

}  // namespace weft
