// Speed of decoding, and what it finds: a faster wrong answer must show.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>
#include <thread>
#include <vector>

#include "../pattern/rendered_board.h"
#include "pattern/decoder.h"

namespace weft {
namespace {

struct Score {
  size_t cells = 0, right = 0;
};

Score Judge(const Photograph& photo, const Board& board, const DecodeResult& result, double left_px,
            double top_px) {
  Score score;
  for (const Observation& o : result.observations) {
    if (o.node.kind != NodeKind::kCenter) continue;
    const auto [x, y] = PixelFromBoard(photo, board, o.node.col + 0.5, o.node.row + 0.5);
    ++score.cells;
    score.right += std::hypot(o.x_px - left_px - x, o.y_px - top_px - y) < 0.5 * photo.pitch_px;
  }
  return score;
}

void Report(const Score& score, double megapixels, benchmark::State& state) {
  state.counters["s_per_Mpx"] = benchmark::Counter(
      megapixels, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["cells"] = static_cast<double>(score.cells);
  state.counters["precision"] =
      static_cast<double>(score.right) / static_cast<double>(std::max<size_t>(score.cells, 1));
}

// A view full of cells of the given pitch.
void DecodePhotograph(benchmark::State& state) {
  const Board board = *GenerateBoard(160, 160, 3.0, 7);
  const BoardIndex index = *BoardIndex::Build(board);
  const Photograph photo{.width_px = 700, .height_px = 700, .pitch_px = static_cast<double>(state.range(0))};
  const Frame frame = Render(photo, board);
  Score score;
  for (auto _ : state) score = Judge(photo, board, *DecodeView(frame, index, {}), 0, 0);
  Report(score, 1e-6 * photo.width_px * photo.height_px, state);
}
BENCHMARK(DecodePhotograph)->Arg(5)->Arg(8)->Arg(16)->Unit(benchmark::kMillisecond);

// A raw frame of 2668 x 4096 px as a studio's camera delivers it: about 40,000 cells on a noisy wall.
struct RawView {
  static constexpr int kWidthPx = 2668, kHeightPx = 4096, kLeftPx = 600, kTopPx = 1200;
  Board board = *GenerateBoard(230, 230, 3.0, 7);
  BoardIndex index = *BoardIndex::Build(board);
  Photograph photo{.width_px = 1380, .height_px = 1380, .pitch_px = 6.8};
  Frame frame;

  RawView() {
    const Frame cloth = Render(photo, board);
    auto bytes = std::make_shared<std::vector<uint8_t>>(static_cast<size_t>(kWidthPx) * kHeightPx);
    std::mt19937 random(5);
    std::normal_distribution<float> noise(0, 3);
    for (int y = 0; y < kHeightPx; ++y) {
      for (int x = 0; x < kWidthPx; ++x) {
        const int channel = y % 2 + x % 2;  // red, green / green, blue
        const int cx = x - kLeftPx, cy = y - kTopPx;
        const bool on_cloth = cx >= 0 && cy >= 0 && cx < photo.width_px && cy < photo.height_px;
        const float wall = 150 + 30 * std::sin(0.004f * static_cast<float>(x)) + noise(random);
        (*bytes)[static_cast<size_t>(y) * kWidthPx + x] =
            on_cloth ? cloth.row(cy)[3 * cx + channel] : static_cast<uint8_t>(wall);
      }
    }
    frame.width_px = kWidthPx;
    frame.height_px = kHeightPx;
    frame.format = PixelFormat::kBayerRg8;
    frame.pixels = bytes;
  }
};

const RawView& TheRawView() {
  static const RawView view;
  return view;
}

// The named baseline: demosaicing, and the determinant of the Hessian of the smoothed image, by OpenCV's
// functions on one core. A detector of blobs begins like this, before any lattice or colour.
void DemosaicAndHessian(const Frame& frame) {
  cv::setNumThreads(1);
  const cv::Mat raw(frame.height_px, frame.width_px, CV_8UC1, const_cast<uint8_t*>(frame.pixels->data()));
  cv::Mat rgb, grey, smooth, xx, yy, xy;
  cv::cvtColor(raw, rgb, cv::COLOR_BayerBG2RGB);
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  grey.convertTo(grey, CV_32F);
  cv::GaussianBlur(grey, smooth, {9, 9}, 1.2);
  cv::Sobel(smooth, xx, CV_32F, 2, 0);
  cv::Sobel(smooth, yy, CV_32F, 0, 2);
  cv::Sobel(smooth, xy, CV_32F, 1, 1);
  cv::Mat determinant = xx.mul(yy) - xy.mul(xy);
  benchmark::DoNotOptimize(determinant.data);
}

void BaselineDemosaicAndHessian(benchmark::State& state) {
  for (auto _ : state) DemosaicAndHessian(TheRawView().frame);
}
BENCHMARK(BaselineDemosaicAndHessian)->Unit(benchmark::kMillisecond);

double SecondsOf(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Stages in ms per megapixel and, from the lattice on, per 100,000 cells.
void DecodeRawView(benchmark::State& state) {
  const RawView& view = TheRawView();
  const double megapixels = 1e-6 * RawView::kWidthPx * RawView::kHeightPx;
  double baseline_s = 1e9, own_s = 1e9;
  DecodeResult best;
  for (int k = 0; k < 3; ++k) {
    baseline_s = std::min(baseline_s, SecondsOf([&] { DemosaicAndHessian(view.frame); }));
  }
  for (auto _ : state) {
    DecodeResult result;
    const double seconds = SecondsOf([&] { result = *DecodeView(view.frame, view.index, {}); });
    if (seconds >= own_s) continue;
    own_s = seconds;
    best = std::move(result);
  }
  const Score score = Judge(view.photo, view.board, best, RawView::kLeftPx, RawView::kTopPx);
  Report(score, megapixels, state);
  const double per_100k = 1e5 / static_cast<double>(std::max<size_t>(score.cells, 1));
  const DecodeTimings& t = best.timings;
  state.counters["read_ms/Mpx"] = t.read_ms / megapixels;
  state.counters["lattice_ms/Mpx"] = t.lattice_ms / megapixels;
  state.counters["lattice_ms/100k"] = t.lattice_ms * per_100k;
  state.counters["colors_ms/100k"] = t.colors_ms * per_100k;
  state.counters["growth_ms/100k"] = t.growth_ms * per_100k;
  state.counters["refinement_ms/100k"] = t.refinement_ms * per_100k;
  state.counters["ratio_to_baseline"] = own_s / baseline_s;
}
BENCHMARK(DecodeRawView)->Unit(benchmark::kMillisecond);

// As many views at a time as the argument says; views per second grow with it as far as there are cores.
void DecodeRawViewsInParallel(benchmark::State& state) {
  const RawView& view = TheRawView();
  for (auto _ : state) {
    std::vector<std::jthread> threads;
    for (int k = 0; k < state.range(0); ++k)
      threads.emplace_back([&] { benchmark::DoNotOptimize(DecodeView(view.frame, view.index, {})); });
  }
  state.counters["views_per_s"] =
      benchmark::Counter(static_cast<double>(state.range(0)), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(DecodeRawViewsInParallel)
    ->RangeMultiplier(2)
    ->Range(1, 8)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
