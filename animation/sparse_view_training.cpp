#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/align.h"
#include "alignment/placement.h"
#include "animation/imagined_views.h"
#include "animation/ray_driver.h"
#include "animation/sparse_view_avatar.h"
#include "base/counter_random.h"
#include "base/median.h"

namespace weft {
namespace {

// Of a take without held-out ones beside it.
constexpr int kHeldOutShare = 10;
constexpr double kLeastEdgeSpreadMm = 0.05;  // of an edge: below, cloth is as good as rigid
constexpr double kLeastLeftMm = 0.1;
constexpr double kLeastAcceleration = 1e-3;
// Frames of a run on held-out takes that are measured, after those in which tracking settles.
constexpr int kRunFrames = 8, kSettlingFrames = 3;
// Errors are within sigma, and within two, in these shares of the vertices.
constexpr double kOneSigma = 0.683, kTwoSigmas = 0.954;
constexpr size_t kFewRatios = 50;

struct FrameOfTake {
  int take, frame;
};

// What is learnt from and what is held out, in the order of the takes.
struct Split {
  std::vector<FrameOfTake> learnt, held_out;
};

Split SplitOf(const std::vector<TrainingTake>& takes, int max_frames) {
  const bool has_held_out =
      std::any_of(takes.begin(), takes.end(), [](const TrainingTake& take) { return take.held_out; });
  Split all;
  for (size_t t = 0; t < takes.size(); ++t) {
    const int last = has_held_out ? takes[t].frames : takes[t].frames - takes[t].frames / kHeldOutShare;
    for (int f = 0; f < takes[t].frames; ++f) {
      const bool held = takes[t].held_out || f >= last;
      (held ? all.held_out : all.learnt).push_back({static_cast<int>(t), f});
    }
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
    absl::StatusOr<std::vector<Eigen::Vector3d>> mesh = frames_.read(at.take, at.frame);
    if (!mesh.ok()) return mesh.status();
    const bool is_finite =
        std::all_of(mesh->begin(), mesh->end(), [](const auto& p) { return p.allFinite(); });
    if (mesh->size() == vertices_ && is_finite) return mesh;
    return absl::InvalidArgumentError(
        absl::StrCat(frames_.takes[at.take].name, ", frame ", at.frame,
                     is_finite ? absl::StrCat(": has ", mesh->size(), " vertices, the template ", vertices_)
                               : ": has a vertex that is not finite"));
  }

 private:
  const TrainingFrames& frames_;
  size_t vertices_;
  std::stop_token stop_;
};

// Lengths of edges, what the space leaves, and how z changes from frame to frame.
class Statistics {
 public:
  Statistics(const MeshGraph& graph, const ShapeSpace& space)
      : graph_(graph),
        space_(space),
        onto_(space.Shape(Eigen::VectorXd::Zero(1))),
        length_(graph.edges.size(), 0),
        square_(graph.edges.size(), 0),
        left_(graph.vertices, 0),
        acceleration_(Eigen::VectorXd::Zero(space.components())) {}

