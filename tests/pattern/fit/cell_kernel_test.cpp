#include "pattern/fit/cell_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "pattern/fit/cell.h"

namespace weft {
namespace {

CellPrint SomeLook(const SampledProfile& profile) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> grey(0, 200);
  CellPrint look;
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

std::vector<const CellKernels*> CellKernelsThatRunHere() {
  std::vector<const CellKernels*> kernels = {&baseline::kCellKernels};
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) kernels.push_back(&avx2::kCellKernels);
  if (&BestCellKernels() == &avx512::kCellKernels) kernels.push_back(&avx512::kCellKernels);
#endif
  return kernels;
}

// The sums of a rendered cell, sample by sample as CellModelSums defines them. Those that a moving centre
// does not need are zero.
std::array<double, 51> PlainSums(const CellPrint& look) {
  std::array<double, 51> sums = {};
  for (int k = 0; k < kCellSide * kCellSide; ++k) {
    const int i = k / kCellSide, j = k % kCellSide, group = i / 2, lane = k % kSampleLanes;
    const double u = CellSample(j), v = CellSample(i);
    const auto cell_of = [](int n) { return n < 2 ? 0 : (n < 6 ? 1 : 2); };
    const double w = look.neighbor_weights[3 * cell_of(i) + cell_of(j)] * (1 - u * u) * (1 - v * v);
    const bool own = cell_of(i) == 1 && cell_of(j) == 1;
    const double shape = own ? look.along_u->value[2][j] * look.along_v->value[group][2][lane] : 0;
    sums[45] += w;
    sums[49] += shape;
    sums[50] += shape * shape;
    for (int c = 0; c < 3; ++c) {
      double t = look.black[c], tu = 0, tv = 0;
      for (int a = cell_of(i); a < cell_of(i) + 3; ++a) {
        for (int b = 0; b < 5; ++b) {
          const double ink = look.colors[a][b][c];
          t += ink * look.along_u->value[b][j] * look.along_v->value[group][a][lane];
          tu += ink * look.along_u->slope[b][j] * look.along_v->value[group][a][lane];
          tv += ink * look.along_u->value[b][j] * look.along_v->slope[group][a][lane];
        }
      }
      if (look.moves_center) {
        tu *= (1 - std::abs(u)) * (1 - std::abs(v));
        tv *= (1 - std::abs(u)) * (1 - std::abs(v));
      }
      const double squares[6] = {tu * tu, tu * tv, tv * tv, tu * t, tv * t, t * t}, plain[3] = {tu, tv, t};
      const double monomials[6] = {1, u, v, u * u, u * v, v * v};
      for (int q = 0; q < 6; ++q) {
        const int needed = look.moves_center ? (q < 3 ? 1 : (q < 5 ? 3 : 6)) : 6;
        for (int m = 0; m < needed; ++m) sums[6 * q + m] += w * squares[q] * monomials[m];
      }
      for (int q = 0; q < 3; ++q) {
        const int needed = look.moves_center && q < 2 ? 1 : 3;
        for (int m = 0; m < needed; ++m) sums[36 + 3 * q + m] += w * plain[q] * monomials[m];
      }
      sums[46 + c] += shape * t;
    }
  }
  return sums;
}

TEST(CellKernels, SumARenderedCellAsDefined) {
  const SampledProfile profile(0.75);
  CellPrint look = SomeLook(profile);
  for (const bool moves_center : {false, true}) {
    look.moves_center = moves_center;
    CellModel model;
    BestCellKernels().render(look, nullptr, &model);
    const auto sums = std::bit_cast<std::array<float, 51>>(model.sums);
    const std::array<double, 51> expected = PlainSums(look);
    for (int k = 0; k < 51; ++k) {
      // Terms of either sign may add up to much less than they are.
      const double scale = k < 36 ? std::max(1e5, expected[k / 6 * 6]) : 1e3;
      EXPECT_NEAR(sums[k], expected[k], 1e-5 * scale)
          << "sum " << k << (moves_center ? " of the centre" : "");
    }
  }
}

// The print in closed form: squares of 0.75 blurred by `sigma_u` and `sigma_v`, at any (u, v).
double PrintAt(const CellPrint& look, int channel, double u, double v, double sigma_u, double sigma_v) {
  const auto share = [](double d, double sigma) {
    return 0.5 * (std::erf((d + 0.375) / (sigma * M_SQRT2)) - std::erf((d - 0.375) / (sigma * M_SQRT2)));
  };
  double t = look.black[channel];
  for (int a = 0; a < 5; ++a) {
    for (int b = 0; b < 5; ++b)
      t += look.colors[a][b][channel] * share(v - (a - 2), sigma_v) * share(u - (b - 2), sigma_u);
  }
  return t;
}

TEST(CellKernels, SlopesAreThoseOfThePrintByFiniteDifferences) {
  const SampledProfile profile(0.75);
  // Blurs of the profile's table, the second of them the nearest to 0.2.
  const double sigma_u = 0.04 * std::exp(0.0677 * 18), sigma_v = 0.04 * std::exp(0.0677 * 24);
  CellPrint look = SomeLook(profile);
  look.along_u = &profile.AlongU(static_cast<float>(sigma_u));
  look.along_v = &profile.AlongV(static_cast<float>(sigma_v));
  for (const bool moves_center : {false, true}) {
    look.moves_center = moves_center;
    CellModel model;
    BestCellKernels().render(look, nullptr, &model);
    for (int k = 0; k < kCellSide * kCellSide; ++k) {
      const double u = CellSample(k % kCellSide), v = CellSample(k / kCellSide), h = 1e-4;
      const int group = k / kSampleLanes, lane = k % kSampleLanes;
      const float w = model.w[group][lane];
      ASSERT_GT(w, 0);
      // A move of the centre alone dies out linearly.
      const double tent = moves_center ? (1 - std::abs(u)) * (1 - std::abs(v)) : 1;
      for (int c = 0; c < 3; ++c) {
        const auto at = [&](double du, double dv) {
          return PrintAt(look, c, u + du, v + dv, sigma_u, sigma_v);
        };
        EXPECT_NEAR(model.wt[c][group][lane] / w, at(0, 0), 0.05);
        EXPECT_NEAR(model.wtu[c][group][lane] / w, tent * (at(h, 0) - at(-h, 0)) / (2 * h), 0.5);
        EXPECT_NEAR(model.wtv[c][group][lane] / w, tent * (at(0, h) - at(0, -h)) / (2 * h), 0.5);
      }
    }
  }
}

TEST(CellKernels, GiveTheSameBytesOnEveryInstructionSet) {
  const SampledProfile profile(0.75);
  CellPrint look = SomeLook(profile);
  std::vector<uint8_t> pixels(4 * 40 * 30);
  std::mt19937 random(8);
  for (uint8_t& byte : pixels) byte = static_cast<uint8_t>(random());
  const CellPose frame{20.3f, 14.6f, 5.1f, 1.3f, -0.9f, 6.2f};
  const CellWarp bend{{0.2f, -0.1f}, {0.05f, 0.1f}, {-0.3f, 0.2f},
                      {0.1f, 0.3f},  {-0.2f, 0.1f}, {0.2f, -0.4f}};
  for (const bool moves_center : {false, true}) {
    look.moves_center = moves_center;
    CellModel expected_model;
    CellSamples expected_samples;
    CellImageSums expected_sums;
    float expected_weights[kSampleGroups * kSampleLanes];
    for (const CellKernels* kernels : CellKernelsThatRunHere()) {
      CellModel model;
      CellSamples samples;
      CellImageSums sums;
      kernels->render(look, nullptr, &model);
      kernels->sample({pixels.data(), 40, 30}, frame, bend, &samples);
      kernels->sum(model, samples, &sums);
      const float light[4] = {0.9f, 0.05f, -0.1f, 3};
      float weights[kSampleGroups * kSampleLanes];
      kernels->trust(model, samples, light, weights);
      if (kernels == &baseline::kCellKernels) {
        expected_model = model;
        expected_samples = samples;
        expected_sums = sums;
        std::copy_n(weights, kSampleGroups * kSampleLanes, expected_weights);
      }
      EXPECT_EQ(std::memcmp(&model.sums, &expected_model.sums, sizeof model.sums), 0);
      EXPECT_EQ(std::memcmp(&samples, &expected_samples, sizeof samples), 0);
      EXPECT_EQ(std::memcmp(&sums, &expected_sums, sizeof sums), 0);
      EXPECT_EQ(std::memcmp(weights, expected_weights, sizeof weights), 0);
    }
  }
}

// Share by share in the order of the definition: the bytes of every instruction set.
TEST(CellKernels, SumColorsAsDefined) {
  constexpr int kUnknowns = kCellColors + 1, kSamples = kSampleGroups * kSampleLanes;
  const SampledProfile profile(0.75);
  std::mt19937 random(12);
  std::uniform_real_distribution<float> grey(0, 255);
  for (int round = 0; round < 20; ++round) {
    CellInks cell;
    cell.along_u = &profile.AlongU(0.1f + 0.02f * static_cast<float>(round));
    cell.along_v = &profile.AlongV(0.5f - 0.02f * static_cast<float>(round));
    for (auto& row : cell.inks)
      std::ranges::generate(row, [&] { return static_cast<int>(random() % kUnknowns); });
    std::ranges::generate(cell.weights, [&] { return random() % 4 == 0 ? 0.0f : grey(random); });
    CellSamples samples;
    double normal[kUnknowns][kUnknowns] = {}, target[3][kUnknowns] = {}, square = 0;
    for (int k = 0; k < kSamples; ++k) {
      const int m = k / kSampleLanes, lane = k % kSampleLanes;
      for (auto& channel : samples.value) channel[m][lane] = grey(random);
      double shares[kUnknowns] = {}, covered = 0;
      for (int i = 0; i < 5; ++i) {
        for (int j = 0; j < 5; ++j) {
          const float share = cell.along_v->value[m][i][lane] * cell.along_u->value[j][k % kCellSide];
          shares[cell.inks[i][j]] += share;
          covered += share;
        }
      }
      shares[kCellColors] += 1 - covered;
      const double weight = cell.weights[k];
      for (int q = 0; q < kUnknowns; ++q) {
        for (int p = q; p < kUnknowns; ++p) normal[q][p] += weight * shares[p] * shares[q];
        for (int c = 0; c < 3; ++c) target[c][q] += weight * shares[q] * samples.value[c][m][lane];
      }
      for (const auto& channel : samples.value) square += weight * channel[m][lane] * channel[m][lane];
    }
    for (const CellKernels* kernels : CellKernelsThatRunHere()) {
      CellColorSums sums;
      kernels->colors(cell, samples, &sums);
      for (int q = 0; q < kUnknowns; ++q) {
        for (int p = q; p < kUnknowns; ++p) EXPECT_EQ(sums.normal[q][p], normal[q][p]);
        for (int c = 0; c < 3; ++c) EXPECT_EQ(sums.target[c][q], target[c][q]);
      }
      EXPECT_EQ(sums.square, square);
    }
  }
}

TEST(CellKernels, TrustSamplesLikeACauchyDistributionOfTheirResiduals) {
  const SampledProfile profile(0.75);
  CellPrint look = SomeLook(profile);
  look.neighbor_weights[6] = 0;
  CellModel model;
  BestCellKernels().render(look, nullptr, &model);
  const float light[4] = {0.9f, 0.05f, -0.1f, 3};
  // The print in that light, but for some noise, and something in front of two samples.
  constexpr int kSamples = kSampleGroups * kSampleLanes, kCovered[] = {20, 21};
  std::mt19937 random(9);
  std::uniform_real_distribution<float> noise(-20, 20);
  CellSamples samples = {};
  double squared_of[kSamples], sum = 0;
  for (int k = 0; k < kSamples; ++k) {
    const int group = k / kSampleLanes, lane = k % kSampleLanes;
    const double u = CellSample(k % kCellSide), v = CellSample(k / kCellSide), w = model.w[group][lane];
    double squared = 0;
    for (int c = 0; c < 3 && w > 0; ++c) {
      const float off = noise(random) + (std::ranges::find(kCovered, k) != std::end(kCovered) ? 150 : 0);
      const double gain = light[0] + light[1] * u + light[2] * v;
      samples.value[c][group][lane] =
          static_cast<float>(gain * model.wt[c][group][lane] / w + light[3] + off);
      squared += off * off / 3;
    }
    squared_of[k] = squared;
    sum += w * squared;
  }
  const double scale2 = 2 * sum / model.sums.weight;
  ASSERT_GT(scale2, 9);
  float weights[kSamples];
  BestCellKernels().trust(model, samples, light, weights);
  for (int k = 0; k < kSamples; ++k) {
    const bool seen = model.w[k / kSampleLanes][k % kSampleLanes] > 0;
    EXPECT_NEAR(weights[k], seen ? scale2 / (scale2 + squared_of[k]) : 0, 1e-3) << k;
  }
  EXPECT_LT(weights[kCovered[0]], 0.2);
  EXPECT_EQ(weights[kSamples - kCellSide], 0);  // of a neighbour that is not in sight
  EXPECT_GT(weights[0], 0.5);
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
  const CellPose frame{0.5f, 15.25f, 4, 1, -1, 4};
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
