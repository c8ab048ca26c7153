#include "evaluation/truth_score.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace weft {
namespace {

constexpr int kRows = 5, kCols = 8, kCells = kRows * kCols, kViews = 4;
constexpr double kPitchPx = 10;

// A sheet of 1 mm cells: vertex v at cell (v / 8, v % 8), and a last vertex without a cell. Every camera sees
// every cell; those of the last row are scoreable in two views only.
FrameTruth SheetTruth() {
  FrameTruth truth;
  for (int v = 0; v < kCells; ++v) truth.mesh.vertices_mm.emplace_back(v % kCols, v / kCols, 0);
  truth.mesh.vertices_mm.emplace_back(-1, -1, 0);
  for (int view = 0; view < kViews; ++view) {
    ViewTruth out;
    out.camera_id = "c" + std::to_string(view);
    for (const NodeKind kind : {NodeKind::kCenter, NodeKind::kCorner})
      for (int v = 0; v < kCells; ++v) {
        NodeTruth node;
        node.node = {v / kCols, v % kCols, kind};
        node.vertex = kind == NodeKind::kCenter ? v : -1;
        const double shift = kind == NodeKind::kCenter ? kPitchPx / 2 : 0;
        node.pixel_px = {kPitchPx * (v % kCols) + shift + 7 * view, kPitchPx * (v / kCols) + shift};
        node.pitch_px = kPitchPx;
        node.visible = true;
        node.scoreable = v / kCols < kRows - 1 || view < 2;
        out.nodes.push_back(node);
      }
    truth.views.push_back(out);
  }
  return truth;
}

ResultPieces PerfectResult(const FrameTruth& truth) {
  ResultPieces result;
  result.observations.emplace();
  for (const ViewTruth& view : truth.views) {
    CameraObservations out;
    out.camera_id = view.camera_id;
    for (const NodeTruth& n : view.nodes)
      if (n.node.kind == NodeKind::kCenter)
        out.observations.push_back({n.pixel_px.x(), n.pixel_px.y(), n.node, 0.1f, 1});
    result.observations->push_back(out);
  }
  result.cloud.emplace();
  for (int v = 0; v < kCells; ++v) {
    CloudPoint point;
    point.node = {v / kCols, v % kCols, NodeKind::kCenter};
    point.position_mm = truth.mesh.vertices_mm[v];
    result.cloud->points.push_back(point);
  }
  result.mesh_mm = truth.mesh.vertices_mm;
  return result;
}

FrameScore ScoreOf(const FrameTruth& truth, const ResultPieces& result) {
  const absl::StatusOr<FrameScore> score = Evaluate(truth, result);
  EXPECT_TRUE(score.ok()) << score.status();
  return score.ok() ? *score : FrameScore();
}

TEST(Evaluation, PerfectResultHasPerfectScores) {
  const FrameTruth truth = SheetTruth();
  const FrameScore score = ScoreOf(truth, PerfectResult(truth));
  ASSERT_TRUE(score.centers && score.cloud && score.mesh);
  EXPECT_EQ(score.centers->observations, kViews * kCells);
  EXPECT_EQ(score.centers->scoreable, kViews * kCells - 2 * kCols);
  EXPECT_EQ(score.centers->Precision(), 1);
  EXPECT_EQ(score.centers->Recall(), 1);
  EXPECT_EQ(Summarize(score.centers->errors_px)->max, 0);
  EXPECT_EQ(score.cloud->well_seen, kCells - kCols);
  EXPECT_EQ(score.cloud->Coverage(), 1);
  EXPECT_EQ(score.mesh->visible_mm.size(), static_cast<size_t>(kCells - kCols));
  EXPECT_EQ(score.mesh->hidden_mm.size(), static_cast<size_t>(kCols + 1));
  EXPECT_EQ(Summarize(score.mesh->hidden_mm)->max, 0);
}

TEST(Evaluation, TwoSwappedIdentitiesCostTwoObservations) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  std::vector<Observation>& view = (*result.observations)[1].observations;
  std::swap(view[3].node, view[20].node);
  const FrameScore score = ScoreOf(truth, result);
  const double n = kViews * kCells;
  EXPECT_DOUBLE_EQ(*score.centers->Precision(), 1 - 2 / n);
  EXPECT_DOUBLE_EQ(*score.centers->Recall(), 1 - 2 / (n - 2 * kCols));
}

