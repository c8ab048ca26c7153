#include "pattern/fit/cell_equations.h"

#include <gtest/gtest.h>

#include <random>

namespace weft {
namespace {

// Without slopes and offset, where priors pull the light to.
constexpr float kGain = 0.8f;

// A rendered cell and the samples of an image that shows it in less light, moved by a small step to first
// order: (1, u, v) in u and in v.
class Shown {
 public:
  explicit Shown(const SmallVector<6>& step, bool moves_center = false) {
    std::mt19937 random(2);
    std::uniform_real_distribution<float> grey(0, 200);
    CellPrint print;
    for (auto& row : print.colors)
      for (auto& color : row)
        for (float& channel : color) channel = grey(random);
    for (float& channel : print.black) channel = 0.1f * grey(random);
    for (float& weight : print.neighbor_weights) weight = 1;
    print.along_u = &profile_.AlongU(0.2f);
    print.along_v = &profile_.AlongV(0.3f);
    print.moves_center = moves_center;
    BestCellKernels().render(print, nullptr, &model);
    CellSamples samples;
    for (int k = 0; k < kCellSide * kCellSide; ++k) {
      const int group = k / kSampleLanes, lane = k % kSampleLanes;
      const float u = CellSample(k % kCellSide), v = CellSample(k / kCellSide);
      const float along_u = step[0] + step[1] * u + step[2] * v,
                  along_v = step[3] + step[4] * u + step[5] * v;
      for (int c = 0; c < 3; ++c) {
        const float moved = model.wt[c][group][lane] + along_u * model.wtu[c][group][lane] +
                            along_v * model.wtv[c][group][lane];
        samples.value[c][group][lane] = kGain * moved / model.w[group][lane];
      }
    }
    BestCellKernels().sum(model, samples, &image);
  }

  CellModel model;
  CellImageSums image;

 private:
  const SampledProfile profile_{0.8};
};

TEST(CellEquations, LightIsWhatTheImageHas) {
  const Shown shown({});
  WindowLight light;
  CellFit fit;
  ASSERT_TRUE(light.Prepare(shown.model.sums));
  ASSERT_TRUE(light.Solve(shown.model.sums, shown.image, &fit));
  EXPECT_NEAR(fit.gain, kGain, 1e-3);
  EXPECT_NEAR(fit.offset, 0, 0.05);
  EXPECT_GT(fit.explained, 0.9999f);
}

TEST(CellEquations, AStepOfThePoseIsFound) {
  const SmallVector<6> step{0.02f, -0.01f, 0.015f, -0.03f, 0.01f, 0.02f};
  const Shown shown(step);
  WindowLight light;
  CellFit fit;
  ASSERT_TRUE(light.Prepare(shown.model.sums) && light.Solve(shown.model.sums, shown.image, &fit));
  StepEquations equations;
  equations.Prepare(shown.model.sums, light);
  SmallCholesky<6> solver;
  ASSERT_TRUE(solver.Factor(equations.Normal(fit.gain, {})));
  const SmallVector<6> solved = solver.Solve(equations.Residual(shown.image, light, fit.gain));
  for (int p = 0; p < 6; ++p) EXPECT_NEAR(solved[p], step[p], 0.003) << p;
}

TEST(CellEquations, ACenterIsPulledToWhereTheImageHasIt) {
  const Shown shown({0.02f, 0, 0, -0.03f, 0, 0}, true);
  WindowLight light;
  CellFit fit;
  ASSERT_TRUE(light.Prepare(shown.model.sums) && light.Solve(shown.model.sums, shown.image, &fit));
  const CenterEquations equations(shown.model.sums, shown.image, light, fit.gain);
  const float determinant = equations.uu * equations.vv - equations.uv * equations.uv;
  EXPECT_NEAR((equations.vv * equations.u - equations.uv * equations.v) / determinant, 0.02, 0.003);
  EXPECT_NEAR((equations.uu * equations.v - equations.uv * equations.u) / determinant, -0.03, 0.003);
}

}  // namespace
}  // namespace weft
