#include "alignment/elastic_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "alignment/field_algebra.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// The last steps and changes of the gradient, and the quasi-Newton direction they give (Nocedal & Wright,
// Algorithm 7.4).
class Corrections {
 public:
  explicit Corrections(int limit) : limit_(limit) {}

  void Clear() { pairs_.clear(); }

  void Add(const Field3& from, const Field3& to, const Field3& gradient, const Field3& next_gradient) {
    Pair pair;
    if (static_cast<int>(pairs_.size()) == limit_) {
      pair = std::move(pairs_.front());  // its memory is used again
      pairs_.pop_front();
    }
    pair.step.Resize(to.x.size()), pair.change.Resize(to.x.size());
    Combine(to, -1, from, &pair.step);
    Combine(next_gradient, -1, gradient, &pair.change);
    pair.product = Dot(pair.step, pair.change);
    if (pair.product > 1e-12 * std::sqrt(Dot(pair.step, pair.step) * Dot(pair.change, pair.change))) {
      pairs_.push_back(std::move(pair));
    }
  }

  // Replaces the gradient by the direction of descent.
  void Direction(const ElasticPreconditioner& preconditioner, Field3* gradient, Field3* direction) const {
    std::vector<double> alpha(pairs_.size());
    for (size_t i = pairs_.size(); i-- > 0;) {
      alpha[i] = Dot(pairs_[i].step, *gradient) / pairs_[i].product;
      AddScaled(static_cast<float>(-alpha[i]), pairs_[i].change, gradient);
    }
    preconditioner.Apply(*gradient, direction);
    for (size_t i = 0; i < pairs_.size(); ++i) {
      const double beta = Dot(pairs_[i].change, *direction) / pairs_[i].product;
      AddScaled(static_cast<float>(alpha[i] - beta), pairs_[i].step, direction);
    }
  }

 private:
  struct Pair {
    Field3 step, change;
    double product = 0;
  };
  int limit_;
  std::deque<Pair> pairs_;
};

// Positions relative to their mean (single precision would lose digits far from the origin), and rotations.
class State {
 public:
  State(const SlicedMesh& mesh, const ElasticProblem& problem, const ElasticOptions& options,
        const Deformation& start)
      : mesh_(mesh), options_(options) {
    const size_t size = static_cast<size_t>(mesh.slices) * kSliceLanes;
    for (const Eigen::Vector3d& p : start.position_mm) center_ += p / mesh.vertices;
    Assign(start.position_mm, size, &position_);
    Assign(problem.targets_mm, size, &target_);
    weight_.Resize(size);
    for (size_t v = 0; v < problem.weights.size(); ++v) {
      const Eigen::Matrix3f w = problem.weights[v].cast<float>();
      weight_.xx[v] = w(0, 0), weight_.xy[v] = w(0, 1), weight_.xz[v] = w(0, 2);
      weight_.yy[v] = w(1, 1), weight_.yz[v] = w(1, 2), weight_.zz[v] = w(2, 2);
    }
    for (size_t v = 0; v < problem.frozen.size(); ++v) {
      if (problem.frozen[v]) frozen_.push_back(static_cast<int>(v));
    }
    rotation_.resize(4 * size);
    for (size_t v = 0; v < size; ++v) rotation_[4 * v] = 1;
    for (int v = 0; v < mesh.vertices; ++v) {
      const Eigen::Quaterniond q(start.rotation[v]);
      const double record[4] = {q.w(), q.x(), q.y(), q.z()};
      for (int k = 0; k < 4; ++k) rotation_[4 * v + k] = static_cast<float>(record[k]);
    }
    next_rotation_ = rotation_;
    packed_.resize(4 * size);
    PackRecords(position_, &packed_);
  }

  Field3& position() { return position_; }
  // The rotations as they were before the last fit.
  void UndoFit() { std::swap(rotation_, next_rotation_); }
  Field3 NewField() const {
    Field3 field;
    field.Resize(position_.x.size());
    return field;
  }

