#include "animation/shape/shape_space.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/placement.h"
#include "base/counter_random.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Directions beyond those that are kept, which make the last of them exact.
constexpr int kSpareDirections = 8;
// Frames that are multiplied at once.
constexpr int kBatch = 16;
// Passes over the frames beside the rounds: two for what they are brought onto, one for the mean, one for the
// variances.
constexpr int kOtherPasses = 4;

Eigen::VectorXd Flat(const std::vector<Eigen::Vector3d>& points) {
  Eigen::VectorXd out(3 * points.size());
  for (size_t v = 0; v < points.size(); ++v) out.segment<3>(3 * v) = points[v];
  return out;
}

std::vector<Eigen::Vector3d> Points(const Eigen::VectorXd& flat) {
  std::vector<Eigen::Vector3d> out(flat.size() / 3);
  for (size_t v = 0; v < out.size(); ++v) out[v] = flat.segment<3>(3 * v);
  return out;
}

Eigen::Vector3d MeanOf(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

// Reads all frames, each brought onto a shape.
class AlignedPasses {
 public:
  AlignedPasses(const MeshFrames& frames, int passes, const std::function<void(double)>& on_progress,
                const std::stop_token& stop)
      : frames_(frames), passes_(passes), on_progress_(on_progress), stop_(stop) {}

  absl::Status Begin() {
    WEFT_ASSIGN_OR_RETURN(std::vector<Eigen::Vector3d> first, frames_.read(0));
    if (first.empty()) return absl::InvalidArgumentError("shape space: frame 0 has no vertices");
    onto_ = std::move(first);
    Center();
    return absl::OkStatus();
  }

  // From now on frames are brought onto this shape.
  void Onto(const Eigen::VectorXd& shape) {
    onto_ = Points(shape);
    Center();
  }
  int size() const { return static_cast<int>(3 * onto_.size()); }

  absl::Status ForEachBatch(const std::function<void(const Eigen::MatrixXd&)>& take) {
    for (int first = 0; first < frames_.frames; first += kBatch) {
      Eigen::MatrixXd batch(size(), std::min(kBatch, frames_.frames - first));
      for (int k = 0; k < batch.cols(); ++k) {
        if (stop_.stop_requested()) return absl::CancelledError("the training was stopped");
        WEFT_ASSIGN_OR_RETURN(std::vector<Eigen::Vector3d> mesh, frames_.read(first + k));
        WEFT_RETURN_IF_ERROR(Check(mesh, first + k));
        const Eigen::Isometry3d motion = RigidFit(mesh, onto_);
        for (Eigen::Vector3d& p : mesh) p = motion * p;
        batch.col(k) = Flat(mesh);
      }
      take(batch);
      const double done = std::min(1.0, static_cast<double>(first + kBatch) / frames_.frames);
      if (on_progress_) on_progress_((finished_ + done) / passes_);
    }
    ++finished_;
    return absl::OkStatus();
  }

  absl::StatusOr<Eigen::VectorXd> Mean() {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(size());
    WEFT_RETURN_IF_ERROR(ForEachBatch([&](const Eigen::MatrixXd& batch) { sum += batch.rowwise().sum(); }));
    return Eigen::VectorXd(sum / frames_.frames);
  }

 private:
  void Center() {
    const Eigen::Vector3d middle = MeanOf(onto_);
    for (Eigen::Vector3d& p : onto_) p -= middle;
  }

  absl::Status Check(const std::vector<Eigen::Vector3d>& mesh, int frame) const {
    if (mesh.size() != onto_.size())
      return absl::InvalidArgumentError(absl::StrCat("shape space: frame ", frame, " has ", mesh.size(),
                                                     " vertices, frame 0 has ", onto_.size()));
    for (const Eigen::Vector3d& p : mesh)
      if (!p.allFinite())
        return absl::InvalidArgumentError(
            absl::StrCat("shape space: frame ", frame, " has a vertex that is not finite"));
    return absl::OkStatus();
  }

  const MeshFrames& frames_;
  int passes_;
  const std::function<void(double)>& on_progress_;
  std::stop_token stop_;
  std::vector<Eigen::Vector3d> onto_;
  int finished_ = 0;
};

Eigen::MatrixXd Orthonormal(const Eigen::MatrixXd& columns) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> factor(columns);
  return factor.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
}

Eigen::MatrixXd RandomDirections(int rows, int columns, uint64_t seed) {
  const uint64_t key = KeyOf(seed, "shape space");
  Eigen::MatrixXd out(rows, columns);
  for (int c = 0; c < columns; ++c)
    for (int r = 0; r < rows; ++r)
      out(r, c) = NormalOf(key, static_cast<uint64_t>(c) * static_cast<uint64_t>(rows) + r);
  return Orthonormal(out);
}

// The components of what the directions hold, in the order of their variance; signs such that the largest
// entry is positive.
void SetComponents(const Eigen::MatrixXd& directions, const Eigen::MatrixXd& covariance, int components,
                   ShapeSpace* out) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  const int all = static_cast<int>(directions.cols());
  for (int k = 0; k < components; ++k) {
    const double variance = solver.eigenvalues()[all - 1 - k];
    if (k > 0 && variance < 1e-12 * solver.eigenvalues()[all - 1]) break;  // the frames have no more
    Eigen::VectorXd direction = directions * solver.eigenvectors().col(all - 1 - k);
    Eigen::Index largest = 0;
    direction.cwiseAbs().maxCoeff(&largest);
    if (direction[largest] < 0) direction = -direction;
    out->sigma_mm.push_back(static_cast<float>(std::sqrt(std::max(variance, 0.0))));
    for (const double d : direction) out->basis.push_back(static_cast<float>(d));
  }
}

}  // namespace

