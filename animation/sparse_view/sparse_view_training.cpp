#include "animation/sparse_view/sparse_view_training.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/align.h"
#include "alignment/placement.h"
#include "animation/sparse_view/net_correction.h"
#include "animation/sparse_view/sigma_calibration.h"
#include "base/counter_random.h"
#include "base/mutex.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Of a take without held-out ones beside it.
constexpr int kHeldOutShare = 10;
// Before cameras a carrier is off its edges' lengths so many times more (variance) than the space's nearest
// shape is. Chosen as the numbers of IsometricOptions: 1, 2 and 4 gave errors of 1.18, 1.02 and 1.01 mm, and
// lengths that follow no carrier 1.04.
constexpr double kCarrierNoise = 4;
constexpr double kLeastEdgeSpreadMm = 0.05;  // of an edge: below, cloth is as good as rigid
constexpr double kLeastLeftMm = 0.1;
constexpr double kLeastAcceleration = 1e-3;
constexpr size_t kLeastFrames = 10;
// That an avatar learns from while a motion is left out.
constexpr size_t kFoldFrames = 300;

struct FrameOfTake {
  int take, frame;
};

// What is learnt from and what is held out, in the order of the takes.
struct Split {
  std::vector<FrameOfTake> learnt, held_out;
};

Split SplitOf(const std::vector<TrainingTake>& takes, int max_frames) {
  Split all;
  for (size_t t = 0; t < takes.size(); ++t) {
    const int last = LearntFrames(takes, t);
    for (int f = 0; f < takes[t].frames; ++f)
      (f >= last ? all.held_out : all.learnt).push_back({static_cast<int>(t), f});
  }
  const size_t most = static_cast<size_t>(max_frames), count = all.learnt.size();
  if (count > most) {
    std::vector<FrameOfTake> fewer;
    for (size_t i = 0; i < most; ++i) fewer.push_back(all.learnt[i * count / most]);
    all.learnt = std::move(fewer);
  }
  return all;
}

// Reads frames and looks at each.
class CheckedFrames {
 public:
  CheckedFrames(const TrainingFrames& frames, size_t vertices, const std::stop_token& stop)
      : frames_(frames), vertices_(vertices), stop_(stop) {}

  absl::StatusOr<std::vector<Eigen::Vector3d>> Read(const FrameOfTake& at) const {
    if (stop_.stop_requested()) return absl::CancelledError("the training was stopped");
    WEFT_ASSIGN_OR_RETURN(std::vector<Eigen::Vector3d> mesh, frames_.read(at.take, at.frame));
    const bool is_finite = std::all_of(mesh.begin(), mesh.end(), [](const auto& p) { return p.allFinite(); });
    if (mesh.size() == vertices_ && is_finite) return mesh;
    return absl::InvalidArgumentError(
        absl::StrCat(frames_.takes[at.take].name, ", frame ", at.frame,
                     is_finite ? absl::StrCat(": has ", mesh.size(), " vertices, the template ", vertices_)
                               : ": has a vertex that is not finite"));
  }

 private:
  const TrainingFrames& frames_;
  size_t vertices_;
  std::stop_token stop_;
};

struct EdgeLength {
  double mean_mm = 0, follow = 0, spread_mm = 0;
};

// How long an edge is, and how long in the space's nearest shape.
struct LengthSums {
  double length = 0, length2 = 0, nearest = 0, nearest2 = 0, product = 0;

  void Add(double true_mm, double nearest_mm) {
    length += true_mm, length2 += true_mm * true_mm;
    nearest += nearest_mm, nearest2 += nearest_mm * nearest_mm, product += true_mm * nearest_mm;
  }
  EdgeLength Describe(int frames) const {
    EdgeLength out;
    out.mean_mm = length / frames;
    // About the mean of the true lengths.
    const double m = out.mean_mm;
    const double of_true = std::max(0.0, length2 / frames - m * m);
    const double of_nearest = nearest2 / frames - 2 * m * nearest / frames + m * m;
    const double of_both = product / frames - m * nearest / frames;
    if (of_nearest > 0) out.follow = std::clamp(1 - kCarrierNoise * (1 - of_both / of_nearest), 0.0, 1.0);
    out.spread_mm =
        std::sqrt(std::max(0.0, of_true - 2 * out.follow * of_both + out.follow * out.follow * of_nearest));
    return out;
  }
};

// Lengths of edges, what the space leaves, and how z changes from frame to frame.
class Statistics {
 public:
  Statistics(const MeshGraph& graph, const ShapeSpace& space)
      : graph_(graph),
        space_(space),
        onto_(space.Shape(Eigen::VectorXd::Zero(1))),
        lengths_(graph.edges.size()),
        left_(graph.vertices, 0),
        acceleration_(Eigen::VectorXd::Zero(space.components())) {}

