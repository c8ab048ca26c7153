// Speed of decoding, and what it finds: a faster wrong answer must show.
#include <benchmark/benchmark.h>

#include "../pattern/rendered_board.h"
#include "pattern/decoder.h"

namespace weft {
namespace {

// A view full of cells of the given pitch.
void DecodePhotograph(benchmark::State& state) {
  const Board board = *GenerateBoard(160, 160, 3.0, 7);
  const BoardIndex index = *BoardIndex::Build(board);
  const Photograph photo{.width_px = 700, .height_px = 700, .pitch_px = static_cast<double>(state.range(0))};
  const Frame frame = Render(photo, board);
  size_t centers = 0, right = 0;
  for (auto _ : state) {
    const auto result = DecodeView(frame, index, {});
    centers = right = 0;
    for (const Observation& o : result->observations) {
      if (o.node.kind != NodeKind::kCenter) continue;
      const auto [x, y] = PixelFromBoard(photo, board, o.node.col + 0.5, o.node.row + 0.5);
      ++centers;
      right += std::hypot(o.x_px - x, o.y_px - y) < 0.5 * photo.pitch_px;
    }
  }
  const double megapixels = 1e-6 * photo.width_px * photo.height_px;
  state.counters["s_per_Mpx"] = benchmark::Counter(
      megapixels, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["cells"] = static_cast<double>(centers);
  state.counters["precision"] =
      static_cast<double>(right) / static_cast<double>(std::max<size_t>(centers, 1));
}
BENCHMARK(DecodePhotograph)->Arg(5)->Arg(8)->Arg(16)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
