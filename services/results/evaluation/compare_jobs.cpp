#include "services/results/evaluation/compare_jobs.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "evaluation/mesh_difference.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/results/evaluation/frame_pieces.h"
#include "weft/v1/report.pb.h"

namespace weft {
namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

// One of the two results.
struct ComparedSide {
  EvaluationRequest request;
  EvaluationInputs inputs;
  EvaluationTools tools;
  EvaluationSum sum;
};

EvaluationRequest RequestOfB(const ComparisonRequest& request) {
  EvaluationRequest b = request.a;
  b.result = request.against, b.rig = request.against_rig, b.garment = request.against_garment;
  return b;
}

// Leaves the frames that both have, in the order of A.
absl::Status KeepCommonFrames(EvaluationInputs& a, EvaluationInputs& b,
                              std::vector<EvaluationRemark>& remarks) {
  const auto names = [](const EvaluationInputs& inputs) {
    std::set<std::string> out;
    for (const ListedFrame& frame : inputs.frames) out.insert(frame.name);
    return out;
  };
  const std::set<std::string> of_a = names(a), of_b = names(b);
  std::erase_if(a.frames, [&](const ListedFrame& frame) { return !of_b.contains(frame.name); });
  std::erase_if(b.frames, [&](const ListedFrame& frame) { return !of_a.contains(frame.name); });
  if (a.frames.empty())
    return absl::InvalidArgumentError(
        absl::StrCat(a.result, " and ", b.result, " have no frame in common; compare results of one take"));
  const size_t left_out = of_a.size() + of_b.size() - 2 * a.frames.size();
  if (left_out > 0)
    remarks.push_back(
        {"frames", absl::StrCat(left_out, left_out == 1 ? " frame" : " frames",
                                " of one result alone were left out; ", a.frames.size(), " are compared")});
  return absl::OkStatus();
}

std::string FingerprintOf(const std::string& result, const std::string& frame) {
  v1::FrameReport report;
  const absl::Status read = ReadJsonFile(FramePaths(result, frame).Of(FrameFile::kReport), report);
  return read.ok() ? report.images_fingerprint() : "";
}

// A paired test of different takes means nothing.
void CheckImages(const EvaluationInputs& a, const EvaluationInputs& b,
                 std::vector<EvaluationRemark>& remarks) {
  const std::string& frame = a.frames.front().name;
  const std::string of_a = FingerprintOf(a.result, frame), of_b = FingerprintOf(b.result, frame);
  if (of_a.empty() || of_b.empty() || of_a == of_b) return;
  remarks.push_back({"significance", absl::StrCat("the images of frame ", frame,
                                                  " are not the same in both results; pairs of frames assume "
                                                  "that they are: compare results of one take")});
}

std::vector<double> Minus(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return {};
  std::vector<double> out(a.size());
  for (size_t v = 0; v < a.size(); ++v) out[v] = a[v] - b[v];
  return out;
}

// Vertices of B in the order of A.
class VertexMatch {
 public:
  static absl::StatusOr<VertexMatch> Of(const EvaluationInputs& a, const EvaluationInputs& b,
                                        std::vector<EvaluationRemark>& remarks) {
    VertexMatch match;
    if (!a.garment || !b.garment) return match;
    if (!a.printed || !b.printed) {
      match.same_vertices_ = HaveSameFaces(*a.garment, *b.garment);
      if (!match.same_vertices_)
        remarks.push_back({"vertex differences",
                           "the garments' meshes have other faces, and no board relates their vertices"});
      return match;
    }
    if (HaveSameVertices(*a.printed, *b.printed)) return match;
    absl::StatusOr<TruthByNode> by_node = TruthByNode::Build(*a.printed, *b.printed);
    match.same_vertices_ = false;
    if (!by_node.ok()) {
      remarks.push_back({"vertex differences", "the templates have no cell of a board in common"});
      return match;
    }
    remarks.push_back({"vertex differences",
                       absl::StrCat("the templates differ; ", by_node->matched(), " of ", by_node->vertices(),
                                    " vertices of A have their board cell in B")});
    match.by_node_ = *std::move(by_node);
    return match;
  }

