#include "services/results/evaluation/evaluate_frame.h"

#include <cmath>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/untangle/self_intersection.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "evaluation/jitter.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/synthetic/truth_file.h"
#include "services/results/evaluation/frame_pieces.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using Positions = std::vector<Eigen::Vector3d>;

// `samples` of the frames, spread evenly, all when it is 0.
std::vector<bool> Spread(size_t frames, int samples) {
  std::vector<bool> chosen(frames, samples == 0 || static_cast<size_t>(samples) >= frames);
  for (int i = 0; i < samples && !chosen.empty(); ++i) chosen[(2 * i + 1) * frames / (2 * samples)] = true;
  return chosen;
}

std::optional<ErrorSummary> SummaryWhere(const std::vector<double>& values, const std::vector<bool>& take,
                                         bool expected) {
  std::vector<double> taken;
  for (size_t v = 0; v < values.size(); ++v)
    if (std::isfinite(values[v]) && (take.empty() ? expected : take[v] == expected))
      taken.push_back(values[v]);
  return Summarize(std::move(taken));
}

Positions Difference(const Positions& a, const Positions& b) {
  Positions out(a.size());
  for (size_t v = 0; v < a.size(); ++v) out[v] = a[v] - b[v];
  return out;
}

// By the frame rate, per second; nothing where it is not known.
std::optional<ErrorSummary> PerSecond(const std::optional<ErrorSummary>& per_frame, double fps) {
  if (!per_frame || fps <= 0) return std::nullopt;
  return ErrorSummary{per_frame->count,     fps * per_frame->mean, fps * per_frame->median,
                      fps * per_frame->p95, fps * per_frame->max,  fps * per_frame->p99};
}

class FrameEvaluator {
 public:
  FrameEvaluator(const EvaluationRequest& request, const EvaluationInputs& inputs,
                 const EvaluationTools& tools, size_t index)
      : request_(request), inputs_(inputs), tools_(tools), index_(index), name_(inputs.frames[index].name) {}

  absl::StatusOr<FrameOutcome> Run() {
    out_.frame.frame = name_;
    pieces_ = NoFramePieces();
    const auto report = inputs_.reports.find(name_);
    if (inputs_.Uses(name_)) {
      WEFT_ASSIGN_OR_RETURN(
          pieces_, ReadFramePieces((fs::path(inputs_.result) / name_).string(),
                                   report != inputs_.reports.end() ? report->second : v1::FrameReport()));
    }
    if (pieces_.mesh) measured_ = pieces_.mesh->Measured();
    out_.frame.missing = pieces_.missing;
    absl::Status status = ScoreAgainstTruth();
    if (status.ok()) status = MeasureMesh();
    if (status.ok()) status = MeasureCameras();
    if (status.ok() && pieces_.mesh) status = MeasureSteps();
    if (!status.ok()) return status;
    return std::move(out_);
  }

 private:
  // The mesh of a neighbouring frame of the take; empty when there is none.
  absl::StatusOr<std::optional<ResultMesh>> Neighbor(int step) const {
    const auto at = static_cast<int64_t>(index_) + step;
    if (at < 0 || at >= static_cast<int64_t>(inputs_.frames.size())) return std::nullopt;
    const ListedFrame& other = inputs_.frames[at];
    if (other.position != inputs_.frames[index_].position + step) return std::nullopt;
    const std::string path = FramePaths(inputs_.result, other.name).Of(FrameFile::kMesh);
    if (!inputs_.Uses(other.name) || !PathExists(path)) return std::nullopt;
    WEFT_ASSIGN_OR_RETURN(ResultMesh mesh, ReadResultMesh(path));
    WEFT_RETURN_IF_ERROR(CheckSize(path, mesh.mesh.vertices_mm.size()));
    return mesh;
  }