TEST(Evaluation, ObservationsAreRightWithinHalfAPitch) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  std::vector<Observation>& view = (*result.observations)[0].observations;
  view[0].x_px += 3, view[0].y_px += 3.9;  // 4.92 px
  view[1].x_px += 3, view[1].y_px += 4.1;  // 5.08 px
  const FrameScore score = ScoreOf(truth, result);
  EXPECT_EQ(score.centers->right, kViews * kCells - 1);
  EXPECT_NEAR(Summarize(score.centers->errors_px)->max, std::hypot(3, 3.9), 1e-12);
  ASSERT_EQ(score.centers->wrong_px.size(), 1u);
  EXPECT_NEAR(Summarize(score.centers->wrong_px)->max, std::hypot(3, 4.1), 1e-12);
  EXPECT_EQ(score.centers->out_of_sight, 0);
}

TEST(Evaluation, ObservationsOfCellsOutOfSightAreCountedApart) {
  FrameTruth truth = SheetTruth();
  const ResultPieces result = PerfectResult(truth);
  truth.views[1].nodes.erase(truth.views[1].nodes.begin() + 7, truth.views[1].nodes.begin() + 9);
  const FrameScore score = ScoreOf(truth, result);
  EXPECT_EQ(score.centers->out_of_sight, 2);
  EXPECT_EQ(score.centers->right, kViews * kCells - 2);
  EXPECT_TRUE(score.centers->wrong_px.empty());
}

TEST(Evaluation, OfTwoObservationsOfACellTheNearerIsRight) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  std::vector<Observation>& view = (*result.observations)[0].observations;
  Observation again = view[5];
  again.x_px += 1;
  view.push_back(again);
  const FrameScore score = ScoreOf(truth, result);
  EXPECT_EQ(score.centers->observations, kViews * kCells + 1);
  EXPECT_EQ(score.centers->right, kViews * kCells);
  EXPECT_EQ(Summarize(score.centers->errors_px)->max, 0);
  EXPECT_EQ(Summarize(score.centers->wrong_px)->max, 1);
}

TEST(Evaluation, CameraWithoutObservationsLosesItsCells) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  result.observations->pop_back();
  const FrameScore score = ScoreOf(truth, result);
  EXPECT_EQ(score.centers->Precision(), 1);
  const double scoreable = kViews * kCells - 2 * kCols;
  EXPECT_DOUBLE_EQ(*score.centers->Recall(), 1 - (kCells - kCols) / scoreable);
}

TEST(Evaluation, RecallIsToldByTheSizeOfTheCells) {
  FrameTruth truth = SheetTruth();
  std::vector<NodeTruth>& nodes = truth.views[0].nodes;
  nodes[0].pitch_px = 3, nodes[1].pitch_px = 3.99, nodes[2].pitch_px = 4, nodes[3].pitch_px = 6.9;
  ResultPieces result = PerfectResult(truth);
  (*result.observations)[0].observations.erase((*result.observations)[0].observations.begin());
  const FrameScore score = ScoreOf(truth, result);
  const auto& by_pitch = score.centers->by_pitch;
  EXPECT_EQ(by_pitch[0].scoreable, 2);
  EXPECT_EQ(by_pitch[0].found, 1);
  EXPECT_EQ(by_pitch[1].scoreable, 1);
  EXPECT_EQ(by_pitch[2].found, 1);
  EXPECT_EQ(by_pitch[3].scoreable, 0);
  EXPECT_EQ(by_pitch[4].scoreable, kViews * kCells - 2 * kCols - 4) << "10 px belong to the last class";
}