  bool same_vertices() const { return same_vertices_; }

  // Empty where vertices have no counterpart.
  MeshDifference Difference(const ResultMesh& a, const ResultMesh& b) const {
    const std::vector<Eigen::Vector3d>&a_mm = a.mesh.vertices_mm, &b_mm = b.mesh.vertices_mm;
    if (by_node_) return DifferenceOf(a_mm, by_node_->Positions(b_mm), {}, {});
    if (!same_vertices_ || a_mm.size() != b_mm.size()) return {};
    const bool has_sigmas = a.sigma_mm.size() == a_mm.size() && b.sigma_mm.size() == b_mm.size();
    return has_sigmas ? DifferenceOf(a_mm, b_mm, a.sigma_mm, b.sigma_mm) : DifferenceOf(a_mm, b_mm, {}, {});
  }

 private:
  bool same_vertices_ = true;
  std::optional<TruthByNode> by_node_;
};

absl::StatusOr<std::optional<ResultMesh>> MeshOf(const EvaluationInputs& inputs, const std::string& frame) {
  if (!inputs.Uses(frame)) return std::nullopt;
  absl::StatusOr<ResultMesh> mesh = ReadResultMesh(FramePaths(inputs.result, frame).Of(FrameFile::kMesh));
  if (absl::IsNotFound(mesh.status())) return std::nullopt;
  if (!mesh.ok()) return mesh.status();
  return *std::move(mesh);
}

struct ComparedFrame {
  absl::StatusOr<FrameOutcome> a, b;
  absl::StatusOr<MeshDifference> difference;
};

absl::StatusOr<MeshDifference> DifferenceInFrame(const VertexMatch& match, const EvaluationInputs& a,
                                                 const EvaluationInputs& b, const std::string& frame) {
  WEFT_ASSIGN_OR_RETURN(const std::optional<ResultMesh> of_a, MeshOf(a, frame));
  WEFT_ASSIGN_OR_RETURN(const std::optional<ResultMesh> of_b, MeshOf(b, frame));
  if (!of_a || !of_b) return MeshDifference();
  return match.Difference(*of_a, *of_b);
}

// What is summed up over the frames about both results.
class DifferenceSum {
 public:
  void Add(const VertexFields& a, const VertexFields& b, const MeshDifference& difference,
           bool same_vertices) {
    distance_.Add(difference.distance_mm);
    sigmas_.Add(difference.distance_sigmas);
    FrameDifference frame;
    std::vector<double> known_mm = difference.distance_mm;
    std::erase_if(known_mm, [](double mm) { return !std::isfinite(mm); });
    frame.distance_mm = Summarize(std::move(known_mm));
    const double share = ShareBeyondSigmas(difference.distance_sigmas);
    if (std::isfinite(share)) frame.beyond_sigmas_share = share;
    frames_.push_back(frame);
    if (!same_vertices) return;
    visibility_.Add(Minus(a.observed, b.observed));
    error_.Add(Minus(a.error_mm, b.error_mm));
    distortion_.Add(Minus(a.distortion_mm, b.distortion_mm));
    texture_drift_.Add(Minus(a.texture_drift_mm, b.texture_drift_mm));
    true_drift_.Add(Minus(a.true_drift_mm, b.true_drift_mm));
  }

