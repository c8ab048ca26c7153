#include "animation/shape/shape_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "alignment/placement.h"
#include "base/counter_random.h"
#include "tests/animation/recorded.h"

namespace weft {
namespace {

using testing::HasSubstr;

// A bowl of 9 x 7 points that bends, and sways more weakly, while it is carried through the room.
class SwayingBowl {
 public:
  std::vector<Eigen::Vector3d> Shape(double bend, double sway) const {
    std::vector<Eigen::Vector3d> out;
    for (int row = 0; row < 9; ++row)
      for (int col = 0; col < 7; ++col) {
        const double x = 40.0 * (col - 3), y = 50.0 * (row - 4);
        out.emplace_back(x + sway * std::sin(y / 70), y, 0.002 * x * x + bend * std::cos(x / 60) * y / 200);
      }
    return out;
  }

  double Bend(int frame) const { return 30 * NormalOf(7, static_cast<uint64_t>(frame)); }
  double Sway(int frame) const { return 8 * NormalOf(8, static_cast<uint64_t>(frame)); }

  std::vector<Eigen::Vector3d> Carried(int frame) const {
    const Eigen::Isometry3d motion = Eigen::Translation3d(900 * std::sin(frame), 50 * frame, 2000) *
                                     Eigen::AngleAxisd(0.3 * frame, Eigen::Vector3d(1, 2, -1).normalized());
    std::vector<Eigen::Vector3d> out = Shape(Bend(frame), Sway(frame));
    for (Eigen::Vector3d& p : out) p = motion * p;
    return out;
  }