TEST(Evaluation, WellSeenVerticesFarFromTheirPlaceHaveAShare) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  (*result.mesh_mm)[2].z() += 5.1;
  (*result.mesh_mm)[kCells].z() += 20;  // not well seen
  EXPECT_DOUBLE_EQ(*ScoreOf(truth, result).mesh->FarShare(), 1.0 / (kCells - kCols));
  const std::vector<bool> seen = WellSeenVertices(truth, nullptr);
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), kCells - kCols);
  EXPECT_FALSE(seen[kCells]);
}

TEST(Evaluation, CornersAreScoredWhereThereAreAny) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  EXPECT_FALSE(ScoreOf(truth, result).corners.has_value());
  const NodeTruth& corner = truth.views[0].nodes.back();
  ASSERT_EQ(corner.node.kind, NodeKind::kCorner);
  (*result.observations)[0].observations.push_back(
      {corner.pixel_px.x(), corner.pixel_px.y() + 0.25, corner.node, 0.1f, 1});
  const FrameScore score = ScoreOf(truth, result);
  ASSERT_TRUE(score.corners.has_value());
  EXPECT_EQ(score.corners->Precision(), 1);
  EXPECT_EQ(score.corners->errors_px.values(), std::vector<double>{0.25});
  EXPECT_EQ(score.centers->observations, kViews * kCells);
}

TEST(Evaluation, ShiftOfEveryVertexIsTheError) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  for (Eigen::Vector3d& p : *result.mesh_mm) p += Eigen::Vector3d(2, -1, 2) / 3;
  for (CloudPoint& p : result.cloud->points) p.position_mm.z() += 0.5;
  const FrameScore score = ScoreOf(truth, result);
  for (const auto& errors : {score.mesh->visible_mm, score.mesh->hidden_mm}) {
    EXPECT_NEAR(Summarize(errors)->mean, 1, 1e-12);
    EXPECT_NEAR(Summarize(errors)->max, 1, 1e-12);
  }
  EXPECT_NEAR(Summarize(score.cloud->errors_mm)->median, 0.5, 1e-12);
}

TEST(Evaluation, HiddenVerticesDoNotCountAsVisible) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  (*result.mesh_mm)[kCells - 1].z() = 4;  // in the row that two cameras see well
  const FrameScore score = ScoreOf(truth, result);
  EXPECT_EQ(Summarize(score.mesh->visible_mm)->max, 0);
  EXPECT_EQ(Summarize(score.mesh->hidden_mm)->max, 4);
}

TEST(Evaluation, VerticesAreComparedWithTheirOwnPoints) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  (*result.mesh_mm)[0].z() += 2;                 // compared: its point stands
  (*result.mesh_mm)[1].z() += 7;                 // has no point
  result.cloud->points[2].position_mm.z() += 3;  // compared: its vertex stands
  (*result.mesh_mm)[kCells - 1].z() += 9;        // hidden
  result.cloud->points.erase(result.cloud->points.begin() + 1);
  const MeshScore score = *ScoreOf(truth, result).mesh;
  ASSERT_EQ(score.point_mm.size(), static_cast<size_t>(kCells - kCols - 1));
  ASSERT_EQ(score.with_point_mm.size(), score.point_mm.size());
  EXPECT_NEAR(score.with_point_mm.values()[0], 2, 1e-12);
  EXPECT_EQ(score.point_mm.values()[0], 0);
  EXPECT_NEAR(Summarize(score.with_point_mm)->max, 2, 1e-12);
  EXPECT_NEAR(Summarize(score.point_mm)->max, 3, 1e-12);
  result.cloud.reset();
  EXPECT_TRUE(ScoreOf(truth, result).mesh->point_mm.empty());
}

TEST(Evaluation, CoverageCountsPointsNearTheirVertexOnly) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  std::vector<CloudPoint>& points = result.cloud->points;
  points[0].position_mm.x() += 1.5;                // too far
  points[1].node = {100, 100, NodeKind::kCenter};  // of a cell that nobody sees
  points.erase(points.begin() + 2);
  points.back().node.kind = NodeKind::kCorner;  // not judged, and its cell is not well seen anyway
  const FrameScore score = ScoreOf(truth, result);
  EXPECT_EQ(score.cloud->points, kCells - 2);
  EXPECT_EQ(score.cloud->points_of_unseen_cells, 1);
  EXPECT_EQ(score.cloud->covered, kCells - kCols - 3);
  EXPECT_NEAR(Summarize(score.cloud->errors_mm)->max, 1.5, 1e-12);
}