  void Finish(double fps, JobComparison& out) {
    const double per_frame = fps > 0 ? fps : 1;
    out.maps.distance_mm = distance_.Mean(), out.maps.distance_sigmas = sigmas_.Mean();
    out.maps.a_minus_b = {visibility_.Mean(), error_.Mean(), distortion_.Mean(),
                          texture_drift_.Mean(per_frame), true_drift_.Mean(per_frame)};
    ErrorSummary total;
    double shares = 0, frames_with_share = 0;
    for (const FrameDifference& frame : frames_) {
      if (frame.beyond_sigmas_share) shares += *frame.beyond_sigmas_share, ++frames_with_share;
      if (!frame.distance_mm) continue;
      const auto weight = static_cast<double>(frame.distance_mm->count);
      total.count += frame.distance_mm->count;
      total.mean += weight * frame.distance_mm->mean, total.median += weight * frame.distance_mm->median;
      total.p95 += weight * frame.distance_mm->p95, total.p99 += weight * frame.distance_mm->p99;
      total.max = std::max(total.max, frame.distance_mm->max);
    }
    if (const auto count = static_cast<double>(total.count); total.count > 0) {
      total.mean /= count, total.median /= count, total.p95 /= count, total.p99 /= count;
      out.total.distance_mm = total;
    }
    if (frames_with_share > 0) out.total.beyond_sigmas_share = shares / frames_with_share;
    out.frames = std::move(frames_);
  }

 private:
  FieldMean distance_, sigmas_, visibility_, error_, distortion_, texture_drift_, true_drift_;
  std::vector<FrameDifference> frames_;
};

absl::Status Prepare(const ComparisonRequest& request, ComparedSide& a, ComparedSide& b,
                     std::vector<EvaluationRemark>& remarks) {
  a.request = request.a, b.request = RequestOfB(request);
  for (ComparedSide* side : {&a, &b}) {
    WEFT_ASSIGN_OR_RETURN(side->inputs, LoadEvaluationInputs(side->request));
  }
  WEFT_RETURN_IF_ERROR(KeepCommonFrames(a.inputs, b.inputs, remarks));
  CheckImages(a.inputs, b.inputs, remarks);
  for (ComparedSide* side : {&a, &b}) {
    WEFT_ASSIGN_OR_RETURN(side->tools, PrepareTools(side->request, side->inputs));
  }
  return absl::OkStatus();
}

// Frames in batches, which are added up in their order.
absl::Status MeasureFrames(const VertexMatch& match, ComparedSide& a, ComparedSide& b,
                           const std::function<void(size_t, size_t)>& on_frame, DifferenceSum& sum) {
  const size_t all = a.inputs.frames.size();
  const size_t batch = 2 * static_cast<size_t>(tbb::this_task_arena::max_concurrency());
  struct {
    Mutex mutex;
    size_t done ABSL_GUARDED_BY(mutex) = 0;
  } progress;
  for (size_t begin = 0; begin < all; begin += batch) {
    std::vector<ComparedFrame> frames(std::min(batch, all - begin));
    tbb::parallel_for(size_t{0}, frames.size(), [&](size_t i) {
      const std::string& name = a.inputs.frames[begin + i].name;
      frames[i] = {EvaluateFrame(a.request, a.inputs, a.tools, begin + i),
                   EvaluateFrame(b.request, b.inputs, b.tools, begin + i),
                   DifferenceInFrame(match, a.inputs, b.inputs, name)};
      const MutexLock lock(progress.mutex);
      ++progress.done;
      if (on_frame) on_frame(progress.done, all);
    });
    for (ComparedFrame& frame : frames) {
      for (const absl::Status& status : {frame.a.status(), frame.b.status(), frame.difference.status()})
        if (!status.ok()) return status;
      sum.Add(frame.a->fields, frame.b->fields, *frame.difference, match.same_vertices());
      a.sum.Add(*std::move(frame.a));
      b.sum.Add(*std::move(frame.b));
    }
  }
  return absl::OkStatus();
}

// Names what the paired tests rest on where that is little.
void ExplainTests(JobComparison& out) {
  constexpr int kFewDegreesOfFreedom = 5;
  int most = 0;
  for (const ComparedMeasure& compared : out.measures)
    if (compared.test) most = std::max(most, compared.test->degrees_of_freedom);
  if (most == 0) {
    out.remarks.push_back({"significance", "tests need four frames or more that both results have"});
  } else if (most < kFewDegreesOfFreedom) {
    out.remarks.push_back(
        {"significance", absl::StrCat("frames resemble their neighbours, so ", out.a.frames.size(),
                                      " of them leave ", most, most == 1 ? " degree" : " degrees",
                                      " of freedom; a longer take shows smaller differences")});
  }
  if (out.total.distance_mm && !out.total.beyond_sigmas_share)
    out.remarks.push_back({"differences in sigmas", "the meshes have no sigmas, or other vertices"});
}

}  // namespace