  // Local step: minimising over R_k the part of stretch |d - (a+b)/2|^2 + bending |a-b|^2 that holds it, with
  // d and b fixed, is maximising a . (stretch d + (2 bending - stretch / 2) b) summed over the edges.
  void FitAllRotations() {
    const double stretch = options_.distortion.stretch, bending = options_.distortion.bending;
    RotationStep step;
    step.along_edge = static_cast<float>(stretch);
    step.along_neighbor = static_cast<float>(2 * bending - stretch / 2);
    step.along_own = 0.5f * std::max(0.0f, -step.along_neighbor);
    FitAllRotations(step);
  }
  void FitAllRotations(const RotationStep& step) {
    ForEachBlock(mesh_.slices, [&](int, SliceRange range) {
      BestElasticKernels().fit_rotations(mesh_.tables(), range, step, packed_.data(), rotation_.data(),
                                         next_rotation_.data());
    });
    std::swap(rotation_, next_rotation_);
  }

  double Evaluate(Field3* half_gradient) {
    PackRecords(position_, &packed_);
    FitAllRotations();
    return EnergyAt(half_gradient);
  }
  double EnergyAt(Field3* half_gradient) const {
    const EnergyTables terms = Terms();
    float* const out[3] = {half_gradient->x.data(), half_gradient->y.data(), half_gradient->z.data()};
    const double energy = SumOverBlocks(mesh_.slices, [&](SliceRange range) {
      return BestElasticKernels().energy(mesh_.tables(), range, terms, packed_.data(), rotation_.data(), out);
    });
    for (const int v : frozen_) half_gradient->x[v] = half_gradient->y[v] = half_gradient->z[v] = 0;
    return energy;
  }

  void WriteTo(Deformation* out) const {
    for (int v = 0; v < mesh_.vertices; ++v) {
      out->position_mm[v] = center_ + Eigen::Vector3d(position_.x[v], position_.y[v], position_.z[v]);
      const float* r = &rotation_[4 * v];
      const Eigen::Quaterniond q(r[0], r[1], r[2], r[3]);
      out->rotation[v] = q.normalized().toRotationMatrix();
    }
  }

 private:
  EnergyTables Terms() const {
    const FieldSym& w = weight_;
    return {{target_.x.data(), target_.y.data(), target_.z.data()},
            {w.xx.data(), w.xy.data(), w.xz.data(), w.yy.data(), w.yz.data(), w.zz.data()},
            static_cast<float>(options_.lambda * options_.distortion.stretch),
            static_cast<float>(options_.lambda * options_.distortion.bending)};
  }

  void Assign(const std::vector<Eigen::Vector3d>& values, size_t size, Field3* out) const {
    out->Resize(size);
    for (size_t v = 0; v < values.size(); ++v) {
      const Eigen::Vector3f p = (values[v] - center_).cast<float>();
      out->x[v] = p.x(), out->y[v] = p.y(), out->z[v] = p.z();
    }
  }

  const SlicedMesh& mesh_;
  const ElasticOptions& options_;
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  Field3 position_, target_;
  Records packed_;  // the positions
  Records rotation_, next_rotation_;
  FieldSym weight_;
  std::vector<int> frozen_;
};

constexpr int kSettledIterations = 3;  // in a row below the tolerance
constexpr int kMaxShortenings = 2;
constexpr double kLeastShare = 0.1, kMostShare = 0.5;  // of a length that gained nothing, to be tried next
constexpr int kRigidFitSteps = 24;  // from any start; the last ones no longer change anything

// Share of a length at which the parabola through the energy at 0, its slope there and the energy at the
// length is lowest.
double LowestShare(double energy, double slope, double length, double energy_at_length) {
  return -slope * length / (2 * (energy_at_length - energy - slope * length));
}