  void Add(const FrameOfTake& at, const std::vector<Eigen::Vector3d>& mesh) {
    ++frames_;
    const Eigen::Isometry3d motion = RigidFit(mesh, onto_);
    std::vector<Eigen::Vector3d> aligned;
    for (const Eigen::Vector3d& p : mesh) aligned.push_back(motion * p);
    const Eigen::VectorXd z = space_.Project(aligned);
    const std::vector<Eigen::Vector3d> nearest = space_.Shape(z);
    for (int v = 0; v < graph_.vertices; ++v) left_[v] += (aligned[v] - nearest[v]).squaredNorm() / 3;
    for (size_t e = 0; e < graph_.edges.size(); ++e) {
      const auto [a, b] = graph_.edges[e];
      lengths_[e].Add((mesh[a] - mesh[b]).norm(), (nearest[a] - nearest[b]).norm());
    }
    if (past_.size() == 2 && at.take == last_.take && at.frame == last_.frame + 1) {
      acceleration_ += (z - 2 * past_[1] + past_[0]).cwiseAbs2();
      ++pairs_;
    }
    if (at.take != last_.take || at.frame != last_.frame + 1) past_.clear();
    past_.push_back(z);
    if (past_.size() > 2) past_.erase(past_.begin());
    last_ = at;
  }

  void Into(SparseViewAvatar* out) const {
    for (const LengthSums& of : lengths_) {
      const EdgeLength edge = of.Describe(frames_);
      out->edge_mm.push_back(static_cast<float>(edge.mean_mm));
      out->edge_follow.push_back(static_cast<float>(edge.follow));
      out->edge_spread_mm.push_back(static_cast<float>(std::max(kLeastEdgeSpreadMm, edge.spread_mm)));
    }
    for (const double left : left_)
      out->left_mm.push_back(static_cast<float>(std::max(kLeastLeftMm, std::sqrt(left / frames_))));
    for (const double a : acceleration_) {
      // Frames that were thinned out do not follow each other: nothing is known, and nothing expected.
      const double spread = pairs_ > 0 ? std::sqrt(a / pairs_) : 10;
      out->acceleration.push_back(static_cast<float>(std::max(kLeastAcceleration, spread)));
    }
  }

 private:
  const MeshGraph& graph_;
  const ShapeSpace& space_;
  std::vector<Eigen::Vector3d> onto_;
  std::vector<LengthSums> lengths_;
  std::vector<double> left_;
  Eigen::VectorXd acceleration_;
  std::vector<Eigen::VectorXd> past_;
  FrameOfTake last_{-1, -1};
  int frames_ = 0, pairs_ = 0;
};

// Runs of frames that follow each other, evenly spread over those given: so many that `frames` count. They
// are shorter where the takes are; none are made that are hardly longer than tracking takes to settle.
std::vector<std::vector<FrameOfTake>> RunsOf(const std::vector<FrameOfTake>& from, int frames) {
  constexpr size_t kLongest = SigmaCalibration::kRunFrames + SigmaCalibration::kSettlingFrames;
  constexpr size_t kShortest = SigmaCalibration::kSettlingFrames + 2;
  const auto ends = [&](size_t first, size_t length) {
    return first + length <= from.size() && from[first].take == from[first + length - 1].take;
  };
  std::vector<std::vector<FrameOfTake>> out;
  for (size_t length = kLongest; length >= kShortest && out.empty(); --length) {
    std::vector<size_t> possible;
    for (size_t i = 0; i < from.size(); ++i)
      if (ends(i, length)) possible.push_back(i);
    const size_t counting = length - SigmaCalibration::kSettlingFrames;
    const size_t runs = std::min(possible.size(), (static_cast<size_t>(frames) + counting - 1) / counting);
    for (size_t k = 0; k < runs; ++k) {
      const size_t first = possible[(2 * k + 1) * possible.size() / (2 * runs)];
      out.emplace_back(from.begin() + static_cast<std::ptrdiff_t>(first),
                       from.begin() + static_cast<std::ptrdiff_t>(first + length));
    }
  }
  return out;
}

// Groups of frames that follow each other, evenly chosen, so that how shapes change is known of them as well.
std::vector<FrameOfTake> Thinned(const std::vector<FrameOfTake>& frames, size_t most) {
  constexpr size_t kTogether = 3;
  if (frames.size() <= most) return frames;
  const size_t groups = most / kTogether;
  std::vector<FrameOfTake> out;
  for (size_t g = 0; g < groups; ++g)
    for (size_t k = 0; k < kTogether; ++k)
      out.push_back(frames[g * (frames.size() - kTogether) / groups + k]);
  return out;
}

