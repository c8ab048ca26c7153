#include "services/work/animation/filmed_views.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <optional>
#include <utility>
#include <vector>

#include "base/median.h"
#include "services/work/animation/truth_views.h"
#include "tests/animation/recorded.h"
#include "tests/services/work/animation/tube_template.h"

namespace weft {
namespace {

class Filmed : public testing::Test {
 protected:
  static constexpr int kCols = 60;

  void SetUp() override {
    tube_.board_hash = board_.ContentHash();
    auto made = FilmedViews::Create(tube_, board_, BodyShape(), tube_.rest.vertices_mm, 1);
    ASSERT_TRUE(made.ok()) << made.status();
    views_.emplace(*std::move(made));
  }

  // The tube, `x_mm` aside.
  ClothFrame FrameAt(int64_t time_ns, double x_mm) const {
    ClothFrame out{time_ns, tube_.rest.vertices_mm, {}};
    for (Eigen::Vector3d& v : out.vertices_mm) v.x() += x_mm;
    return out;
  }
  std::vector<ViewObservations> LookAt(const ClothFrame& frame) const {
    const auto seen = views_->Observe({frame, frame, frame, 0}, rig_);
    EXPECT_TRUE(seen.ok()) << seen.status();
    return *seen;
  }

  Template tube_ = TubeTemplate();
  const Board board_ = *GenerateBoard(20, kCols, 6, 3);
  const Rig rig_ = *DrivingRig(2, tube_.rest.vertices_mm, 1);
  std::optional<FilmedViews> views_;
};

size_t CellsIn(const std::vector<ViewObservations>& seen) {
  size_t out = 0;
  for (const ViewObservations& view : seen)
    for (const Observation& o : view.observations) out += o.node.kind == NodeKind::kCenter ? 1 : 0;
  return out;
}

// The velocity is that of the neighbours, and the picture's exposure has its middle at the frame.
TEST_F(Filmed, CellsAreFoundWhereTheClothIsAtTheFrame) {
  const ClothFrame now = FrameAt(33'000'000, 0), before = FrameAt(0, -12), after = FrameAt(66'000'000, 12);
  const auto seen = views_->Observe({now, before, after, 1}, rig_);
  ASSERT_TRUE(seen.ok()) << seen.status();
  ASSERT_EQ(seen->size(), 2u);
  EXPECT_GT(CellsIn(*seen), 700u);
  for (size_t v = 0; v < 2; ++v) {
    EXPECT_EQ((*seen)[v].camera, static_cast<int>(v));
    std::vector<double> off_x_px, off_y_px;
    for (const Observation& o : (*seen)[v].observations) {
      if (o.node.kind != NodeKind::kCenter) continue;
      const Eigen::Vector3d& p = now.vertices_mm[static_cast<size_t>(kCols * o.node.row + o.node.col)];
      const CameraModel& camera = rig_.cameras[v];
      EXPECT_GT(Eigen::Vector3d(p.x(), 0, p.z()).dot(camera.CenterWorld() - p), 0);
      const Eigen::Vector2d off = Eigen::Vector2d(o.x_px, o.y_px) - *camera.Project(p);
      off_x_px.push_back(off.x()), off_y_px.push_back(off.y());
      EXPECT_LT(off.norm(), 2);
    }
    EXPECT_NEAR(Median(off_x_px), 0, 0.03);
    EXPECT_NEAR(Median(off_y_px), 0, 0.03);
  }
}

TEST_F(Filmed, TheSameAtAnyNumberOfThreads) {
  const ClothFrame frame = FrameAt(0, 0);
  std::vector<ViewObservations> one, three;
  tbb::task_arena(1).execute([&] { one = LookAt(frame); });
  tbb::task_arena(3).execute([&] { three = LookAt(frame); });
  for (size_t v = 0; v < 2; ++v) {
    ASSERT_EQ(one[v].observations.size(), three[v].observations.size());
    for (size_t k = 0; k < one[v].observations.size(); ++k) {
      EXPECT_EQ(one[v].observations[k].node, three[v].observations[k].node);
      EXPECT_EQ(one[v].observations[k].x_px, three[v].observations[k].x_px);
    }
  }
}

TEST_F(Filmed, TheWearerHidesCloth) {
  ClothFrame worn = FrameAt(0, 0);
  worn.pose.emplace();
  EXPECT_LT(CellsIn(LookAt(worn)), CellsIn(LookAt(FrameAt(0, 0))));
}

TEST_F(Filmed, AnotherBoardIsRefused) {
  const auto other =
      FilmedViews::Create(tube_, *GenerateBoard(20, kCols, 6, 4), BodyShape(), tube_.rest.vertices_mm, 1);
  EXPECT_EQ(other.status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(Filmed, ViewsStayAsTheyAre) {
  ClothFrame now = FrameAt(33'000'000, 0), before = FrameAt(0, -12), after = FrameAt(66'000'000, 12);
  Recorded recorded;
  for (const bool is_worn : {false, true}) {
    if (is_worn)
      for (ClothFrame* frame : {&now, &before, &after}) {
        frame->pose.emplace();
        // Behind the tube, so that cameras see both.
        frame->pose->root_mm = {0, 0, 500.0 + 1e-7 * static_cast<double>(frame->time_ns)};
      }
    const auto seen = views_->Observe({now, before, after, 3}, rig_);
    ASSERT_TRUE(seen.ok()) << seen.status();
    for (const ViewObservations& view : *seen) {
      std::vector<double> pixels;
      for (const Observation& o : view.observations) pixels.push_back(o.x_px), pixels.push_back(o.y_px);
      recorded.Add("camera " + std::to_string(view.camera), pixels);
    }
  }
  recorded.Expect();
}

}  // namespace
}  // namespace weft
