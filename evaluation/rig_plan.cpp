#include "evaluation/rig_plan.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/mutex.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
// What is known of a point before it is seen; makes the log determinant finite.
constexpr double kPriorSigmaMm = 10;

using Moments = std::vector<std::vector<Eigen::Vector3d>>;

// What one camera says about one sample.
struct SampleSight {
  int sample = 0;
  Eigen::Matrix3f information = Eigen::Matrix3f::Zero();  // 1/mm^2
};

Eigen::Matrix3d InformationAt(const CameraModel& camera, const Eigen::Vector3d& point_mm, double noise_px) {
  const std::optional<Projection> at = camera.ProjectWithDerivative(point_mm);
  if (!at) return Eigen::Matrix3d::Zero();
  return at->d_pixel_d_world.transpose() * at->d_pixel_d_world / (noise_px * noise_px);
}

// NaN where the information does not fix the point.
double SigmaMm(const Eigen::Matrix3d& information) {
  if (!(information.determinant() > 1e-12 * std::pow(information.trace(), 3))) return kUnknown;
  return std::sqrt(information.inverse().trace() / 3);
}

absl::Status CheckMoments(const Template& garment, const Moments& moments_mm) {
  if (moments_mm.empty()) return absl::InvalidArgumentError("there is no moment of the garment's motion");
  for (size_t m = 0; m < moments_mm.size(); ++m)
    if (moments_mm[m].size() != garment.rest.vertices_mm.size())
      return absl::InvalidArgumentError(absl::StrCat("moment ", m, " has ", moments_mm[m].size(),
                                                     " vertices, the template ",
                                                     garment.rest.vertices_mm.size()));
  return absl::OkStatus();
}

absl::StatusOr<std::vector<VisibleMesh>> MakeVisible(const Template& garment, const Moments& moments_mm) {
  const double cell_mm = CellPitchMm(garment);
  if (!(cell_mm > 0)) return absl::InvalidArgumentError("the template has no printed face");
  std::vector<VisibleMesh> meshes;
  for (const auto& vertices_mm : moments_mm) {
    WEFT_ASSIGN_OR_RETURN(VisibleMesh mesh, VisibleMesh::Build(vertices_mm, garment.rest.faces, cell_mm));
    meshes.push_back(std::move(mesh));
  }
  return meshes;
}

// The choice, one camera at a time.
class GreedyChoice {
 public:
  GreedyChoice(std::vector<std::vector<SampleSight>> sights, int samples, const RigPlanOptions& options)
      : sights_(std::move(sights)), options_(options), views_(samples, 0) {
    const Eigen::Matrix3d prior = Eigen::Matrix3d::Identity() / (kPriorSigmaMm * kPriorSigmaMm);
    information_.assign(samples, prior);
    log_determinant_.assign(samples, std::log(prior.determinant()));
  }

  std::vector<PlanStep> Run() {
    struct Candidate {
      double gain;  // an upper bound unless it was computed in this round
      int camera;
      size_t round;
      bool operator<(const Candidate& other) const {
        return gain != other.gain ? gain < other.gain : camera > other.camera;
      }
    };
    std::vector<double> first(sights_.size());
    tbb::parallel_for(size_t{0}, sights_.size(), [&](size_t c) { first[c] = Gain(static_cast<int>(c)); });
    std::priority_queue<Candidate> queue;
    for (size_t c = 0; c < first.size(); ++c) queue.push({first[c], static_cast<int>(c), 0});
    std::vector<PlanStep> steps;
    while (!queue.empty() &&
           (options_.max_cameras == 0 || static_cast<int>(steps.size()) < options_.max_cameras)) {
      Candidate best = queue.top();
      queue.pop();
      if (best.round != steps.size()) {
        best.gain = Gain(best.camera);
        best.round = steps.size();
        queue.push(best);
        continue;
      }
      if (!(best.gain > 0)) break;
      Take(best.camera);
      steps.push_back(StepOf(best.camera));
    }
    return steps;
  }

 private:
  double Gain(int camera) const {
    // What a point can gain by geometry at most, roughly: from the prior to a tenth of a millimetre.
    const double full = 6 * std::log(kPriorSigmaMm / 0.1);
    double gain = 0;
    for (const SampleSight& sight : sights_[camera]) {
      const Eigen::Matrix3d after = information_[sight.sample] + sight.information.cast<double>();
      if (views_[sight.sample] < options_.views_needed) gain += 1.0 / options_.views_needed;
      gain +=
          options_.geometry_weight / full * (std::log(after.determinant()) - log_determinant_[sight.sample]);
    }
    return gain;
  }

  void Take(int camera) {
    for (const SampleSight& sight : sights_[camera]) {
      ++views_[sight.sample];
      information_[sight.sample] += sight.information.cast<double>();
      log_determinant_[sight.sample] = std::log(information_[sight.sample].determinant());
    }
  }

