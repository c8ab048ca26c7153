#include "services/work/animation/score_table.h"

#include <gtest/gtest.h>

#include "services/formats/files/json_file.h"
#include "tests/animation/recorded.h"

namespace weft {
namespace {

void AddFrame(double off_mm, ScoreTally& to) {
  VertexRays rays(1);
  rays.Add(0, Eigen::Vector3d::UnitX());
  ASSERT_TRUE(
      to.score.Add({{Eigen::Vector3d(off_mm, 0, 0)}, {}}, {Eigen::Vector3d::Zero()}, rays, true).ok());
}

TEST(ScoreTable, RowsOfSequencesAddUpInTheirOrder) {
  ScoreTable all;
  for (const double off_mm : {1.0, 4.0}) {
    ScoreTable one;
    AddFrame(10 * off_mm, one.At("test-known", 2, "carrier"));
    ScoreTally& driven = one.At("test-known", 2, "driven");
    AddFrame(off_mm, driven);
    driven.ms.push_back(30 * off_mm), driven.ms.push_back(50);
    driven.from_registered_mm.push_back(off_mm);
    driven.at_seams_mm.push_back(off_mm);
    driven.off_seams_mm.push_back(2 * off_mm);
    Observation center, corner;
    center.node.kind = NodeKind::kCenter, corner.node.kind = NodeKind::kCorner;
    driven.AddViews({{0, {center, center, corner}}, {1, {center}}});
    one.At("test-known", 3, "driven");  // no frames
    all += one;
  }
  v1::AvatarEvaluation out;
  all.WriteTo(2, out);
  ASSERT_EQ(out.scores_size(), 2);
  const v1::AvatarScore &carrier = out.scores(0), &driven = out.scores(1);
  EXPECT_EQ(carrier.method(), "carrier");
  EXPECT_DOUBLE_EQ(carrier.mean_mm(), 25);
  EXPECT_FALSE(carrier.has_from_registered_mm());
  EXPECT_EQ(carrier.threads(), 0);
  EXPECT_EQ(driven.method(), "driven");
  EXPECT_EQ(driven.cameras(), 2);
  EXPECT_EQ(driven.frames(), 2);
  EXPECT_DOUBLE_EQ(driven.mean_mm(), 2.5);
  EXPECT_DOUBLE_EQ(driven.ms_a_frame(), 50);
  EXPECT_EQ(driven.threads(), 2);
  EXPECT_DOUBLE_EQ(driven.from_registered_mm(), 2.5);
  EXPECT_DOUBLE_EQ(driven.at_seams_mm(), 2.5);
  EXPECT_DOUBLE_EQ(driven.off_seams_mm(), 5);
  EXPECT_DOUBLE_EQ(driven.cells_a_view(), 1.5);
  EXPECT_EQ(carrier.cells_a_view(), 0);
}

// Four vertices: of no ray and far off, of one along its error, of one across it, and of two.
TEST(ScoreTable, ARowHasAllMeasures) {
  ScoreTable table;
  for (int frame = 0; frame < 5; ++frame) {
    VertexRays rays(4);
    rays.Add(1, Eigen::Vector3d::UnitX());
    rays.Add(2, Eigen::Vector3d::UnitY());
    rays.Add(3, Eigen::Vector3d::UnitX());
    rays.Add(3, Eigen::Vector3d::UnitZ());
    const double wave = frame % 2 == 0 ? 0.5 : -0.25;
    const std::vector<Eigen::Vector3d> truth = {{0, 0, 0}, {100, 0, 0}, {0, 100, 0}, {0, 0, 100}};
    const std::vector<Eigen::Vector3d> off = {{90, wave, 0}, {3 + wave, 0, 0}, {2, 0, wave}, {0, 1, 0}};
    ScoredMesh mesh{truth, {100, 2, 1.5f, 0.25f}};
    for (size_t v = 0; v < 4; ++v) mesh.vertices_mm[v] += off[v];
    ScoreTally& tally = table.At("test-known", 2, "driven");
    ASSERT_TRUE(tally.score.Add(mesh, truth, rays, frame > 0).ok());
    tally.ms.push_back(10.0 * (frame + 1));
    tally.at_seams_mm.push_back(0.5 * frame);
  }
  ScoreTally& lost = table.At("test-known", 3, "driven");
  lost.lost_frames = 2;
  table.At("test-known", 4, "driven");
  table.At("test-unseen", 2, "driven").lost_frames = 1;
  table.At("test-known", 2, "carrier").lost_frames = 4;
  table.At("test-known", 3, "driven").lost_frames += 1;
  v1::AvatarEvaluation out;
  table.WriteTo(6, out);
  ExpectRecorded(*ToJson(out, JsonZeros::kOmitted));
}

}  // namespace
}  // namespace weft
