// What is written by hand beside the library's own, on one core: Arg 0 is ours, 1 the library's. `differ`
// counts the results that are not the same.
#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "pattern/fit/small_cholesky.h"
#include "pattern/image/color_image.h"

namespace weft {
namespace {

constexpr int kWidthPx = 2668, kHeightPx = 4096;

// Cells of random brightness under noise, as a Bayer mosaic.
const Frame& Mosaic() {
  static const Frame frame = [] {
    auto bytes = std::make_shared<std::vector<uint8_t>>(static_cast<size_t>(kWidthPx) * kHeightPx);
    std::mt19937 random(5);
    for (size_t i = 0; i < bytes->size(); ++i) {
      const size_t cell = i % kWidthPx / 7 + 977 * (i / kWidthPx / 7);
      (*bytes)[i] = static_cast<uint8_t>(40 + cell * 7919 % 160 + random() % 16);
    }
    Frame mosaic;
    mosaic.width_px = kWidthPx;
    mosaic.height_px = kHeightPx;
    mosaic.format = PixelFormat::kBayerRg8;
    mosaic.pixels = bytes;
    return mosaic;
  }();
  return frame;
}

const ColorImage& Colors() {
  static const ColorImage image = *ToColorImage(Mosaic());
  return image;
}

cv::Mat AsMat(const ColorImage& image) {
  return {image.height_px, image.width_px, CV_8UC4, const_cast<uint8_t*>(image.rgbx.data())};
}

// Pixels whose colours differ; the fourth byte is spare.
double Differing(const ColorImage& image, const cv::Mat& other) {
  int differ = 0;
  for (int y = 0; y < image.height_px; ++y)
    for (int x = 0; x < image.width_px; ++x)
      differ += std::memcmp(image.at(x, y), other.ptr(y, x), 3) != 0 ? 1 : 0;
  return differ;
}

void Demosaic(benchmark::State& state) {
  cv::setNumThreads(1);
  const Frame& frame = Mosaic();
  const cv::Mat raw(kHeightPx, kWidthPx, CV_8UC1, const_cast<uint8_t*>(frame.pixels->data()));
  const auto by_library = [&raw] {
    cv::Mat rgba;
    cv::cvtColor(raw, rgba, cv::COLOR_BayerBG2RGBA);
    return rgba;
  };
  for (auto _ : state) {
    if (state.range(0) == 0)
      benchmark::DoNotOptimize(ToColorImage(frame));
    else
      benchmark::DoNotOptimize(by_library());
  }
  state.counters["differ"] = Differing(Colors(), by_library());
}
BENCHMARK(Demosaic)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void Halve(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto by_library = [] {
    cv::Mat half;
    cv::resize(AsMat(Colors()), half, {kWidthPx / 2, kHeightPx / 2}, 0, 0, cv::INTER_AREA);
    return half;
  };
  for (auto _ : state) {
    if (state.range(0) == 0)
      benchmark::DoNotOptimize(HalfSize(Colors()));
    else
      benchmark::DoNotOptimize(by_library());
  }
  state.counters["differ"] = Differing(HalfSize(Colors()), by_library());
}
BENCHMARK(Halve)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

// Difference of two Gaussians of the logarithm of the brightest channel.
cv::Mat BlobContrastByLibrary(float surround_px) {
  std::vector<cv::Mat> channels;
  cv::split(AsMat(Colors()), channels);
  cv::Mat brightest = cv::max(cv::max(channels[0], channels[1]), channels[2]), light, narrow, wide;
  brightest.convertTo(light, CV_32F, 1, 10);
  cv::log(light, light);
  const auto blur = [&light](float sigma_px, cv::Mat* out) {
    const int size = 2 * static_cast<int>(std::round(2.5f * sigma_px)) + 1;
    cv::GaussianBlur(light, *out, {size, size}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
  };
  blur(0.5f, &narrow);
  blur(surround_px, &wide);
  return narrow - wide;
}

void Blur(benchmark::State& state) {
  cv::setNumThreads(1);
  constexpr float kSurroundPx = 3;
  for (auto _ : state) {
    if (state.range(0) == 0)
      benchmark::DoNotOptimize(BlobContrast(Colors(), kSurroundPx));
    else
      benchmark::DoNotOptimize(BlobContrastByLibrary(kSurroundPx));
  }
  const Plane ours = BlobContrast(Colors(), kSurroundPx);
  const cv::Mat other = BlobContrastByLibrary(kSurroundPx);
  int differ = 0;
  for (int y = 0; y < kHeightPx; ++y)
    for (int x = 0; x < kWidthPx; ++x) differ += ours.row(y)[x] != other.at<float>(y, x) ? 1 : 0;
  state.counters["differ"] = differ;
}
BENCHMARK(Blur)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

// Normal equations of a cell's pose, A = B B^T + I.
std::vector<SmallMatrix<6>> NormalEquations() {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> entry(-1, 1);
  std::vector<SmallMatrix<6>> out(1000);
  for (SmallMatrix<6>& matrix : out) {
    const Eigen::Matrix<float, 6, 6> b =
        Eigen::Matrix<float, 6, 6>::NullaryExpr([&] { return entry(random); });
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) matrix[i][j] = b.row(i).dot(b.row(j)) + (i == j ? 1.0f : 0.0f);
  }
  return out;
}

SmallVector<6> SolveByHand(const SmallMatrix<6>& matrix, const SmallVector<6>& right) {
  SmallCholesky<6> solver;
  return solver.Factor(matrix) ? solver.Solve(right) : SmallVector<6>{};
}

SmallVector<6> SolveByLibrary(const SmallMatrix<6>& matrix, const SmallVector<6>& right) {
  const Eigen::Map<const Eigen::Matrix<float, 6, 6, Eigen::RowMajor>> a(matrix[0].data());
  const Eigen::LLT<Eigen::Matrix<float, 6, 6>> solver(a);
  SmallVector<6> out = {};
  if (solver.info() == Eigen::Success)
    Eigen::Map<Eigen::Vector<float, 6>>(out.data()) =
        solver.solve(Eigen::Map<const Eigen::Vector<float, 6>>(right.data()));
  return out;
}

void SolveNormalEquations(benchmark::State& state) {
  const std::vector<SmallMatrix<6>> matrices = NormalEquations();
  const SmallVector<6> right = {1, -2, 3, -4, 5, -6};
  const auto solve = state.range(0) == 0 ? SolveByHand : SolveByLibrary;
  for (auto _ : state)
    for (const SmallMatrix<6>& matrix : matrices) benchmark::DoNotOptimize(solve(matrix, right));
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(matrices.size()));
  state.counters["differ"] =
      static_cast<double>(std::count_if(matrices.begin(), matrices.end(), [&](const auto& m) {
        return SolveByHand(m, right) != SolveByLibrary(m, right);
      }));
}
BENCHMARK(SolveNormalEquations)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace weft