absl::Status ComparisonRequest::Validate() const {
  if (against.empty()) return absl::InvalidArgumentError("the folder of the result to compare with is empty");
  return a.Validate();
}

std::vector<ComparedMeasure> CompareMeasures(const JobEvaluation& a, const JobEvaluation& b) {
  const bool per_second = a.fps > 0 && b.fps > 0;
  std::vector<ComparedMeasure> out;
  std::vector<double> p;
  for (const EvaluationMeasure& measure : EvaluationMeasures()) {
    if (measure.better == BetterValue::kReference) continue;
    // The same motion once: per second where that is known.
    if (per_second && std::string_view(measure.unit) == "mm a frame") continue;
    ComparedMeasure compared;
    compared.measure = &measure;
    std::vector<double> differences;
    for (size_t f = 0; f < a.frames.size(); ++f) {
      const std::optional<double> of_a = measure.value(a.frames[f]), of_b = measure.value(b.frames[f]);
      const bool both = of_a && of_b && std::isfinite(*of_a) && std::isfinite(*of_b);
      differences.push_back(both ? *of_a - *of_b : kNoValue);
      if (!both) continue;
      ++compared.frames;
      compared.a += *of_a, compared.b += *of_b;
    }
    if (compared.frames == 0) continue;
    compared.a /= static_cast<double>(compared.frames), compared.b /= static_cast<double>(compared.frames);
    compared.test = TestPairs(differences);
    if (compared.test) p.push_back(compared.test->p);
    out.push_back(compared);
  }
  const std::vector<double> adjusted = HolmAdjusted(p);
  size_t next = 0;
  for (ComparedMeasure& compared : out) {
    if (!compared.test) continue;
    compared.p_adjusted = adjusted[next++];
    const bool lower = compared.test->mean < 0;
    if (compared.p_adjusted >= kSignificanceLevel) {
      compared.outcome = ComparisonOutcome::kNoDifference;
    } else if (compared.measure->better == BetterValue::kNeither) {
      compared.outcome = lower ? ComparisonOutcome::kALower : ComparisonOutcome::kAHigher;
    } else {
      compared.outcome = lower == (compared.measure->better == BetterValue::kLower)
                             ? ComparisonOutcome::kABetter
                             : ComparisonOutcome::kBBetter;
    }
  }
  return out;
}

absl::StatusOr<JobComparison> CompareJobs(const ComparisonRequest& request,
                                          const std::function<void(size_t, size_t)>& on_frame) {
  WEFT_RETURN_IF_ERROR(request.Validate());
  JobComparison out;
  ComparedSide a, b;
  WEFT_RETURN_IF_ERROR(Prepare(request, a, b, out.remarks));
  WEFT_ASSIGN_OR_RETURN(const VertexMatch match, VertexMatch::Of(a.inputs, b.inputs, out.remarks));
  DifferenceSum sum;
  WEFT_RETURN_IF_ERROR(MeasureFrames(match, a, b, on_frame, sum));
  WEFT_ASSIGN_OR_RETURN(JobEvaluation of_a, a.sum.Finish(a.request, a.inputs));
  WEFT_ASSIGN_OR_RETURN(JobEvaluation of_b, b.sum.Finish(b.request, b.inputs));
  out.a = std::move(of_a), out.b = std::move(of_b);
  out.measures = CompareMeasures(out.a, out.b);
  sum.Finish(out.a.fps, out);
  out.differences = DifferencesOf(a.inputs.job, b.inputs.job);
  ExplainTests(out);
  return out;
}

}  // namespace weft