  absl::Status CheckSize(const std::string& path, size_t vertices) const {
    const size_t expected =
        inputs_.garment ? inputs_.garment->rest.vertices_mm.size() : pieces_.mesh->mesh.vertices_mm.size();
    if (vertices == expected) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(path, ": has ", vertices, " vertices, the template ",
                                                   expected, "; they do not belong together"));
  }

  absl::StatusOr<Positions> TrueMesh(int step) const {
    WEFT_ASSIGN_OR_RETURN(
        TriangleMesh mesh,
        ReadMesh(FramePaths(inputs_.truth, inputs_.frames[index_ + step].name).Of(FrameFile::kMesh)));
    return OfResult(std::move(mesh.vertices_mm));
  }

  // True positions of the result's vertices.
  Positions OfResult(Positions of_truth_mm) const {
    return inputs_.truth_by_node ? inputs_.truth_by_node->Positions(of_truth_mm) : of_truth_mm;
  }

  // Of a take that shows several garments, where the result is of one.
  void LeaveOtherGarments(FrameTruth& truth) const {
    if (!inputs_.rows_of_garment) return;
    for (ViewTruth& view : truth.views)
      std::erase_if(view.nodes,
                    [&](const NodeTruth& seen) { return !inputs_.rows_of_garment->Contains(seen.node); });
  }

  // Whether the truth knows the vertices of the mesh.
  bool IsMeshOfTruth(const FrameTruth& truth) const {
    return pieces_.mesh &&
           (inputs_.truth_by_node || pieces_.mesh->mesh.vertices_mm.size() == truth.mesh.vertices_mm.size());
  }

  absl::Status ScoreAgainstTruth() {
    ResultPieces& pieces = pieces_.pieces;
    if (inputs_.truth.empty() || (!pieces.observations && !pieces.cloud && !pieces_.mesh))
      return absl::OkStatus();
    WEFT_ASSIGN_OR_RETURN(FrameTruth truth, ReadFrameTruth((fs::path(inputs_.truth) / name_).string()));
    LeaveOtherGarments(truth);
    const bool has_mesh = IsMeshOfTruth(truth);
    if (has_mesh) pieces.mesh_mm = pieces_.mesh->mesh.vertices_mm;
    if (inputs_.truth_by_node) pieces.by_node = &*inputs_.truth_by_node;
    absl::StatusOr<FrameScore> score = Evaluate(truth, pieces, request_.scores);
    if (!score.ok())
      return absl::Status(score.status().code(), absl::StrCat((fs::path(inputs_.result) / name_).string(),
                                                              ": ", score.status().message()));
    out_.frame.score = *std::move(score);
    if (!has_mesh) return absl::OkStatus();
    true_mm_ = OfResult(truth.mesh.vertices_mm);
    well_seen_ = WellSeenVertices(truth, pieces.by_node, request_.scores);
    for (size_t v = 0; v < true_mm_.size(); ++v)
      out_.fields.error_mm.push_back((pieces.mesh_mm->at(v) - true_mm_[v]).norm());
    return absl::OkStatus();
  }

  absl::Status MeasureMesh() {
    if (!pieces_.mesh) return absl::OkStatus();
    const TriangleMesh& mesh = pieces_.mesh->mesh;
    WEFT_RETURN_IF_ERROR(
        CheckSize(FramePaths(inputs_.result, name_).Of(FrameFile::kMesh), mesh.vertices_mm.size()));
    FrameMetrics& metrics = out_.frame.metrics;
    metrics.self_intersections =
        static_cast<int64_t>(FindSelfIntersections(mesh.vertices_mm, mesh.faces).size());
    MeasureCoverage();
    if (tools_.geodesics && tools_.measure_geodesics[index_]) {
      WEFT_ASSIGN_OR_RETURN(DistortionScore score, tools_.geodesics->Measure(mesh.vertices_mm));
      metrics.distortion_mm = score.mean_mm;
      metrics.distortion_relative = score.mean_relative;
      out_.fields.distortion_mm = std::move(score.of_vertex_mm);
    }
    return absl::OkStatus();
  }

  void MeasureCoverage() {
    const std::vector<VertexState>& state = pieces_.mesh->state;
    if (!inputs_.printed || state.empty()) return;
    int with_cell = 0, by_three = 0, by_two = 0;
    for (size_t v = 0; v < state.size(); ++v) {
      const bool has_cell = inputs_.printed->node_of_vertex[v].row >= 0;
      const bool observed = state[v] == VertexState::kObserved;
      out_.fields.observed.push_back(!has_cell ? std::nan("") : observed ? 1 : 0);
      if (!has_cell) continue;
      ++with_cell;
      by_three += observed ? 1 : 0;
      by_two += state[v] == VertexState::kTwoView ? 1 : 0;
    }
    if (with_cell == 0) return;
    out_.frame.metrics.coverage = static_cast<double>(by_three) / with_cell;
    out_.frame.metrics.two_view_share = static_cast<double>(by_two) / with_cell;
  }

  absl::Status MeasureCameras() {
    const ResultPieces& pieces = pieces_.pieces;
    if (!inputs_.rig || !pieces.observations || !pieces.cloud) return absl::OkStatus();
    std::vector<ViewObservations> views;
    for (const CameraObservations& seen : *pieces.observations) {
      const int camera = inputs_.rig->IndexOf(seen.camera_id);
      if (camera < 0)
        return absl::InvalidArgumentError(absl::StrCat((fs::path(inputs_.result) / name_).string(),
                                                       "/observations.csv: camera ", seen.camera_id,
                                                       " is not in the rig"));
      views.push_back({camera, seen.observations});
    }
    WEFT_ASSIGN_OR_RETURN(
        std::vector<CameraErrors> errors,
        MeasureCameraErrors(*inputs_.rig, std::move(views), *pieces.cloud, request_.cameras));
    CameraErrors all;
    for (const CameraErrors& camera : errors) all += camera;
    out_.frame.metrics.reprojection_px = Summarize(std::move(all.reprojection_px));
    out_.frame.metrics.left_out_px = Summarize(std::move(all.left_out_px));
    out_.cameras = std::move(errors);
    return absl::OkStatus();
  }

  absl::Status MeasureSteps() {
    WEFT_ASSIGN_OR_RETURN(const std::optional<ResultMesh> before, Neighbor(-1));
    WEFT_ASSIGN_OR_RETURN(const std::optional<ResultMesh> after, Neighbor(1));
    if (!after) return absl::OkStatus();
    const Positions &now_mm = pieces_.mesh->mesh.vertices_mm, &after_mm = after->mesh.vertices_mm;
    FrameMetrics& metrics = out_.frame.metrics;
    if (before) {
      const std::vector<double> jitter_mm = SecondDifferences(before->mesh.vertices_mm, now_mm, after_mm);
      if (!measured_.empty()) {
        metrics.jitter_observed_mm = SummaryWhere(jitter_mm, measured_, true);
        metrics.jitter_inferred_mm = SummaryWhere(jitter_mm, measured_, false);
      }
    }
    if (!true_mm_.empty()) {
      const Positions* const before_mm = before ? &before->mesh.vertices_mm : nullptr;
      WEFT_RETURN_IF_ERROR(MeasureTrueMotion(before_mm, after_mm));
    }
    if (tools_.texture && tools_.measure_texture[index_]) return MeasureTexture(now_mm, after_mm);
    return absl::OkStatus();
  }

  // `before_mm` may be null.
  absl::Status MeasureTrueMotion(const Positions* before_mm, const Positions& after_mm) {
    FrameMetrics& metrics = out_.frame.metrics;
    WEFT_ASSIGN_OR_RETURN(const Positions true_after_mm, TrueMesh(1));
    if (before_mm != nullptr) {
      WEFT_ASSIGN_OR_RETURN(const Positions true_before_mm, TrueMesh(-1));
      metrics.jitter_of_truth_mm =
          SummaryWhere(SecondDifferences(true_before_mm, true_mm_, true_after_mm), {}, true);
      // The cloth's own acceleration is in neither the error of the mesh nor its jitter.
      const Positions& now_mm = pieces_.mesh->mesh.vertices_mm;
      const std::vector<double> error_jitter_mm =
          SecondDifferences(Difference(*before_mm, true_before_mm), Difference(now_mm, true_mm_),
                            Difference(after_mm, true_after_mm));
      metrics.error_jitter_observed_mm = SummaryWhere(error_jitter_mm, measured_, true);
      if (!measured_.empty())
        metrics.error_jitter_inferred_mm = SummaryWhere(error_jitter_mm, measured_, false);
    }
    metrics.error_change_mm = SummaryWhere(
        ErrorChanges(pieces_.mesh->mesh.vertices_mm, true_mm_, after_mm, true_after_mm), well_seen_, true);
    metrics.error_change_mm_s = PerSecond(metrics.error_change_mm, inputs_.fps);
    if (!tools_.true_drift) return absl::OkStatus();
    std::vector<double> drift =
        DriftBetween(tools_.true_drift->MaterialOffsets(pieces_.mesh->mesh.vertices_mm, true_mm_),
                     tools_.true_drift->MaterialOffsets(after_mm, true_after_mm));
    metrics.true_drift_observed_mm = SummaryWhere(drift, measured_, true);
    if (!measured_.empty()) metrics.true_drift_inferred_mm = SummaryWhere(drift, measured_, false);
    metrics.true_drift_observed_mm_s = PerSecond(metrics.true_drift_observed_mm, inputs_.fps);
    metrics.true_drift_inferred_mm_s = PerSecond(metrics.true_drift_inferred_mm, inputs_.fps);
    out_.fields.true_drift_mm = std::move(drift);
    return absl::OkStatus();
  }

  absl::Status MeasureTexture(const Positions& now_mm, const Positions& after_mm) {
    const int dump_now = inputs_.frames[index_].dump_index,
              dump_after = inputs_.frames[index_ + 1].dump_index;
    if (dump_now < 0 || dump_after < 0) return absl::OkStatus();
    const std::vector<Face>& faces = inputs_.garment->rest.faces;
    const auto now = VisibleMesh::Build(now_mm, faces, tools_.cell_mm);
    const auto after = VisibleMesh::Build(after_mm, faces, tools_.cell_mm);
    if (!now.ok()) return now.status();
    if (!after.ok()) return after.status();
    WEFT_ASSIGN_OR_RETURN(const std::vector<std::vector<bool>> uncovered, UncoveredInBoth());
    const UnwrapPlan plan = tools_.texture->Plan(*inputs_.rig, *now, *after, uncovered);
    TextureDriftField field = tools_.texture->EmptyField();
    for (size_t c = 0; c < plan.of_camera.size(); ++c) {
      if (plan.of_camera[c].empty()) continue;
      const absl::StatusOr<GreyImage> image_now = Picture(dump_now, c), image_after = Picture(dump_after, c);
      if (!image_now.ok() || !image_after.ok()) continue;  // a camera that lacks a picture colours nothing
      tools_.texture->Measure(plan, static_cast<int>(c), inputs_.rig->cameras[c], now_mm, *image_now,
                              after_mm, *image_after, &field);
    }
    FrameMetrics& metrics = out_.frame.metrics;
    metrics.texture_drift_mm = SummaryWhere(field.mm, {}, true);
    metrics.texture_drift_mm_s = PerSecond(metrics.texture_drift_mm, inputs_.fps);
    if (field.tried > 0)
      metrics.texture_flow_lost = static_cast<double>(field.lost) / static_cast<double>(field.tried);
    out_.fields.texture_drift_mm = std::move(field.mm);
    return absl::OkStatus();
  }

  // [cameras][vertices], for TextureDrift::Plan, of this frame and the next.
  absl::StatusOr<std::vector<std::vector<bool>>> UncoveredInBoth() const {
    std::vector<std::vector<bool>> uncovered;
    WEFT_ASSIGN_OR_RETURN(
        const auto views_after,
        ReadCameraObservations((fs::path(inputs_.result) / inputs_.frames[index_ + 1].name).string()));
    if (!pieces_.pieces.observations || !views_after) return uncovered;
    const std::vector<VertexNode>& cells = inputs_.printed->node_of_vertex;
    uncovered.assign(inputs_.rig->cameras.size(), std::vector<bool>(cells.size(), true));
    for (const std::vector<CameraObservations>* views : {&*pieces_.pieces.observations, &*views_after}) {
      std::vector<std::vector<bool>> read(uncovered.size(), std::vector<bool>(cells.size(), false));
      for (const CameraObservations& view : *views)
        if (const int camera = inputs_.rig->IndexOf(view.camera_id); camera >= 0)
          read[camera] = ReadAround(cells, view.observations);
      for (size_t c = 0; c < read.size(); ++c)
        for (size_t v = 0; v < cells.size(); ++v) uncovered[c][v] = uncovered[c][v] && read[c][v];
    }
    return uncovered;
  }

  absl::StatusOr<GreyImage> Picture(int dump_index, size_t camera) const {
    WEFT_ASSIGN_OR_RETURN(const Frame frame, inputs_.dump->ReadView(dump_index, camera));
    return ToGrey(frame);
  }

  const EvaluationRequest& request_;
  const EvaluationInputs& inputs_;
  const EvaluationTools& tools_;
  const size_t index_;
  const std::string& name_;
  FramePieces pieces_;
  std::vector<bool> measured_;   // [vertices]; empty where states are not known
  std::vector<bool> well_seen_;  // [vertices]; empty without truth
  Positions true_mm_;
  FrameOutcome out_;
};

}  // namespace

