#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "pattern/decoder.h"
#include "tests/pattern/surface/rendered_surface.h"

namespace weft {
namespace {

const BoardIndex& SeedIndex() {
  static const BoardIndex index = *BoardIndex::Build(*GenerateBoard(70, 80, 3, 7));
  return index;
}
const Board& SeedBoard() { return SeedIndex().board(); }

constexpr int kPeriod = 9;

// Strips of so many columns in front of grey cloth; whole columns beyond `open` are in sight.
Frame Strips(const Photograph& photo, int columns, double open = 1e9) {
  return CoveredWhere(Render(photo, SeedBoard()), photo, SeedBoard(),
                      [&](double u, double) { return u < open && std::fmod(u, kPeriod) > columns; });
}

struct Found {
  size_t right = 0, wrong = 0, cells = 0;
};

// Cells of the strips that lie in the picture, those found, and those found elsewhere.
Found DecodeStrips(const Photograph& photo, const Frame& frame, int columns, int last_col) {
  const auto in_strip = [&](int col) { return col % kPeriod < columns && col < last_col; };
  Found found;
  for (const PlacedCell& cell : TrueCells(photo, SeedBoard(), 2)) found.cells += in_strip(cell.col);
  const DecodeResult result = *DecodeView(frame, SeedIndex(), {});
  for (const Observation& o : result.observations) {
    if (o.node.kind != NodeKind::kCenter || !in_strip(o.node.col)) continue;
    const auto [x, y] = PixelFromBoard(photo, SeedBoard(), o.node.col + 0.5, o.node.row + 0.5);
    ++(std::hypot(o.x_px - x, o.y_px - y) < 0.5 * photo.pitch_px ? found.right : found.wrong);
  }
  return found;
}

TEST(StripSeeds, ViewsOfNothingButNarrowStripsAreRead) {
  for (const int columns : {2, 3}) {
    for (const double angle_deg : {4.0, 94.0}) {
      const Photograph photo{.width_px = 300, .height_px = 260, .pitch_px = 4.5, .angle_deg = angle_deg};
      const Found found = DecodeStrips(photo, Strips(photo, columns), columns, SeedBoard().cols);
      EXPECT_GT(found.right, 0.8 * static_cast<double>(found.cells)) << columns << " columns, " << angle_deg;
      EXPECT_EQ(found.wrong, 0u);
    }
  }
}

TEST(StripSeeds, StripsBesideWhatIsKnownAreRead) {
  const Photograph photo{.width_px = 340, .height_px = 260, .pitch_px = 4.5, .angle_deg = 4};
  constexpr double kOpen = 54;
  const Found found = DecodeStrips(photo, Strips(photo, 2, kOpen), 2, static_cast<int>(kOpen) - 6);
  EXPECT_GT(found.right, 0.8 * static_cast<double>(found.cells));
  EXPECT_EQ(found.wrong, 0u);
}

TEST(StripSeeds, MirroredStripsAreNotRead) {
  const Photograph photo{
      .width_px = 300, .height_px = 260, .pitch_px = 4.5, .angle_deg = 4, .mirrored = true};
  EXPECT_TRUE(DecodeView(Strips(photo, 2), SeedIndex(), {})->observations.empty());
}

TEST(StripSeeds, OtherBoardsAreNotRead) {
  const Photograph photo{.width_px = 300, .height_px = 260, .pitch_px = 4.5, .angle_deg = 4};
  const BoardIndex other = *BoardIndex::Build(*GenerateBoard(70, 80, 3, 8));
  EXPECT_TRUE(DecodeView(Strips(photo, 2), other, {})->observations.empty());
}

}  // namespace
}  // namespace weft
