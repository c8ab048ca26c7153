// What is no print of the board yields nothing; what can hardly be read yields little, and that right.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "pattern/decoder.h"
#include "tests/pattern/board/test_boards.h"
#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

constexpr int kSceneSidePx = 320;

using Color = std::array<double, 3>;  // 0 to 1

// The colour of each pixel, averaged over 2x2 places in it, with a little noise.
Frame DrawFrame(const std::function<Color(double, double)>& color_at) {
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, 2);
  auto bytes = std::make_shared<std::vector<uint8_t>>(3 * kSceneSidePx * kSceneSidePx);
  for (int k = 0; k < kSceneSidePx * kSceneSidePx; ++k) {
    Color sum = {};
    for (const double dx : {-0.25, 0.25}) {
      for (const double dy : {-0.25, 0.25}) {
        const Color color = color_at(k % kSceneSidePx + dx, k / kSceneSidePx + dy);
        for (int c = 0; c < 3; ++c) sum[c] += color[c] / 4;
      }
    }
    for (int c = 0; c < 3; ++c) {
      (*bytes)[3 * k + c] =
          static_cast<uint8_t>(std::clamp(std::lround(230 * sum[c] + noise(random)), 0L, 255L));
    }
  }
  Frame frame;
  frame.width_px = frame.height_px = kSceneSidePx;
  frame.format = PixelFormat::kRgb8;
  frame.pixels = bytes;
  return frame;
}

// A number in [0, 1) for a pair of whole numbers.
double Hash(int x, int y, int salt) {
  uint32_t h = static_cast<uint32_t>(x) * 0x9e3779b1u ^ static_cast<uint32_t>(y) * 0x85ebca6bu ^
               static_cast<uint32_t>(salt) * 0xc2b2ae35u;
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h = (h ^ (h >> 12)) * 0x297a2d39u;
  return (h ^ (h >> 15)) / 4294967296.0;
}

// Squares of the seven colours between dark lines, as on a board, drawn at random or by `ink`.
Color Cells(double x, double y, double pitch_px, double angle, const std::function<int(int, int)>& ink) {
  const double u = (std::cos(angle) * x + std::sin(angle) * y) / pitch_px;
  const double v = (-std::sin(angle) * x + std::cos(angle) * y) / pitch_px;
  const int col = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
  if (std::max(std::abs(u - col - 0.5), std::abs(v - row - 0.5)) > 0.375) return {0.1, 0.1, 0.1};
  const auto rgb = CellColorRgb(static_cast<CellColor>(ink(row, col)));
  return {rgb[0] / 255.0, rgb[1] / 255.0, rgb[2] / 255.0};
}

int RandomInk(int row, int col) { return static_cast<int>(7 * Hash(row, col, 1)); }

// Smooth noise of one octave.
double Value(double x, double y, int salt) {
  const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
  const double fx = x - i, fy = y - j;
  return (1 - fy) * ((1 - fx) * Hash(i, j, salt) + fx * Hash(i + 1, j, salt)) +
         fy * ((1 - fx) * Hash(i, j + 1, salt) + fx * Hash(i + 1, j + 1, salt));
}

struct EmptyScene {
  const char* name;
  std::function<Color(double, double)> color_at;
};
void PrintTo(const EmptyScene& c, std::ostream* out) { *out << c.name; }

class ImagesWithoutTheBoard : public testing::TestWithParam<EmptyScene> {};

