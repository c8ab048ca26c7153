#include "services/work/animation/score_table.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace weft