absl::StatusOr<EvaluationTools> PrepareTools(const EvaluationRequest& request,
                                             const EvaluationInputs& inputs) {
  EvaluationTools tools;
  const size_t frames = inputs.frames.size();
  tools.measure_geodesics = Spread(frames, request.samples);
  // The last frame has no step to another one.
  tools.measure_texture = Spread(frames > 0 ? frames - 1 : 0, request.samples);
  tools.measure_texture.resize(frames, false);
  if (!inputs.garment) return tools;
  if (inputs.printed) tools.cell_mm = CellPitchMm(*inputs.printed);
  if (!inputs.truth.empty()) tools.true_drift.emplace(inputs.garment->rest);
  if (request.quick) return tools;
  WEFT_ASSIGN_OR_RETURN(GeodesicDistortion geodesics,
                        GeodesicDistortion::Build(inputs.garment->rest, request.geodesics));
  tools.geodesics = std::move(geodesics);
  if (!inputs.dump || !inputs.printed) return tools;
  WEFT_ASSIGN_OR_RETURN(TextureDrift texture, TextureDrift::Build(*inputs.printed, request.texture));
  tools.texture = std::move(texture);
  return tools;
}

absl::StatusOr<FrameOutcome> EvaluateFrame(const EvaluationRequest& request, const EvaluationInputs& inputs,
                                           const EvaluationTools& tools, size_t index) {
  return FrameEvaluator(request, inputs, tools, index).Run();
}

}  // namespace weft