class Minimiser {
 public:
  Minimiser(State* state, const ElasticPreconditioner& preconditioner, const ElasticOptions& options)
      : state_(*state), preconditioner_(preconditioner), options_(options), corrections_(kCorrections) {
    for (Field3* field : {&gradient_, &next_gradient_, &direction_, &start_}) *field = state->NewField();
    energy_ = report_.energy_before = state->Evaluate(&gradient_);
    report_.evaluations = 1;
  }

  absl::StatusOr<ElasticReport> Run(const CancelCheck& cancelled) {
    while (report_.iterations < options_.max_iterations && !report_.converged) {
      if (cancelled && cancelled()) return absl::CancelledError("the alignment was cancelled");
      Iterate();
    }
    report_.energy_after = energy_;
    return report_;
  }

 private:
  void Iterate() {
    std::swap(start_, state_.position());  // what is tried is written there
    ++report_.iterations;
    if (!Search()) {
      // The memory misleads, or single precision leaves nothing to gain; without memory it is the last
      // attempt.
      std::swap(start_, state_.position());
      report_.converged = settled_ > 0;
      settled_ = kSettledIterations - 1;
      corrections_.Clear();
      return;
    }
    corrections_.Add(start_, state_.position(), gradient_, next_gradient_);
    settled_ = energy_ - next_energy_ < options_.tolerance * energy_ ? settled_ + 1 : 0;
    report_.converged = settled_ >= kSettledIterations;
    energy_ = next_energy_;
    std::swap(gradient_, next_gradient_);
  }

  // Goes along a direction of descent to a lower energy; false where there is none.
  bool Search() {
    reduced_ = gradient_;
    corrections_.Direction(preconditioner_, &reduced_, &direction_);
    const double slope = -2 * Dot(gradient_, direction_);
    double length = 1;
    for (int shortening = 0; !Try(length); ++shortening) {
      state_.UndoFit();
      if (shortening == kMaxShortenings) return false;
      length *= std::clamp(LowestShare(energy_, slope, length, next_energy_), kLeastShare, kMostShare);
    }
    return true;
  }

  // Whether the energy is lower at a length along the direction.
  bool Try(double length) {
    Combine(start_, static_cast<float>(-length), direction_, &state_.position());
    next_energy_ = state_.Evaluate(&next_gradient_);
    ++report_.evaluations;
    return next_energy_ < energy_;
  }

  State& state_;
  const ElasticPreconditioner& preconditioner_;
  const ElasticOptions& options_;
  Corrections corrections_;
  Field3 gradient_, next_gradient_, reduced_, direction_;
  Field3 start_;  // of the iteration
  double energy_ = 0, next_energy_ = 0;
  int settled_ = 0;
  ElasticReport report_;
};

}  // namespace

void FitRigid(const SlicedMesh& mesh, Deformation* deformation) {
  const ElasticOptions options;
  State state(mesh, {}, options, *deformation);
  state.FitAllRotations({.along_edge = 1, .along_neighbor = 0, .newton_steps = kRigidFitSteps});
  state.WriteTo(deformation);
}

absl::StatusOr<ElasticReport> SolveElastic(const SlicedMesh& mesh, const ElasticProblem& problem,
                                           const ElasticPreconditioner& preconditioner,
                                           const ElasticOptions& options, Deformation* deformation,
                                           const CancelCheck& cancelled) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  State state(mesh, problem, options, *deformation);
  absl::StatusOr<ElasticReport> report = Minimiser(&state, preconditioner, options).Run(cancelled);
  if (!report.ok()) return report;
  state.WriteTo(deformation);
  return report;
}

absl::StatusOr<ElasticReport> SolveElastic(const SlicedMesh& mesh, const MeshGraph& graph,
                                           const ElasticProblem& problem, const ElasticOptions& options,
                                           Deformation* deformation, const CancelCheck& cancelled) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(const ElasticPreconditioner preconditioner,
                        ElasticPreconditioner::Build(mesh, graph, problem, options));
  return SolveElastic(mesh, problem, preconditioner, options, deformation, cancelled);
}

}  // namespace weft