  PlanStep StepOf(int camera) const {
    const Eigen::Matrix3d prior = Eigen::Matrix3d::Identity() / (kPriorSigmaMm * kPriorSigmaMm);
    PlanStep step{camera, 0, 0, kUnknown};
    std::vector<double> sigmas;
    for (size_t s = 0; s < views_.size(); ++s) {
      step.mean_views += views_[s];
      if (views_[s] < options_.views_needed) continue;
      step.coverage += 1;
      sigmas.push_back(SigmaMm(information_[s] - prior));
    }
    std::erase_if(sigmas, [](double sigma) { return std::isnan(sigma); });
    step.coverage /= static_cast<double>(views_.size());
    step.mean_views /= static_cast<double>(views_.size());
    if (!sigmas.empty()) step.median_sigma_mm = Median(std::move(sigmas));
    return step;
  }

  const std::vector<std::vector<SampleSight>> sights_;  // [cameras]
  const RigPlanOptions& options_;
  std::vector<int> views_;                    // [samples]
  std::vector<Eigen::Matrix3d> information_;  // [samples], prior included
  std::vector<double> log_determinant_;
};

}  // namespace

absl::Status RigPlanOptions::Validate() const {
  if (views_needed < 2) return absl::InvalidArgumentError("views_needed must be at least 2");
  if (!(noise_px > 0)) return absl::InvalidArgumentError("noise_px must be positive");
  if (max_cameras < 0) return absl::InvalidArgumentError("max_cameras must not be negative");
  if (max_samples < 1) return absl::InvalidArgumentError("max_samples must be at least 1");
  if (!(geometry_weight >= 0)) return absl::InvalidArgumentError("geometry_weight must not be negative");
  return viewing.Validate();
}

absl::StatusOr<std::vector<PlanStep>> PlanRig(const Template& garment, const Moments& moments_mm,
                                              const Rig& candidates, const RigPlanOptions& options,
                                              const std::function<void(size_t, size_t)>& on_camera) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_RETURN_IF_ERROR(CheckMoments(garment, moments_mm));
  WEFT_ASSIGN_OR_RETURN(const std::vector<VisibleMesh> meshes, MakeVisible(garment, moments_mm));
  std::vector<int> vertices;
  for (size_t v = 0; v < garment.node_of_vertex.size(); ++v)
    if (garment.node_of_vertex[v].row >= 0) vertices.push_back(static_cast<int>(v));
  const size_t all = vertices.size() * moments_mm.size();
  const size_t step = std::max<size_t>(1, all / static_cast<size_t>(options.max_samples));
  const size_t samples = (all + step - 1) / step;

  std::vector<std::vector<SampleSight>> sights(candidates.cameras.size());
  struct {
    Mutex mutex;
    size_t done ABSL_GUARDED_BY(mutex) = 0;
  } progress;
  tbb::parallel_for(size_t{0}, sights.size(), [&](size_t c) {
    const CameraModel& camera = candidates.cameras[c];
    for (size_t s = 0; s < samples; ++s) {
      const VisibleMesh& mesh = meshes[s * step / vertices.size()];
      const int vertex = vertices[s * step % vertices.size()];
      if (!mesh.Observe(vertex, camera, options.viewing).seen) continue;
      sights[c].push_back(
          {static_cast<int>(s),
           InformationAt(camera, mesh.vertices_mm()[vertex], options.noise_px).cast<float>()});
    }
    const MutexLock lock(progress.mutex);
    if (on_camera) on_camera(++progress.done, sights.size());
  });
  if (std::all_of(sights.begin(), sights.end(), [](const auto& seen) { return seen.empty(); })) {
    return absl::FailedPreconditionError(
        "no camera sees any cell well enough; is the garment in the rig's field of view, and are the cells "
        "large enough in the pictures?");
  }
  return GreedyChoice(std::move(sights), static_cast<int>(samples), options).Run();
}

absl::StatusOr<RigForecast> ForecastRig(const Template& garment, const Moments& moments_mm, const Rig& rig,
                                        const RigPlanOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_RETURN_IF_ERROR(CheckMoments(garment, moments_mm));
  WEFT_ASSIGN_OR_RETURN(const std::vector<VisibleMesh> meshes, MakeVisible(garment, moments_mm));
  const size_t vertices = garment.node_of_vertex.size();
  RigForecast out;
  for (auto* field : {&out.views, &out.coverage, &out.pitch_px, &out.sigma_mm})
    field->assign(vertices, kUnknown);
  tbb::parallel_for(size_t{0}, vertices, [&](size_t v) {
    if (garment.node_of_vertex[v].row < 0) return;
    double views = 0, covered = 0, pitch_px = 0, sigma_mm = 0;
    int known = 0;
    for (const VisibleMesh& mesh : meshes) {
      int seen = 0;
      Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
      for (const CameraModel& camera : rig.cameras) {
        const VertexView view = mesh.Observe(static_cast<int>(v), camera, options.viewing);
        if (!view.seen) continue;
        ++seen;
        pitch_px += view.pitch_px;
        information += InformationAt(camera, mesh.vertices_mm()[v], options.noise_px);
      }
      views += seen;
      if (seen < options.views_needed) continue;
      ++covered;
      if (const double sigma = SigmaMm(information); !std::isnan(sigma)) sigma_mm += sigma, ++known;
    }
    const auto moments = static_cast<double>(meshes.size());
    out.views[v] = views / moments;
    out.coverage[v] = covered / moments;
    if (views > 0) out.pitch_px[v] = pitch_px / views;
    if (known > 0) out.sigma_mm[v] = sigma_mm / known;
  });
  return out;
}

}  // namespace weft