  void Add(const FrameOfTake& at, const std::vector<Eigen::Vector3d>& mesh) {
    ++frames_;
    for (size_t e = 0; e < graph_.edges.size(); ++e) {
      const double length = (mesh[graph_.edges[e].a] - mesh[graph_.edges[e].b]).norm();
      length_[e] += length, square_[e] += length * length;
    }
    const Eigen::Isometry3d motion = RigidFit(mesh, onto_);
    std::vector<Eigen::Vector3d> aligned;
    for (const Eigen::Vector3d& p : mesh) aligned.push_back(motion * p);
    const Eigen::VectorXd z = space_.Project(aligned);
    const std::vector<Eigen::Vector3d> nearest = space_.Shape(z);
    for (int v = 0; v < graph_.vertices; ++v) left_[v] += (aligned[v] - nearest[v]).squaredNorm() / 3;
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
    for (size_t e = 0; e < graph_.edges.size(); ++e) {
      const double mean = length_[e] / frames_, variance = square_[e] / frames_ - mean * mean;
      out->edge_mm.push_back(static_cast<float>(mean));
      out->edge_spread_mm.push_back(
          static_cast<float>(std::max(kLeastEdgeSpreadMm, std::sqrt(std::max(0.0, variance)))));
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
  std::vector<double> length_, square_, left_;
  Eigen::VectorXd acceleration_;
  std::vector<Eigen::VectorXd> past_;
  FrameOfTake last_{-1, -1};
  int frames_ = 0, pairs_ = 0;
};

// Errors over scale_mm, by cameras and rays.
using Ratios = std::array<std::array<std::vector<double>, SigmaScale::kRays>, SigmaScale::kCameras>;

// The factor that puts the shares of one and two sigmas right, as well as one factor can.
double FactorOf(const std::vector<double>& ratios) {
  return std::sqrt(Quantile(ratios, kOneSigma) * Quantile(ratios, kTwoSigmas) / 2);
}

SigmaScale ScalesOf(const Ratios& ratios) {
  SigmaScale out;
  for (int cameras = 0; cameras < SigmaScale::kCameras; ++cameras)
    for (int rays = 0; rays < SigmaScale::kRays; ++rays) {
      const std::vector<double>& of = ratios[cameras][rays];
      // Classes that hardly occur take what the cameras before, or the rays before, say.
      float scale = rays > 0 ? out.of[cameras][rays - 1] : 1;
      if (cameras > 0 && rays <= cameras) scale = out.of[cameras - 1][rays];
      if (of.size() >= kFewRatios) scale = static_cast<float>(std::max(1e-3, FactorOf(of)));
      out.of[cameras][rays] = scale;
    }
  return out;
}

// Drives held-out runs before imagined cameras and compares with the truth.
class Calibration {
 public:
  Calibration(const Template& garment, const AlignmentModel& model, const SparseViewAvatar& avatar)
      : garment_(garment), model_(model), avatar_(avatar) {
    for (const VertexNode& node : garment.node_of_vertex) is_node_.push_back(node.row >= 0);
    const std::vector<Eigen::Vector3d> mean = avatar.space.Shape(Eigen::VectorXd::Zero(1));
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& p : mean) spread += p * p.transpose();
    mean_ = mean;
    up_ = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
  }

  // `run` are frames that follow each other.
  absl::Status Add(const std::vector<std::vector<Eigen::Vector3d>>& run, int cameras, uint64_t seed) {
    RayDriver driver(model_, avatar_, {});
    ImaginedViews views;
    views.cameras = cameras;
    views.up = RigidFit(mean_, run.front()).linear() * up_;
    views.azimuth_deg = 360 * UniformOf(KeyOf(seed, "azimuth"), static_cast<uint64_t>(cameras));
    for (size_t f = 0; f < run.size(); ++f) {
      views.seed = KeyOf(seed, absl::StrCat("frame ", f));
      const auto rays = ImagineRays(run[f], garment_.rest.faces, is_node_, views);
      if (!rays.ok()) return rays.status();
      const auto driven = driver.Drive(1, *rays);
      if (!driven.ok()) return driven.status();
      if (f < kSettlingFrames || driven->track.lost) continue;
      for (size_t v = 0; v < run[f].size(); ++v) {
        const double error = (driven->position_mm[v] - run[f][v]).norm();
        const int rays_of = std::min(driven->rays_of_vertex[v], SigmaScale::kRays - 1);
        ratios_[cameras - 1][rays_of].push_back(error / driven->scale_mm[v]);
      }
    }
    return absl::OkStatus();
  }

  SigmaScale Scales() const { return ScalesOf(ratios_); }

 private:
  const Template& garment_;
  const AlignmentModel& model_;
  const SparseViewAvatar& avatar_;
  std::vector<bool> is_node_;
  std::vector<Eigen::Vector3d> mean_;
  Eigen::Vector3d up_;
  Ratios ratios_;
};

// Where runs begin, evenly spread over the held-out frames.
std::vector<size_t> RunsOf(const std::vector<FrameOfTake>& held_out, int frames) {
  constexpr int kLength = kRunFrames + kSettlingFrames;
  std::vector<size_t> possible;
  for (size_t i = 0; i + kLength <= held_out.size(); ++i)
    if (held_out[i].take == held_out[i + kLength - 1].take) possible.push_back(i);
  const size_t runs = std::min(possible.size(), static_cast<size_t>((frames + kRunFrames - 1) / kRunFrames));
  std::vector<size_t> out;
  for (size_t k = 0; k < runs; ++k) out.push_back(possible[k * possible.size() / runs]);
  return out;
}

}  // namespace

absl::StatusOr<SparseViewAvatar> TrainSparseView(
    const Template& garment, const TrainingFrames& frames, const SparseViewTraining& training,
    const std::function<void(std::string_view stage, double share)>& on_progress,
    const std::stop_token& stop) {
  if (absl::Status status = training.Validate(); !status.ok()) return status;
  const Split split = SplitOf(frames.takes, training.max_frames);
  if (split.learnt.size() < 10)
    return absl::InvalidArgumentError(
        absl::StrCat("an avatar: ", split.learnt.size(), " frames to learn from, at least 10 are needed"));
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
  const MeshFrames learnt{out.training_frames, [&](int frame) { return checked.Read(split.learnt[frame]); }};
  ShapeSpaceOptions space_options;
  space_options.components = training.components;
  space_options.seed = training.seed;
  absl::StatusOr<ShapeSpace> space = LearnShapeSpace(
      learnt, space_options, [&](double share) { report("shapes", share); }, stop);
  if (!space.ok()) return space.status();
  out.space = *std::move(space);
  const AlignmentModel model(garment);
  Statistics statistics(model.graph(), out.space);
  for (size_t i = 0; i < split.learnt.size(); ++i) {
    const auto mesh = checked.Read(split.learnt[i]);
    if (!mesh.ok()) return mesh.status();
    statistics.Add(split.learnt[i], *mesh);
    report("lengths", static_cast<double>(i + 1) / static_cast<double>(split.learnt.size()));
  }
  statistics.Into(&out);
  for (auto& of_cameras : out.sigma.of) of_cameras.fill(1);
  Calibration calibration(garment, model, out);
  const std::vector<size_t> runs = RunsOf(split.held_out, training.calibration_frames);
  for (size_t r = 0; r < runs.size(); ++r) {
    std::vector<std::vector<Eigen::Vector3d>> run;
    for (int f = 0; f < kRunFrames + kSettlingFrames; ++f) {
      auto mesh = checked.Read(split.held_out[runs[r] + f]);
      if (!mesh.ok()) return mesh.status();
      run.push_back(*std::move(mesh));
    }
    for (int cameras = 1; cameras <= SigmaScale::kCameras; ++cameras) {
      if (stop.stop_requested()) return absl::CancelledError("the training was stopped");
      absl::Status status = calibration.Add(run, cameras, KeyOf(training.seed, absl::StrCat("run ", r)));
      if (!status.ok()) return status;
    }
    report("sigma", static_cast<double>(r + 1) / static_cast<double>(runs.size()));
  }
  out.sigma = calibration.Scales();
  if (absl::Status status = out.Validate(); !status.ok()) return status;
  return out;
}

}  // namespace weft
