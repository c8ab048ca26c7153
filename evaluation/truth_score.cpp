#include "evaluation/truth_score.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

std::optional<double> Ratio(int64_t part, int64_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

template <typename Score>
void AddPiece(const std::optional<Score>& from, std::optional<Score>& to) {
  if (!from) return;
  if (!to) to.emplace();
  *to += *from;
}

// In how many views each vertex's cell is scoreable, [vertices].
std::vector<int> ScoreableViews(const FrameTruth& truth) {
  std::vector<int> views(truth.mesh.vertices_mm.size(), 0);
  for (const ViewTruth& view : truth.views)
    for (const NodeTruth& node : view.nodes)
      if (node.scoreable && node.vertex >= 0) ++views[node.vertex];
  return views;
}

DecodeScore ScoreView(const ViewTruth& truth, const std::vector<Observation>& observations, NodeKind kind,
                      const EvaluationOptions& options) {
  std::map<BoardNode, const NodeTruth*> node_at;
  DecodeScore score;
  for (const NodeTruth& node : truth.nodes) {
    if (node.node.kind != kind) continue;
    node_at[node.node] = &node;
    if (!node.scoreable) continue;
    ++score.scoreable;
    ++score.by_pitch[DecodeScore::PitchClassOf(node.pitch_px)].scoreable;
  }
  std::map<BoardNode, double> nearest_px;  // of the right observations
  for (const Observation& o : observations) {
    if (o.node.kind != kind) continue;
    ++score.observations;
    const auto node = node_at.find(o.node);
    if (node == node_at.end()) {
      ++score.out_of_sight;
      continue;
    }
    const double error_px = (Eigen::Vector2d(o.x_px, o.y_px) - node->second->pixel_px).norm();
    if (!(error_px <= options.right_within_pitch * node->second->pitch_px)) {
      score.wrong_px.push_back(error_px);
      continue;
    }
    const auto [at, is_new] = nearest_px.try_emplace(o.node, error_px);
    if (is_new) continue;
    score.wrong_px.push_back(std::max(at->second, error_px));
    at->second = std::min(at->second, error_px);
  }
  score.right = static_cast<int64_t>(nearest_px.size());
  for (const auto& [node, error_px] : nearest_px) {
    if (const NodeTruth& at = *node_at.at(node); at.scoreable) {
      ++score.found;
      ++score.by_pitch[DecodeScore::PitchClassOf(at.pitch_px)].found;
    }
    score.errors_px.push_back(error_px);
  }
  return score;
}

absl::Status ScoreDecoding(const FrameTruth& truth, const std::vector<CameraObservations>& views,
                           const EvaluationOptions& options, FrameScore& score) {
  std::map<std::string_view, const std::vector<Observation>*> of_camera;
  for (const ViewTruth& view : truth.views) of_camera[view.camera_id] = nullptr;
  for (const CameraObservations& view : views) {
    const auto at = of_camera.find(view.camera_id);
    if (at == of_camera.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat("observations of camera ", view.camera_id, ", which the truth does not know"));
    }
    if (at->second)
      return absl::InvalidArgumentError(absl::StrCat("camera ", view.camera_id, " occurs twice"));
    at->second = &view.observations;
  }
  DecodeScore centers, corners;
  for (const ViewTruth& view : truth.views) {
    static const std::vector<Observation> kNoObservations;
    const std::vector<Observation>* seen = of_camera[view.camera_id];
    centers += ScoreView(view, seen ? *seen : kNoObservations, NodeKind::kCenter, options);
    corners += ScoreView(view, seen ? *seen : kNoObservations, NodeKind::kCorner, options);
  }
  score.centers = std::move(centers);
  if (corners.observations > 0) score.corners = std::move(corners);
  return absl::OkStatus();
}

// Vertices by the centres of their cells, of all cells that are in sight anywhere; -1 for cut ones.
std::map<BoardNode, int> VertexOfCenters(const FrameTruth& truth) {
  std::map<BoardNode, int> vertex_of;
  for (const ViewTruth& view : truth.views)
    for (const NodeTruth& node : view.nodes)
      if (node.node.kind == NodeKind::kCenter) vertex_of[node.node] = node.vertex;
  return vertex_of;
}