TEST(Evaluation, PointOfACutCellIsNoPointOfAnUnseenOne) {
  FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  CloudPoint cut = result.cloud->points[0], unseen = cut;
  cut.node.row = 100, unseen.node.row = 101;
  result.cloud->points.push_back(cut), result.cloud->points.push_back(unseen);
  NodeTruth node = truth.views[0].nodes[0];
  node.node.row = 100, node.vertex = -1, node.visible = node.scoreable = false;
  truth.views[0].nodes.push_back(node);
  const absl::StatusOr<FrameScore> score = Evaluate(truth, result, {});
  ASSERT_TRUE(score.ok()) << score.status();
  EXPECT_EQ(score->cloud->points, kCells + 2);
  EXPECT_EQ(score->cloud->points_of_unseen_cells, 1);
  EXPECT_EQ(score->cloud->errors_mm.size(), static_cast<size_t>(kCells));
}

TEST(Evaluation, MissingPiecesAreNotZero) {
  const FrameTruth truth = SheetTruth();
  const FrameScore score = ScoreOf(truth, ResultPieces());
  EXPECT_FALSE(score.centers || score.corners || score.cloud || score.mesh);
  ResultPieces empty;
  empty.observations.emplace();
  empty.cloud.emplace();
  const FrameScore none = ScoreOf(truth, empty);
  EXPECT_FALSE(none.centers->Precision().has_value());
  EXPECT_EQ(none.centers->Recall(), 0);
  EXPECT_EQ(none.cloud->Coverage(), 0);
  EXPECT_FALSE(Summarize(none.cloud->errors_mm).has_value());
}

TEST(Evaluation, FramesAddUp) {
  const FrameTruth truth = SheetTruth();
  ResultPieces shifted = PerfectResult(truth);
  for (Eigen::Vector3d& p : *shifted.mesh_mm) p.x() += 1;
  shifted.observations.reset();
  FrameScore total = ScoreOf(truth, PerfectResult(truth));
  total += ScoreOf(truth, shifted);
  EXPECT_EQ(total.centers->observations, kViews * kCells);  // only the first frame had any
  EXPECT_EQ(total.cloud->well_seen, 2 * (kCells - kCols));
  EXPECT_NEAR(Summarize(total.mesh->visible_mm)->mean, 0.5, 1e-12);
}

TEST(Evaluation, PercentilesAreInterpolated) {
  const std::optional<ErrorSummary> s = Summarize({4, 1, 3, 2, 0});
  EXPECT_EQ(s->median, 2);
  EXPECT_NEAR(s->p95, 3.8, 1e-12);
  EXPECT_EQ(s->mean, 2);
  EXPECT_EQ(s->max, 4);
}

TEST(Evaluation, WhatDoesNotFitIsRefused) {
  const FrameTruth truth = SheetTruth();
  ResultPieces result = PerfectResult(truth);
  result.mesh_mm->pop_back();
  EXPECT_NE(Evaluate(truth, result).status().message().find("40 vertices, the truth 41"), std::string::npos);
  result = PerfectResult(truth);
  (*result.mesh_mm)[7].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(Evaluate(truth, result).status().message().find("vertex 7"), std::string::npos);
  result = PerfectResult(truth);
  (*result.observations)[0].camera_id = "other";
  EXPECT_NE(Evaluate(truth, result).status().message().find("camera other"), std::string::npos);
  result = PerfectResult(truth);
  (*result.observations)[0].camera_id = "c1";
  EXPECT_NE(Evaluate(truth, result).status().message().find("occurs twice"), std::string::npos);
}

}  // namespace
}  // namespace weft