  MeshFrames Frames(int count) const {
    return {count, [this](int frame) { return Carried(frame); }};
  }
};

double WorstMm(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double worst = 0;
  for (size_t v = 0; v < a.size(); ++v) worst = std::max(worst, (a[v] - b[v]).norm());
  return worst;
}

std::vector<Eigen::Vector3d> Onto(const std::vector<Eigen::Vector3d>& moved,
                                  const std::vector<Eigen::Vector3d>& fixed) {
  const Eigen::Isometry3d motion = RigidFit(moved, fixed);
  std::vector<Eigen::Vector3d> out = moved;
  for (Eigen::Vector3d& p : out) p = motion * p;
  return out;
}

TEST(ShapeSpace, LearnsTheWaysInWhichAGarmentVariesAndNotWhereItIs) {
  const SwayingBowl bowl;
  const auto space = LearnShapeSpace(bowl.Frames(80), {.components = 4});
  ASSERT_TRUE(space.ok()) << space.status();
  // Two ways, and what turning after them leaves: far less.
  EXPECT_GT(space->sigma_mm[1], 5 * space->sigma_mm[2]);
  for (int frame = 100; frame < 110; ++frame) {
    const auto shape = bowl.Shape(bowl.Bend(frame), bowl.Sway(frame));
    std::vector<Eigen::Vector3d> aligned = Onto(shape, space->Shape(Eigen::VectorXd::Zero(2)));
    const auto nearest = space->Shape(space->Project(aligned).head(2));
    EXPECT_LT(WorstMm(nearest, aligned), 3) << frame;
  }
}

TEST(ShapeSpace, HasTheVarianceOfTheFramesAsItsSigmas) {
  const SwayingBowl bowl;
  const auto space = LearnShapeSpace(bowl.Frames(60), {.components = 12});
  ASSERT_TRUE(space.ok()) << space.status();
  // Independently: all frames on the mean at once.
  const auto mean = space->Shape(Eigen::VectorXd::Zero(1));
  double variance = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const auto aligned = Onto(bowl.Carried(frame), mean);
    for (size_t v = 0; v < mean.size(); ++v) variance += (aligned[v] - mean[v]).squaredNorm() / 60;
  }
  double explained = 0;
  for (const float sigma : space->sigma_mm) explained += static_cast<double>(sigma) * sigma;
  EXPECT_NEAR(explained / variance, 1, 1e-3);
  EXPECT_LT(space->left_mm, 0.1);
  double dot = 0, norm = 0;
  for (int i = 0; i < 3 * space->vertices; ++i) {
    dot += space->basis[i] * space->basis[3 * space->vertices + i];
    norm += space->basis[i] * space->basis[i];
  }
  EXPECT_NEAR(dot, 0, 1e-5);
  EXPECT_NEAR(norm, 1, 1e-5);
}

TEST(ShapeSpace, GoesFromNumbersToShapesAndBack) {
  const SwayingBowl bowl;
  const auto space = LearnShapeSpace(bowl.Frames(40), {.components = 3});
  ASSERT_TRUE(space.ok()) << space.status();
  const Eigen::Vector3d z(0.5, -1.5, 0.25);
  EXPECT_LT((space->Project(space->Shape(z)) - z).norm(), 1e-2);
}

TEST(ShapeSpace, MakesNoMoreComponentsThanTheFramesHave) {
  const SwayingBowl bowl;
  const auto space = LearnShapeSpace(bowl.Frames(4), {.components = 48});
  ASSERT_TRUE(space.ok()) << space.status();
  EXPECT_LE(space->components(), 3);
}

TEST(ShapeSpace, RefusesFramesThatDoNotBelongTogether) {
  EXPECT_THAT(LearnShapeSpace({1, nullptr}, {}).status().message(), HasSubstr("at least two frames"));
  const SwayingBowl bowl;
  const MeshFrames mixed{5, [&](int frame) {
                           auto out = bowl.Carried(frame);
                           if (frame == 3) out.pop_back();
                           return out;
                         }};
  EXPECT_THAT(LearnShapeSpace(mixed, {}).status().message(), HasSubstr("frame 3 has 62 vertices"));
  const MeshFrames broken{5, [&](int frame) -> absl::StatusOr<std::vector<Eigen::Vector3d>> {
                            if (frame == 2) return absl::DataLossError("disk");
                            return bowl.Carried(frame);
                          }};
  EXPECT_TRUE(absl::IsDataLoss(LearnShapeSpace(broken, {}).status()));
}

TEST(ShapeSpace, StopsWhenAsked) {
  std::stop_source stop;
  const SwayingBowl bowl;
  const auto space = LearnShapeSpace(
      bowl.Frames(30), {},
      [&](double share) {
        if (share > 0.3) stop.request_stop();
      },
      stop.get_token());
  EXPECT_TRUE(absl::IsCancelled(space.status()));
}

TEST(ShapeSpace, StaysAsItIs) {
  const SwayingBowl bowl;
  Recorded recorded;
  for (const int rounds : {1, 3}) {
    const auto space = LearnShapeSpace(bowl.Frames(21), {.components = 3, .rounds = rounds, .seed = 4});
    ASSERT_TRUE(space.ok()) << space.status();
    recorded.Add("mean", space->mean_mm);
    recorded.Add("basis", space->basis);
    recorded.Add("sigma", space->sigma_mm);
    recorded.Add("left", space->left_mm);
    recorded.Add("z", space->Project(Onto(bowl.Carried(50), space->Shape(Eigen::VectorXd::Zero(1)))));
    recorded.Add("shape", space->Shape(Eigen::Vector3d(0.5, -1, 2)));
  }
  recorded.Expect();
}

TEST(ShapeSpace, TellsHowFarItIs) {
  const SwayingBowl bowl;
  std::vector<double> shares;
  // Two batches of frames in each of five passes.
  ASSERT_TRUE(LearnShapeSpace(bowl.Frames(20), {.components = 2, .rounds = 1}, [&](double share) {
                shares.push_back(share);
              }).ok());
  ASSERT_EQ(shares.size(), 10u);
  for (size_t k = 0; k < shares.size(); ++k)
    EXPECT_NEAR(shares[k], k / 2 * 0.2 + (k % 2 == 0 ? 0.16 : 0.2), 1e-9);
}

TEST(ShapeSpace, NamesTheFrameThatIsWrong) {
  const SwayingBowl bowl;
  const auto with = [&](int wrong, const Eigen::Vector3d& vertex) {
    return LearnShapeSpace({5,
                            [&, wrong](int frame) {
                              auto out = bowl.Carried(frame);
                              if (frame == wrong) out[7] = vertex;
                              return out;
                            }},
                           {.components = 2})
        .status();
  };
  EXPECT_EQ(with(3, {0, std::nan(""), 0}).message(), "shape space: frame 3 has a vertex that is not finite");
  const MeshFrames empty{2, [](int) { return std::vector<Eigen::Vector3d>(); }};
  EXPECT_EQ(LearnShapeSpace(empty, {}).status().message(), "shape space: frame 0 has no vertices");
}

}  // namespace
}  // namespace weft
