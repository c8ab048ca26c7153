#include "animation/sparse_view/sigma_calibration.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "alignment/placement.h"
#include "animation/rays/imagined_views.h"
#include "animation/sparse_view/ray_driver.h"
#include "base/counter_random.h"
#include "base/median.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Errors are within sigma, and within two, in these shares of the vertices.
constexpr double kOneSigma = 0.683, kTwoSigmas = 0.954;
constexpr size_t kFewErrors = 50;
constexpr double kLeastFactor = 1e-3, kLargestFactor = 1e3;
// More vertices of a frame say nothing new.
constexpr size_t kVerticesOfFrame = 2000;

double MeanDistance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double sum = 0;
  for (size_t v = 0; v < a.size(); ++v) sum += (a[v] - b[v]).norm();
  return sum / static_cast<double>(a.size());
}

// The mean of both, weighted by their frames.
void AddGain(const NetGain& more, NetGain* to) {
  if (more.frames == 0) return;
  const double all = to->frames + more.frames, share = more.frames / all;
  to->before_mm += share * (more.before_mm - to->before_mm);
  to->after_mm += share * (more.after_mm - to->after_mm);
  to->frames += more.frames;
}

// Between the factors that put one sigma and two right; never below the former, as errors along three axes
// would have it, which have shorter tails than those along a ray.
double FactorOf(const std::vector<double>& ratios) {
  const double one = Quantile(ratios, kOneSigma), two = Quantile(ratios, kTwoSigmas) / 2;
  return std::max({kLeastFactor, one, std::sqrt(one * two)});
}

}  // namespace

SigmaCalibration::SigmaCalibration(const Template& garment, const AlignmentModel& model)
    : faces_(garment.rest.faces), model_(model) {
  for (const VertexNode& node : garment.node_of_vertex) is_node_.push_back(node.row >= 0);
}

absl::Status SigmaCalibration::Add(const SparseViewAvatar& avatar,
                                   const std::vector<std::vector<Eigen::Vector3d>>& run, uint64_t seed,
                                   NetCorrection* net) {
  const std::vector<Eigen::Vector3d> mean = avatar.space.Shape(Eigen::VectorXd::Zero(1));
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : mean) spread += p * p.transpose();
  const Eigen::Vector3d up = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
  for (int cameras = 1; cameras <= SigmaScale::kCameras; ++cameras) {
    RayDriver driver(model_, avatar, {}, net);
    ImaginedViews views;
    views.cameras = cameras;
    views.up = RigidFit(mean, run.front()).linear() * up;
    views.azimuth_deg = 360 * UniformOf(KeyOf(seed, "azimuth"), static_cast<uint64_t>(cameras));
    for (size_t f = 0; f < run.size(); ++f) {
      views.seed = KeyOf(seed, absl::StrCat("frame ", f));
      WEFT_ASSIGN_OR_RETURN(const auto rays, ImagineRays(run[f], faces_, is_node_, views));
      WEFT_ASSIGN_OR_RETURN(const auto driven, driver.Drive(1, rays));
      if (f < kSettlingFrames || driven.track.lost) continue;
      if (!driven.uncorrected_mm.empty())
        AddGain({1, MeanDistance(driven.uncorrected_mm, run[f]), MeanDistance(driven.position_mm, run[f])},
                &gain_[cameras - 1]);
      const size_t step = 1 + run[f].size() / kVerticesOfFrame;
      for (size_t v = f % step; v < run[f].size(); v += step) {
        const auto error_mm = static_cast<float>((driven.position_mm[v] - run[f][v]).norm());
        const int rays_of = std::min(driven.rays_of_vertex[v], SigmaScale::kRays - 1);
        errors_[cameras - 1][rays_of].push_back({error_mm, driven.scale_mm[v], driven.growth_mm[v]});
      }
    }
  }
  frames_ += std::max(0, static_cast<int>(run.size()) - kSettlingFrames);
  return absl::OkStatus();
}

SigmaCalibration& SigmaCalibration::operator+=(const SigmaCalibration& other) {
  frames_ += other.frames_;
  for (size_t c = 0; c < gain_.size(); ++c) AddGain(other.gain_[c], &gain_[c]);
  for (size_t c = 0; c < errors_.size(); ++c)
    for (size_t r = 0; r < errors_[c].size(); ++r)
      errors_[c][r].insert(errors_[c][r].end(), other.errors_[c][r].begin(), other.errors_[c][r].end());
  return *this;
}

SigmaCalibration SigmaCalibration::Empty() const {
  SigmaCalibration out = *this;
  out.frames_ = 0;
  out.gain_ = {};
  out.errors_ = {};
  return out;
}

SigmaScale SigmaCalibration::Scales() const {
  const SigmaScale typical = TypicalSigmaScale();
  SigmaScale out = typical;
  // That of vertices without a ray is last: it adds to that of one ray.
  for (int cameras = 0; cameras < SigmaScale::kCameras; ++cameras)
    for (const int rays : {1, 2, 3, 0}) {
      const std::vector<VertexError>& of = errors_[cameras][rays];
      float& factor = out.of[cameras][rays];
      if (of.size() >= kFewErrors && rays > 0) {
        std::vector<double> ratios;
        for (const VertexError& error : of) ratios.push_back(error.error_mm / error.scale_mm);
        factor = static_cast<float>(FactorOf(ratios));
      } else if (of.size() >= kFewErrors) {
        factor = GrowthFactor(of, out.of[cameras]);
      } else if (cameras > 0 && rays <= cameras) {
        factor *= out.of[cameras - 1][rays] / typical.of[cameras - 1][rays];
      } else if (rays > 0) {
        factor *= out.of[cameras][rays - 1] / typical.of[cameras][rays - 1];
      }
    }
  return out;
}

float SigmaCalibration::GrowthFactor(const std::vector<VertexError>& errors,
                                     std::array<float, SigmaScale::kRays> factors) {
  double low = kLeastFactor, high = kLargestFactor;
  std::vector<double> ratios(errors.size());
  while (high > 1.001 * low) {
    factors[0] = static_cast<float>(std::sqrt(low * high));
    for (size_t i = 0; i < errors.size(); ++i)
      ratios[i] = errors[i].error_mm / SigmaScale::Sigma(factors, 0, errors[i].scale_mm, errors[i].growth_mm);
    (FactorOf(ratios) > 1 ? low : high) = factors[0];
  }
  return static_cast<float>(high);
}

SigmaCheck SigmaCalibration::Check(const SigmaScale& scales) const {
  SigmaCheck out;
  out.frames = frames_;
  size_t all = 0, one = 0, two = 0;
  for (size_t c = 0; c < errors_.size(); ++c)
    for (size_t r = 0; r < errors_[c].size(); ++r)
      for (const VertexError& of : errors_[c][r]) {
        const float sigma_mm =
            SigmaScale::Sigma(scales.of[c], static_cast<int>(r), of.scale_mm, of.growth_mm);
        const double ratio = std::min(6.0, static_cast<double>(of.error_mm) / sigma_mm);
        out.loss += std::log(sigma_mm) + ratio * ratio / 2;
        ++all;
        one += of.error_mm < sigma_mm ? 1 : 0;
        two += of.error_mm < 2 * sigma_mm ? 1 : 0;
      }
  if (all == 0) return out;
  out.within_one = static_cast<double>(one) / static_cast<double>(all);
  out.loss /= static_cast<double>(all);
  out.within_two = static_cast<double>(two) / static_cast<double>(all);
  return out;
}

}  // namespace weft
