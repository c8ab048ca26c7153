#include "pattern/cell_kernel.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <vector>

#include "pattern/cell_frame.h"

namespace weft {
namespace {

CellLook SomeLook(const SampledProfile& profile) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> grey(0, 200);
  CellLook look;
  for (auto& row : look.colors) {
    for (auto& color : row) {
      for (float& channel : color) channel = grey(random);
    }
  }
  for (float& channel : look.black) channel = 0.1f * grey(random);
  for (float& weight : look.neighbor_weights) weight = 1;
  look.neighbor_weights[2] = 0.3f;
  look.along_u = &profile.AlongU(0.2f);
  look.along_v = &profile.AlongV(0.3f);
  return look;
}

std::vector<const CellKernels*> AllThatRunHere() {
  std::vector<const CellKernels*> kernels = {&baseline::kCellKernels};
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) kernels.push_back(&avx2::kCellKernels);
  if (&BestCellKernels() == &avx512::kCellKernels) kernels.push_back(&avx512::kCellKernels);
#endif
  return kernels;
}

TEST(CellKernels, GiveTheSameBytesOnEveryInstructionSet) {
  const SampledProfile profile(0.75);
  const CellLook look = SomeLook(profile);
  std::vector<uint8_t> pixels(4 * 40 * 30);
  std::mt19937 random(8);
  for (uint8_t& byte : pixels) byte = static_cast<uint8_t>(random());
  const CellFrame frame{20.3f, 14.6f, 5.1f, 1.3f, -0.9f, 6.2f};
  const CellBend bend{{0.2f, -0.1f}, {0.05f, 0.1f}, {-0.3f, 0.2f},
                      {0.1f, 0.3f},  {-0.2f, 0.1f}, {0.2f, -0.4f}};
  CellModel expected_model;
  CellSamples expected_samples;
  CellImageSums expected_sums;
  for (const CellKernels* kernels : AllThatRunHere()) {
    CellModel model;
    CellSamples samples;
    CellImageSums sums;
    kernels->render(look, nullptr, &model);
    kernels->sample({pixels.data(), 40, 30}, frame, bend, &samples);
    kernels->sum(model, samples, &sums);
    if (kernels == &baseline::kCellKernels) {
      expected_model = model;
      expected_samples = samples;
      expected_sums = sums;
    }
    EXPECT_EQ(std::memcmp(&model.sums, &expected_model.sums, sizeof model.sums), 0);
    EXPECT_EQ(std::memcmp(&samples, &expected_samples, sizeof samples), 0);
    EXPECT_EQ(std::memcmp(&sums, &expected_sums, sizeof sums), 0);
  }
}

TEST(CellKernels, SampleBilinearlyAndStayInTheImage) {
  // Red is x, green is y, blue is 7.
  std::vector<uint8_t> pixels(4 * 40 * 30);
  for (int k = 0; k < 40 * 30; ++k) {
    pixels[4 * k] = static_cast<uint8_t>(k % 40);
    pixels[4 * k + 1] = static_cast<uint8_t>(k / 40);
    pixels[4 * k + 2] = 7;
  }
  CellSamples samples;
  const CellFrame frame{0.5f, 15.25f, 4, 1, -1, 4};
  BestCellKernels().sample({pixels.data(), 40, 30}, frame, {}, &samples);
  for (int k = 0; k < kCellSide * kCellSide; ++k) {
    const int group = k / kSampleLanes, lane = k % kSampleLanes;
    const float u = CellSample(k % kCellSide), v = CellSample(k / kCellSide);
    EXPECT_NEAR(samples.value[0][group][lane], std::max(0.0f, 0.5f + 4 * u - v), 1e-4f);
    EXPECT_NEAR(samples.value[1][group][lane], 15.25f + u + 4 * v, 1e-4f);
    EXPECT_NEAR(samples.value[2][group][lane], 7, 1e-5f);
  }
}

}  // namespace
}  // namespace weft
