// Speed of decoding, and what it finds: a faster wrong answer must show.
#include <benchmark/benchmark.h>

#include <cmath>
#include <functional>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/stopwatch.h"
#include "pattern/decoder.h"
#include "tests/benchmark/folded_view.h"
#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

struct Score {
  size_t cells = 0, right = 0;
};

Score Assess(const Photograph& photo, const Board& board, const DecodeResult& result, double left_px,
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
  for (auto _ : state) score = Assess(photo, board, *DecodeView(frame, index, {}), 0, 0);
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
void Hessian(const cv::Mat& rgb) {
  cv::Mat grey, smooth, xx, yy, xy;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  grey.convertTo(grey, CV_32F);
  cv::GaussianBlur(grey, smooth, {9, 9}, 1.2);
  cv::Sobel(smooth, xx, CV_32F, 2, 0);
  cv::Sobel(smooth, yy, CV_32F, 0, 2);
  cv::Sobel(smooth, xy, CV_32F, 1, 1);
  cv::Mat determinant = xx.mul(yy) - xy.mul(xy);
  benchmark::DoNotOptimize(determinant.data);
}

void DemosaicAndHessian(const Frame& frame) {
  cv::setNumThreads(1);
  const cv::Mat raw(frame.height_px, frame.width_px, CV_8UC1, const_cast<uint8_t*>(frame.pixels->data()));
  cv::Mat rgb;
  cv::cvtColor(raw, rgb, cv::COLOR_BayerBG2RGB);
  Hessian(rgb);
}

void BaselineDemosaicAndHessian(benchmark::State& state) {
  for (auto _ : state) DemosaicAndHessian(TheRawView().frame);
}
BENCHMARK(BaselineDemosaicAndHessian)->Unit(benchmark::kMillisecond);

double SecondsOf(const std::function<void()>& work) {
  const Stopwatch watch;
  work();
  return watch.Seconds();
}

// A stage in ms per megapixel of the view and per 100,000 keypoints (decoded centres and corners).
void ReportStage(const char* name, double ms, double megapixels, double keypoints, benchmark::State& state) {
  state.counters[std::string(name) + "_ms/Mpx"] = ms / megapixels;
  state.counters[std::string(name) + "_ms/100k"] = 1e5 * ms / keypoints;
}

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
  const Score score = Assess(view.photo, view.board, best, RawView::kLeftPx, RawView::kTopPx);
  Report(score, megapixels, state);
  const double keypoints = static_cast<double>(std::max<size_t>(best.observations.size(), 1));
  state.counters["keypoints"] = keypoints;
  const DecodeTimings& t = best.timings;
  const std::pair<const char*, double> stages[] = {{"read", t.read_ms},
                                                   {"lattice", t.lattice_ms},
                                                   {"colors", t.colors_ms},
                                                   {"growth", t.growth_ms},
                                                   {"refinement", t.refinement_ms}};
  double all_ms = 0;
  for (const auto& [name, ms] : stages) {
    ReportStage(name, ms, megapixels, keypoints, state);
    all_ms += ms;
  }
  ReportStage("all", all_ms, megapixels, keypoints, state);
  state.counters["ratio_to_baseline"] = own_s / baseline_s;
}
BENCHMARK(DecodeRawView)->Unit(benchmark::kMillisecond);

// A soft view of deep folds, as most views of worn cloth are: cells at every angle and size, many at borders.
struct FoldedView {
  testing::TrueTake take = testing::MakeFoldedView();
  BoardIndex index = *BoardIndex::Build(take.board);

  const testing::TrueView& view() const { return take.views[0]; }
};

const FoldedView& TheFoldedView() {
  static const FoldedView folded;
  return folded;
}

cv::Mat AsMat(const Frame& rgb) {
  return {rgb.height_px, rgb.width_px, CV_8UC3, const_cast<uint8_t*>(rgb.pixels->data())};
}

void BaselineHessian(benchmark::State& state) {
  cv::setNumThreads(1);
  for (auto _ : state) Hessian(AsMat(TheFoldedView().view().image));
}
BENCHMARK(BaselineHessian)->Unit(benchmark::kMillisecond);

void DecodeFoldedView(benchmark::State& state) {
  const FoldedView& folded = TheFoldedView();
  double baseline_s = 1e9, own_s = 1e9;
  cv::setNumThreads(1);
  for (int k = 0; k < 3; ++k)
    baseline_s = std::min(baseline_s, SecondsOf([&] { Hessian(AsMat(folded.view().image)); }));
  DecodeResult result;
  for (auto _ : state)
    own_s = std::min(own_s, SecondsOf([&] { result = *DecodeView(folded.view().image, folded.index, {}); }));
  testing::DecodeScore score;
  testing::Score(result, folded.view(), &score);
  state.counters["scoreable"] = static_cast<double>(score.cells.size());
  state.counters["recall"] = score.Recall();
  state.counters["recall_3_to_4_px"] = score.Recall(3, 4);
  state.counters["precision"] = score.Precision();
  state.counters["ratio_to_baseline"] = own_s / baseline_s;
}
BENCHMARK(DecodeFoldedView)->Unit(benchmark::kMillisecond);

// Wall time of decoding the view once in each of so many threads.
double SecondsInParallel(const RawView& view, int threads) {
  return SecondsOf([&] {
    std::vector<std::jthread> running;
    for (int k = 0; k < threads; ++k)
      running.emplace_back([&] { benchmark::DoNotOptimize(DecodeView(view.frame, view.index, {})); });
  });
}

// As many views at a time as the argument says. `speedup` compares the views per second with those of one
// thread, measured in turn with them: it is the argument as far as there are idle cores.
void DecodeRawViewsInParallel(benchmark::State& state) {
  const RawView& view = TheRawView();
  const int threads = static_cast<int>(state.range(0));
  double one_s = 0, all_s = 0;
  for (auto _ : state) {
    const double seconds = SecondsInParallel(view, threads);
    state.SetIterationTime(seconds);
    all_s += seconds;
    one_s += SecondsInParallel(view, 1);
  }
  state.counters["views_per_s"] =
      benchmark::Counter(static_cast<double>(threads), benchmark::Counter::kIsIterationInvariantRate);
  state.counters["speedup"] = threads * one_s / all_s;
}
BENCHMARK(DecodeRawViewsInParallel)
    ->RangeMultiplier(2)
    ->Range(1, 8)
    ->ArgName("threads")
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