using StageProgress = std::function<void(double share)>;

// Learns shapes, lengths and motion of some frames; sigma's factors stay 1.
class Learner {
 public:
  Learner(const AlignmentModel& model, const CheckedFrames& checked, const SparseViewTraining& training,
          const std::stop_token& stop)
      : model_(model), checked_(checked), training_(training), stop_(stop) {}

  absl::Status Learn(const std::vector<FrameOfTake>& frames, const StageProgress& on_shapes,
                     const StageProgress& on_lengths, SparseViewAvatar* out) const {
    const MeshFrames learnt{static_cast<int>(frames.size()),
                            [&](int frame) { return checked_.Read(frames[static_cast<size_t>(frame)]); }};
    ShapeSpaceOptions options;
    options.components = training_.components;
    options.seed = training_.seed;
    WEFT_ASSIGN_OR_RETURN(ShapeSpace space, LearnShapeSpace(learnt, options, on_shapes, stop_));
    out->space = std::move(space);
    Statistics statistics(model_.graph(), out->space);
    for (size_t i = 0; i < frames.size(); ++i) {
      WEFT_ASSIGN_OR_RETURN(const auto mesh, checked_.Read(frames[i]));
      statistics.Add(frames[i], mesh);
      if (on_lengths) on_lengths(static_cast<double>(i + 1) / static_cast<double>(frames.size()));
    }
    statistics.Into(out);
    for (auto& of_cameras : out->sigma.of) of_cameras.fill(1);
    return absl::OkStatus();
  }

  // How far the avatar is off in runs of these frames. `frames` count at most; `net` may be null.
  absl::Status Measure(const SparseViewAvatar& avatar, const std::vector<FrameOfTake>& from, int frames,
                       NetCorrection* net, SigmaCalibration* calibration) const {
    const std::vector<std::vector<FrameOfTake>> runs = RunsOf(from, frames);
    std::vector<SigmaCalibration> of_run(runs.size(), calibration->Empty());
    std::vector<absl::Status> status(runs.size());
    Mutex reading;
    const auto measure = [&](size_t r) {
      std::vector<std::vector<Eigen::Vector3d>> meshes;
      for (const FrameOfTake& at : runs[r]) {
        const MutexLock lock(reading);
        auto mesh = checked_.Read(at);
        status[r].Update(mesh.status());
        if (!mesh.ok()) return;
        meshes.push_back(*std::move(mesh));
      }
      const FrameOfTake& first = runs[r].front();
      const uint64_t seed = KeyOf(training_.seed, absl::StrCat("run ", first.take, " ", first.frame));
      status[r] = of_run[r].Add(avatar, meshes, seed, net);
    };
    if (net == nullptr) {
      tbb::parallel_for(size_t{0}, runs.size(), measure);
    } else {  // which keeps what it computes in
      for (size_t r = 0; r < runs.size(); ++r) measure(r);
    }
    for (size_t r = 0; r < runs.size(); ++r) {
      if (!status[r].ok()) return status[r];
      *calibration += of_run[r];
    }
    return absl::OkStatus();
  }

 private:
  const AlignmentModel& model_;
  const CheckedFrames& checked_;
  const SparseViewTraining& training_;
  std::stop_token stop_;
};

const std::string& MotionOf(const TrainingTake& take) {
  return take.motion.empty() ? take.name : take.motion;
}

// Learns without each motion in turn, from few frames, and drives what was left out: what sigma must be for
// motions that were never seen. Nothing where there is one motion only.
absl::Status CrossValidate(const std::vector<TrainingTake>& takes, const std::vector<FrameOfTake>& learnt,
                           const Learner& learner, int frames, const StageProgress& on_progress,
                           SigmaCalibration* calibration) {
  std::vector<std::string> motions;
  for (const FrameOfTake& at : learnt)
    if (std::find(motions.begin(), motions.end(), MotionOf(takes[at.take])) == motions.end())
      motions.push_back(MotionOf(takes[at.take]));
  if (motions.size() < 2) return absl::OkStatus();
  const int count = static_cast<int>(motions.size()), of_motion = (frames + count - 1) / count;
  for (int m = 0; m < count; ++m) {
    std::vector<FrameOfTake> others, left_out;
    for (const FrameOfTake& at : learnt)
      (MotionOf(takes[at.take]) == motions[m] ? left_out : others).push_back(at);
    if (others.size() < kLeastFrames) continue;
    SparseViewAvatar avatar;
    absl::Status status = learner.Learn(Thinned(others, kFoldFrames), {}, {}, &avatar);
    if (status.ok()) status = learner.Measure(avatar, left_out, of_motion, nullptr, calibration);
    if (!status.ok()) return status;
    on_progress(static_cast<double>(m + 1) / count);
  }
  return absl::OkStatus();
}

}  // namespace