CloudScore ScoreCloud(const FrameTruth& truth, const std::vector<int>& scoreable_views, const Cloud& cloud,
                      const EvaluationOptions& options) {
  const std::map<BoardNode, int> vertex_of = VertexOfCenters(truth);
  std::set<int> near;  // vertices with a point near them
  CloudScore score;
  for (const CloudPoint& point : cloud.points) {
    if (point.node.kind != NodeKind::kCenter) continue;
    ++score.points;
    const auto vertex = vertex_of.find(point.node);
    if (vertex == vertex_of.end()) {
      ++score.points_of_unseen_cells;
      continue;
    }
    if (vertex->second < 0) continue;
    const double error_mm = (point.position_mm - truth.mesh.vertices_mm[vertex->second]).norm();
    score.errors_mm.push_back(error_mm);
    if (error_mm <= options.covered_within_mm) near.insert(vertex->second);
  }
  for (size_t v = 0; v < scoreable_views.size(); ++v) {
    if (scoreable_views[v] < options.well_seen_views) continue;
    ++score.well_seen;
    score.covered += near.contains(static_cast<int>(v)) ? 1 : 0;
  }
  return score;
}

// Errors of vertex and point where `well_seen` vertices have both.
void CompareWithPoints(const FrameTruth& truth, const ResultPieces& result,
                       const std::vector<bool>& well_seen, MeshScore& score) {
  const std::map<BoardNode, int> vertex_of = VertexOfCenters(truth);
  for (const CloudPoint& point : result.cloud->points) {
    const auto at = vertex_of.find(point.node);
    if (at == vertex_of.end() || at->second < 0 || !well_seen[at->second]) continue;
    const Eigen::Vector3d& true_mm = truth.mesh.vertices_mm[at->second];
    score.with_point_mm.push_back(((*result.mesh_mm)[at->second] - true_mm).norm());
    score.point_mm.push_back((point.position_mm - true_mm).norm());
  }
}

absl::StatusOr<MeshScore> ScoreMesh(const FrameTruth& truth, const ResultPieces& result,
                                    const std::vector<int>& views_of_truth,
                                    const EvaluationOptions& options) {
  const std::vector<Eigen::Vector3d>& mesh_mm = *result.mesh_mm;
  const TruthByNode* by_node = result.by_node;
  const size_t vertices = by_node != nullptr ? by_node->vertices() : truth.mesh.vertices_mm.size();
  if (mesh_mm.size() != vertices) {
    return absl::InvalidArgumentError(absl::StrCat("the mesh has ", mesh_mm.size(), " vertices, ",
                                                   by_node != nullptr ? "its template " : "the truth ",
                                                   vertices, "; they do not belong together"));
  }
  const std::vector<Eigen::Vector3d> true_mm =
      by_node != nullptr ? by_node->Positions(truth.mesh.vertices_mm) : truth.mesh.vertices_mm;
  const std::vector<int> scoreable_views =
      by_node != nullptr ? by_node->ScoreableViews(truth) : views_of_truth;
  MeshScore score;
  for (size_t v = 0; v < vertices; ++v) {
    if (!mesh_mm[v].allFinite())
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " of the mesh is not finite"));
    if (by_node != nullptr && !true_mm[v].allFinite()) continue;
    const double error_mm = (mesh_mm[v] - true_mm[v]).norm();
    const bool well_seen = scoreable_views[v] >= options.well_seen_views;
    (well_seen ? score.visible_mm : score.hidden_mm).push_back(error_mm);
    score.far += well_seen && error_mm > MeshScore::kFarMm ? 1 : 0;
  }
  if (result.cloud && by_node == nullptr)
    CompareWithPoints(truth, result, WellSeenVertices(truth, nullptr, options), score);
  return score;
}

}  // namespace