std::vector<Eigen::Vector3d> ShapeSpace::Shape(const Eigen::VectorXd& z) const {
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(vertices);
  Eigen::VectorXf flat = Eigen::Map<const Eigen::VectorXf>(mean_mm.data(), size);
  for (Eigen::Index k = 0; k < z.size(); ++k)
    flat += static_cast<float>(z[k] * sigma_mm[k]) *
            Eigen::Map<const Eigen::VectorXf>(basis.data() + k * size, size);
  std::vector<Eigen::Vector3d> out(vertices);
  for (int v = 0; v < vertices; ++v) out[v] = flat.segment<3>(3 * v).cast<double>();
  return out;
}

Eigen::VectorXd ShapeSpace::Project(const std::vector<Eigen::Vector3d>& aligned_mm) const {
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(vertices);
  const Eigen::VectorXf offset =
      Flat(aligned_mm).cast<float>() - Eigen::Map<const Eigen::VectorXf>(mean_mm.data(), size);
  Eigen::VectorXd z(components());
  for (int k = 0; k < components(); ++k)
    z[k] = Eigen::Map<const Eigen::VectorXf>(basis.data() + k * size, size).dot(offset) / sigma_mm[k];
  return z;
}

absl::Status ShapeSpace::Validate() const {
  const auto bad = [](const std::string& what) { return absl::InvalidArgumentError("shape space: " + what); };
  if (vertices < 3) return bad("has fewer than three vertices");
  const size_t size = size_t{3} * static_cast<size_t>(vertices);
  if (mean_mm.size() != size) return bad("the mean is of another number of vertices");
  if (sigma_mm.empty()) return bad("has no components");
  if (basis.size() != size * sigma_mm.size()) return bad("basis and sigmas differ in their number");
  const auto finite = [](const std::vector<float>& values) {
    return std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); });
  };
  if (!finite(mean_mm) || !finite(basis) || !finite(sigma_mm) || !std::isfinite(left_mm))
    return bad("holds a number that is not finite");
  if (sigma_mm.back() <= 0 || !std::is_sorted(sigma_mm.rbegin(), sigma_mm.rend()))
    return bad("the sigmas must be positive and fall");
  if (left_mm < 0) return bad("what is left must not be negative");
  return absl::OkStatus();
}

absl::Status ShapeSpaceOptions::Validate() const {
  if (components < 1 || components > 512)
    return absl::InvalidArgumentError("shape space: components must be 1 to 512");
  if (rounds < 1 || rounds > 20) return absl::InvalidArgumentError("shape space: rounds must be 1 to 20");
  return absl::OkStatus();
}

absl::StatusOr<ShapeSpace> LearnShapeSpace(const MeshFrames& frames, const ShapeSpaceOptions& options,
                                           const std::function<void(double)>& on_progress,
                                           const std::stop_token& stop) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  if (frames.frames < 2) return absl::InvalidArgumentError("shape space: needs at least two frames");
  AlignedPasses passes(frames, options.rounds + kOtherPasses, on_progress, stop);
  absl::Status status = passes.Begin();
  if (!status.ok()) return status;
  absl::StatusOr<Eigen::VectorXd> mean;
  for (int pass = 0; pass < 3; ++pass) {
    if (mean.ok()) passes.Onto(*mean);
    mean = passes.Mean();
    if (!mean.ok()) return mean.status();
  }
  const int components = std::min({options.components, frames.frames - 1, passes.size()});
  const int wide = std::min({components + kSpareDirections, frames.frames, passes.size()});
  Eigen::MatrixXd directions = RandomDirections(passes.size(), wide, options.seed);
  for (int round = 0; round < options.rounds; ++round) {
    Eigen::MatrixXd next = Eigen::MatrixXd::Zero(passes.size(), wide);
    status = passes.ForEachBatch([&](const Eigen::MatrixXd& batch) {
      const Eigen::MatrixXd offset = batch.colwise() - *mean;
      next.noalias() += offset * (offset.transpose() * directions);
    });
    if (!status.ok()) return status;
    directions = Orthonormal(next);
  }
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(wide, wide);
  double variance = 0;
  status = passes.ForEachBatch([&](const Eigen::MatrixXd& batch) {
    const Eigen::MatrixXd offset = batch.colwise() - *mean;
    const Eigen::MatrixXd part = directions.transpose() * offset;
    covariance += part * part.transpose() / frames.frames;
    variance += offset.squaredNorm() / frames.frames;
  });
  if (!status.ok()) return status;
  ShapeSpace out;
  out.vertices = passes.size() / 3;
  for (const double m : *mean) out.mean_mm.push_back(static_cast<float>(m));
  SetComponents(directions, covariance, components, &out);
  for (const float sigma : out.sigma_mm) variance -= static_cast<double>(sigma) * sigma;
  out.left_mm = std::sqrt(std::max(0.0, variance) / passes.size());
  if (status = out.Validate(); !status.ok()) return status;
  return out;
}

}  // namespace weft