int LearntFrames(const std::vector<TrainingTake>& takes, size_t take) {
  const int frames = takes[take].frames;
  if (std::any_of(takes.begin(), takes.end(), [](const TrainingTake& of) { return of.held_out; }))
    return takes[take].held_out ? 0 : frames;
  return frames - frames / kHeldOutShare;
}

absl::StatusOr<SparseViewAvatar> LearnSparseView(const Template& garment, const TrainingFrames& frames,
                                                 const SparseViewTraining& training,
                                                 const TrainingProgress& on_progress,
                                                 const std::stop_token& stop) {
  WEFT_RETURN_IF_ERROR(training.Validate());
  const Split split = SplitOf(frames.takes, training.max_frames);
  if (split.learnt.size() < kLeastFrames)
    return absl::InvalidArgumentError(absl::StrCat(
        "an avatar: ", split.learnt.size(), " frames to learn from, at least ", kLeastFrames, " are needed"));
  const auto report = [&](std::string_view stage, double share) {
    if (on_progress) on_progress(stage, share);
  };
  const CheckedFrames checked(frames, garment.rest.vertices_mm.size(), stop);
  SparseViewAvatar out;
  out.template_hash = garment.ContentHash();
  out.board_hash = garment.board_hash;
  out.fps = frames.takes.front().fps;
  out.training = training;
  out.training_frames = static_cast<int>(split.learnt.size());
  out.held_out_frames = static_cast<int>(split.held_out.size());
  const AlignmentModel model(garment);
  WEFT_RETURN_IF_ERROR(Learner(model, checked, training, stop)
                           .Learn(
                               split.learnt, [&](double share) { report("shapes", share); },
                               [&](double share) { report("lengths", share); }, &out));
  return out;
}

absl::Status CalibrateSparseView(const Template& garment, const TrainingFrames& frames,
                                 const TrainingProgress& on_progress, const std::stop_token& stop,
                                 SparseViewAvatar* avatar) {
  const SparseViewTraining& training = avatar->training;
  const Split split = SplitOf(frames.takes, training.max_frames);
  const auto report = [&](double share) {
    if (on_progress) on_progress("sigma", share);
  };
  const CheckedFrames checked(frames, garment.rest.vertices_mm.size(), stop);
  const AlignmentModel model(garment);
  const Learner learner(model, checked, training, stop);
  std::optional<NetCorrection> net;
  if (!avatar->net.empty()) {
    WEFT_ASSIGN_OR_RETURN(NetCorrection created, NetCorrection::Create(garment, model, *avatar));
    net.emplace(std::move(created));
  }
  SigmaCalibration left_out(garment, model);
  absl::Status status = CrossValidate(
      frames.takes, split.learnt, learner, training.calibration_frames,
      [&](double share) { report(0.7 * share); }, &left_out);
  std::optional<SigmaCalibration> held_out;
  const auto measure = [&](NetCorrection* by) {
    held_out.emplace(garment, model);
    status.Update(learner.Measure(*avatar, split.held_out, training.calibration_frames, by, &*held_out));
  };
  if (status.ok()) measure(net ? &*net : nullptr);
  if (status.ok() && net) {
    avatar->net.gain = held_out->gain();
    if (!avatar->net.IsOfUse()) {
      avatar->net = {.gain = avatar->net.gain};
      measure(nullptr);
    }
  }
  if (!status.ok()) return status;
  report(1);
  SigmaCalibration both = *held_out;
  both += left_out;
  avatar->sigma = both.Scales();
  avatar->held_out_check = held_out->Check(avatar->sigma);
  avatar->left_out_check = left_out.Check(avatar->sigma);
  return avatar->Validate();
}

absl::StatusOr<SparseViewAvatar> TrainSparseView(const Template& garment, const TrainingFrames& frames,
                                                 const SparseViewTraining& training,
                                                 const TrainingProgress& on_progress,
                                                 const std::stop_token& stop) {
  absl::StatusOr<SparseViewAvatar> out = LearnSparseView(garment, frames, training, on_progress, stop);
  if (!out.ok()) return out;
  WEFT_RETURN_IF_ERROR(CalibrateSparseView(garment, frames, on_progress, stop, &*out));
  return out;
}

}  // namespace weft