absl::Status EvaluationOptions::Validate() const {
  if (!(right_within_pitch > 0)) return absl::InvalidArgumentError("right_within_pitch must be positive");
  if (!(covered_within_mm > 0)) return absl::InvalidArgumentError("covered_within_mm must be positive");
  if (well_seen_views < 1) return absl::InvalidArgumentError("well_seen_views must be at least 1");
  return absl::OkStatus();
}

std::optional<double> DecodeScore::Precision() const { return Ratio(right, observations); }
std::optional<double> DecodeScore::Recall() const { return Ratio(found, scoreable); }
std::optional<double> CloudScore::Coverage() const { return Ratio(covered, well_seen); }

std::optional<double> MeshScore::FarShare() const {
  return Ratio(far, static_cast<int64_t>(visible_mm.size()));
}

size_t DecodeScore::PitchClassOf(double pitch_px) {
  const auto above = std::upper_bound(kPitchClassesPx.begin(), kPitchClassesPx.end(), pitch_px);
  return above == kPitchClassesPx.begin() ? 0 : static_cast<size_t>(above - kPitchClassesPx.begin() - 1);
}

DecodeScore& DecodeScore::operator+=(const DecodeScore& other) {
  for (size_t k = 0; k < by_pitch.size(); ++k) {
    by_pitch[k].scoreable += other.by_pitch[k].scoreable;
    by_pitch[k].found += other.by_pitch[k].found;
  }
  observations += other.observations, right += other.right, out_of_sight += other.out_of_sight;
  scoreable += other.scoreable, found += other.found;
  errors_px += other.errors_px, wrong_px += other.wrong_px;
  return *this;
}

CloudScore& CloudScore::operator+=(const CloudScore& other) {
  points += other.points, points_of_unseen_cells += other.points_of_unseen_cells;
  well_seen += other.well_seen, covered += other.covered;
  errors_mm += other.errors_mm;
  return *this;
}

MeshScore& MeshScore::operator+=(const MeshScore& other) {
  visible_mm += other.visible_mm;
  hidden_mm += other.hidden_mm;
  with_point_mm += other.with_point_mm;
  point_mm += other.point_mm;
  far += other.far;
  return *this;
}

FrameScore& FrameScore::operator+=(const FrameScore& other) {
  AddPiece(other.centers, centers);
  AddPiece(other.corners, corners);
  AddPiece(other.cloud, cloud);
  AddPiece(other.mesh, mesh);
  return *this;
}

void FrameScore::Seal() {
  for (std::optional<DecodeScore>* decoding : {&centers, &corners}) {
    if (!*decoding) continue;
    (*decoding)->errors_px.Seal();
    (*decoding)->wrong_px.Seal();
  }
  if (cloud) cloud->errors_mm.Seal();
  if (!mesh) return;
  for (ErrorTally* errors : {&mesh->visible_mm, &mesh->hidden_mm, &mesh->with_point_mm, &mesh->point_mm})
    errors->Seal();
}

std::vector<bool> WellSeenVertices(const FrameTruth& truth, const TruthByNode* by_node,
                                   const EvaluationOptions& options) {
  const std::vector<int> views = by_node != nullptr ? by_node->ScoreableViews(truth) : ScoreableViews(truth);
  std::vector<bool> out;
  out.reserve(views.size());
  for (const int seen : views) out.push_back(seen >= options.well_seen_views);
  return out;
}

absl::StatusOr<FrameScore> Evaluate(const FrameTruth& truth, const ResultPieces& result,
                                    const EvaluationOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  const std::vector<int> scoreable_views = ScoreableViews(truth);
  FrameScore score;
  if (result.observations) {
    WEFT_RETURN_IF_ERROR(ScoreDecoding(truth, *result.observations, options, score));
  }
  if (result.cloud) score.cloud = ScoreCloud(truth, scoreable_views, *result.cloud, options);
  if (result.mesh_mm) {
    WEFT_ASSIGN_OR_RETURN(MeshScore mesh, ScoreMesh(truth, result, scoreable_views, options));
    score.mesh = std::move(mesh);
  }
  return score;
}

}  // namespace weft