TEST_P(ImagesWithoutTheBoard, YieldNoNode) {
  const auto result = DecodeView(DrawFrame(GetParam().color_at), TestBoard(), {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(result->observations, testing::IsEmpty());
  for (const PatchReport& patch : result->patches) EXPECT_EQ(patch.accepted, patch.reason.empty());
}

Color Plaid(double x, double y) {
  const auto stripe = [](double t, double period) { return 0.5 + 0.5 * std::cos(2 * M_PI * t / period); };
  return {0.2 + 0.7 * stripe(x, 9) * stripe(y, 9), 0.2 + 0.5 * stripe(x + 3, 13), 0.2 + 0.6 * stripe(y, 7)};
}

Color Checks(double x, double y) {
  const bool odd = (static_cast<int>(x / 6) + static_cast<int>(y / 6)) % 2 != 0;
  return odd ? Color{0.9, 0.9, 0.85} : Color{0.1, 0.1, 0.3};
}

Color Tiles(double x, double y) {
  return Cells(x, y, 8, 0.1, [](int row, int col) { return (row + 2 * col) % 7; });
}

// Lines of dark strokes on a coloured background.
Color Text(double x, double y) {
  const int line = static_cast<int>(y / 11), column = static_cast<int>(x / 6);
  const double in_x = x / 6 - column, in_y = y / 11 - line;
  const bool gap = in_y > 0.75 || in_x > 0.8 || Hash(column, line, 2) < 0.15;
  const bool stroke =
      !gap && Hash(4 * column + static_cast<int>(4 * in_x), 5 * line + static_cast<int>(5 * in_y), 3) < 0.5;
  return stroke ? Color{0.1, 0.1, 0.1} : Color{0.95, 0.95, 0.9};
}

// A screen's red, green and blue stripes behind a picture.
Color Screen(double x, double y) {
  Color color = {};
  color[static_cast<int>(x / 2) % 3] =
      static_cast<int>(y) % 6 < 5 ? 0.4 + 0.6 * Value(x / 30, y / 30, 4) : 0.05;
  return color;
}

Color Weave(double x, double y) {
  const double thread = std::sin(x * 1.1) * std::sin(y * 1.1);
  return {0.5 + 0.3 * thread + 0.1 * Value(x / 4, y / 4, 5), 0.45 + 0.3 * thread, 0.4 + 0.3 * thread};
}

Color Clouds(double x, double y) {
  Color color = {};
  for (int c = 0; c < 3; ++c) {
    for (int octave = 0; octave < 6; ++octave) {
      color[c] += 0.5 * std::pow(0.7, octave) *
                  Value(std::ldexp(x, octave) / 64, std::ldexp(y, octave) / 64, 10 * c + octave);
    }
  }
  return color;
}

Color Speckle(double x, double y) {
  const int i = static_cast<int>(std::floor(x + 0.5)), j = static_cast<int>(std::floor(y + 0.5));
  return {Hash(i, j, 6), Hash(i, j, 7), Hash(i, j, 8)};
}

// Checks of several colours between dark lines, as on shirts.
Color Madras(double x, double y) {
  const double u = (x + 0.2 * y) / 7, v = (y - 0.2 * x) / 7;
  const int col = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
  const bool line = u - col < 0.2 || v - row < 0.2;
  if (line) return {0.15, 0.1, 0.2};
  Color color;
  for (int c = 0; c < 3; ++c) color[c] = 0.3 + 0.35 * (Hash(col % 5, c, 20) + Hash(row % 4, c, 21));
  return color;
}

// Coloured letters on a dark screen.
Color TextOnAScreen(double x, double y) {
  const int line = static_cast<int>(y / 12), column = static_cast<int>(x / 7);
  const Color letters = Text(x * 6 / 7, y * 11 / 12);
  const double lit = 1 - letters[0];
  return {lit * (0.3 + 0.7 * Hash(column / 4, line, 30)), lit * (0.3 + 0.7 * Hash(column / 4, line, 31)),
          lit * (0.3 + 0.7 * Hash(column / 4, line, 32))};
}

// Bright pieces of any shape between dark lead.
Color StainedGlass(double x, double y) {
  constexpr double kSize = 8;
  const int i = static_cast<int>(std::floor(x / kSize)), j = static_cast<int>(std::floor(y / kSize));
  double nearest = 1e9, second = 1e9;
  int piece = 0;
  for (int k = 0; k < 9; ++k) {
    const int a = i + k % 3 - 1, b = j + k / 3 - 1;
    const double distance = std::hypot(x - kSize * (a + Hash(a, b, 40)), y - kSize * (b + Hash(a, b, 41)));
    if (distance < nearest) {
      second = nearest;
      nearest = distance;
      piece = 1000 * a + b;
    } else {
      second = std::min(second, distance);
    }
  }
  if (second - nearest < 1.5) return {0.1, 0.1, 0.1};
  const auto rgb = CellColorRgb(static_cast<CellColor>(7 * Hash(piece, 0, 42)));
  return {rgb[0] / 255.0, rgb[1] / 255.0, rgb[2] / 255.0};
}

// Cells as on a board in colours that no board has.
Color PastelCells(double x, double y) {
  const double u = x / 8, v = y / 8;
  const int col = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
  if (std::max(std::abs(u - col - 0.5), std::abs(v - row - 0.5)) > 0.375) return {0.1, 0.1, 0.1};
  return {0.4 + 0.6 * Hash(row, col, 50), 0.4 + 0.6 * Hash(row, col, 51), 0.4 + 0.6 * Hash(row, col, 52)};
}

INSTANTIATE_TEST_SUITE_P(
    Decoder, ImagesWithoutTheBoard,
    testing::Values(
        EmptyScene{"Grey",
                   [](double, double) {
                     return Color{0.5, 0.5, 0.5};
                   }},
        EmptyScene{"Plaid", Plaid}, EmptyScene{"Checks", Checks}, EmptyScene{"RegularTiles", Tiles},
        EmptyScene{"Text", Text}, EmptyScene{"Screen", Screen}, EmptyScene{"Weave", Weave},
        EmptyScene{"Clouds", Clouds}, EmptyScene{"Speckle", Speckle}, EmptyScene{"Madras", Madras},
        EmptyScene{"TextOnAScreen", TextOnAScreen}, EmptyScene{"StainedGlass", StainedGlass},
        EmptyScene{"PastelCells", PastelCells},
        EmptyScene{"RandomCellsOf5Px", [](double x, double y) { return Cells(x, y, 5, 0.3, RandomInk); }},
        EmptyScene{"RandomCellsOf12Px", [](double x, double y) { return Cells(x, y, 12, 0.8, RandomInk); }}),
    [](const auto& test) { return test.param.name; });

struct FalseCells {
  int cells = 0, wrong = 0;
};

FalseCells DecodeAndJudge(const Photograph& photo, const BoardIndex& board) {
  const auto result = DecodeView(Render(photo, board.board()), TestBoard(), {});
  FalseCells found;
  if (!result.ok()) {
    ADD_FAILURE() << result.status();
    return found;
  }
  for (const Observation& o : result->observations) {
    if (o.node.kind != NodeKind::kCenter) continue;
    const auto [x, y] = PixelFromBoard(photo, board.board(), o.node.col + 0.5, o.node.row + 0.5);
    ++found.cells;
    found.wrong += std::hypot(o.x_px - x, o.y_px - y) > 0.5 * photo.pitch_px;
  }
  return found;
}

TEST(HardlyReadableImages, YieldLittleAndThatRight) {
  const Photograph cases[] = {
      {.width_px = 200, .height_px = 180, .pitch_px = 2.0, .blur_px = 0.7},
      {.width_px = 240, .height_px = 220, .pitch_px = 6, .blur_px = 3.5},
      {.width_px = 240, .height_px = 220, .pitch_px = 5, .noise = 40},
      {.width_px = 240, .height_px = 220, .pitch_px = 6, .squeeze = 0.3, .blur_px = 1.2},
      {.width_px = 240, .height_px = 220, .pitch_px = 6, .fade = 0.9},
  };
  for (const Photograph& photo : cases) {
    const FalseCells found = DecodeAndJudge(photo, TestBoard());
    EXPECT_LE(found.wrong, 0.005 * found.cells)
        << "pitch " << photo.pitch_px << " blur " << photo.blur_px << ": " << found.cells << " cells";
  }
}

TEST(OtherBoards, YieldNoNodeAtAnySize) {
  const BoardIndex other = *BoardIndex::Build(*GenerateBoard(60, 70, 3.0, 77));
  for (const double pitch_px : {4.0, 7.0, 14.0}) {
    EXPECT_EQ(DecodeAndJudge({.pitch_px = pitch_px}, other).cells, 0) << pitch_px;
    EXPECT_EQ(DecodeAndJudge({.pitch_px = pitch_px, .mirrored = true}, TestBoard()).cells, 0) << pitch_px;
  }
}

}  // namespace
}  // namespace weft
