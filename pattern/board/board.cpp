#include "pattern/board/board.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <memory>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/content_hash.h"
#include "pattern/board/window_code.h"

namespace weft {
namespace {

constexpr int kMaxSide = 4096;

struct NamedColor {
  std::string_view name;
  std::array<uint8_t, 3> rgb;
};
constexpr std::array<NamedColor, kCellColors> kColors = {{
    {"red", {255, 50, 50}},
    {"green", {50, 255, 50}},
    {"yellow", {255, 255, 50}},
    {"blue", {50, 50, 255}},
    {"magenta", {255, 50, 255}},
    {"cyan", {50, 255, 255}},
    {"white", {255, 255, 255}},
}};

// The colour within 60 of the pixel in every channel; -1 where there is none.
int ColorOfPixel(const uint8_t* rgb) {
  for (int k = 0; k < kCellColors; ++k) {
    int worst = 0;
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(rgb[c] - kColors[k].rgb[c]));
    if (worst <= 60) return k;
  }
  return -1;
}

// One rotated reading of one window.
struct CodedWindow {
  uint32_t canonical;  // least code over the rotations
  int32_t row, col;
  int32_t turn;  // quarter turns that lead to the canonical code
};

std::vector<CodedWindow> CanonicalWindows(const Board& board) {
  std::vector<CodedWindow> windows;
  windows.reserve(static_cast<size_t>(board.rows - 2) * (board.cols - 2));
  for (int row = 0; row + 3 <= board.rows; ++row) {
    for (int col = 0; col + 3 <= board.cols; ++col) {
      if (!board.HasWindow(row, col)) continue;
      const auto codes = RotatedCodes(BoardWindow(board, row, col));
      const auto least = std::min_element(codes.begin(), codes.end());
      windows.push_back({*least, row, col, static_cast<int32_t>(least - codes.begin())});
    }
  }
  return windows;
}

}  // namespace

std::string_view CellColorName(CellColor color) { return kColors[static_cast<int>(color)].name; }

std::array<uint8_t, 3> CellColorRgb(CellColor color) { return kColors[static_cast<int>(color)].rgb; }

absl::Status Board::Validate() const {
  const auto bad = [this](std::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat("board ", id, ": ", std::string(what)));
  };
  if (rows < 3 || rows > kMaxSide) return bad(absl::StrCat("rows ", rows, " is outside 3 to ", kMaxSide));
  if (cols < 3 || cols > kMaxSide) return bad(absl::StrCat("cols ", cols, " is outside 3 to ", kMaxSide));
  if (cells.size() != static_cast<size_t>(rows) * cols) {
    return bad(absl::StrCat("cells holds ", cells.size(), " colours, ", rows, "x", cols, " needs ",
                            static_cast<size_t>(rows) * cols));
  }
  if (!panels.empty() && panels.size() != cells.size()) {
    return bad(absl::StrCat("panels holds ", panels.size(), " cells, the board has ", cells.size()));
  }
  if (!(cell_mm >= 0 && cell_mm < 1e6)) return bad(absl::StrCat("cell_mm ", cell_mm, " must be 0 or more"));
  if (!(square_fraction > 0 && square_fraction <= 1)) {
    return bad(absl::StrCat("square_fraction ", square_fraction, " must be above 0 and at most 1"));
  }
  if (parts.size() > std::numeric_limits<uint8_t>::max())
    return bad(absl::StrCat("parts: there are ", parts.size(), ", but no more than 255 panels"));
  for (size_t i = 0; i < parts.size(); ++i) {
    const BoardPart& part = parts[i];
    const int from = i == 0 ? 0 : parts[i - 1].first_row + parts[i - 1].rows;
    if (part.rows < 3 || part.cols < 3 || part.cols > cols || part.first_row < from ||
        part.first_row > rows - part.rows)
      return bad(absl::StrCat(
          "parts[", i, "]: rows ", part.first_row, " to ", int64_t{part.first_row} + part.rows - 1, " and ",
          part.cols, " columns do not fit below the part before, within ", rows, "x", cols, " cells"));
    if (panels.empty()) return bad("a joint board has panels");
  }
  for (size_t i = 0; i < cells.size(); ++i) {
    if (static_cast<int>(cells[i]) >= kCellColors) {
      return bad(absl::StrCat("cells[", i, "] is no colour (", static_cast<int>(cells[i]), ")"));
    }
  }
  return absl::OkStatus();
}

int Board::PartAt(int row) const {
  for (size_t i = 0; i < parts.size(); ++i)
    if (row >= parts[i].first_row && row < parts[i].first_row + parts[i].rows) return static_cast<int>(i);
  return -1;
}

bool Board::HasWindow(int row, int col) const {
  if (row < 0 || col < 0 || row + 3 > rows || col + 3 > cols) return false;
  if (panels.empty()) return true;
  const uint8_t panel = panels[static_cast<size_t>(row) * cols + col];
  for (int i = 1; i < 9 && panel != 0; ++i)
    if (panels[static_cast<size_t>(row + i / 3) * cols + col + i % 3] != panel) return false;
  return panel != 0;
}

std::string Board::ContentHash() const {
  std::string colors(cells.size(), '\0');
  std::transform(cells.begin(), cells.end(), colors.begin(),
                 [](CellColor c) { return static_cast<char>(c); });
  return weft::ContentHash().AddInteger(rows).AddInteger(cols).Add(colors).Hex();
}

std::vector<CodeClash> Board::FindClashes(size_t limit) const {
  std::vector<CodeClash> clashes;
  if (rows < 3 || cols < 3) return clashes;
  // A window that equals its own rotation reads two ways.
  std::vector<CodedWindow> windows = CanonicalWindows(*this);
  for (const CodedWindow& w : windows) {
    if (clashes.size() >= limit) return clashes;
    const auto codes = RotatedCodes(BoardWindow(*this, w.row, w.col));
    for (int turn = 1; turn < 4; ++turn) {
      if (codes[turn] != codes[0]) continue;
      clashes.push_back({w.row, w.col, w.row, w.col, turn});
      break;
    }
  }
  std::stable_sort(windows.begin(), windows.end(),
                   [](const CodedWindow& a, const CodedWindow& b) { return a.canonical < b.canonical; });
  for (size_t i = 1, first = 0; i < windows.size() && clashes.size() < limit; ++i) {
    if (windows[i].canonical != windows[first].canonical) {
      first = i;
      continue;
    }
    const CodedWindow &a = windows[first], &b = windows[i];
    // b turned b.turn times equals a turned a.turn times.
    clashes.push_back({a.row, a.col, b.row, b.col, (b.turn - a.turn + 4) % 4});
  }
  return clashes;
}

absl::StatusOr<Board> BoardFromImage(const Frame& image) {
  WEFT_RETURN_IF_ERROR(image.Validate());
  const std::string who = image.origin.empty() ? "board image" : image.origin;
  if (image.format != PixelFormat::kRgb8) {
    return absl::InvalidArgumentError(absl::StrCat(who, ": a board image has colours, this one is ",
                                                   std::string(PixelFormatName(image.format))));
  }
  Board board;
  board.rows = image.height_px;
  board.cols = image.width_px;
  board.cells.resize(static_cast<size_t>(board.rows) * board.cols);
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      const uint8_t* rgb = image.row(row) + 3 * col;
      const int color = ColorOfPixel(rgb);
      if (color < 0) {
        return absl::InvalidArgumentError(absl::StrCat(
            who, ": pixel x=", col, " y=", row, " (", rgb[0], ", ", rgb[1], ", ", rgb[2],
            ") is none of the seven colours; a board image has one pixel per cell, no ink lines"));
      }
      board.cells[static_cast<size_t>(row) * board.cols + col] = static_cast<CellColor>(color);
    }
  }
  if (absl::Status status = board.Validate(); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(who, ": ", std::string(status.message())));
  }
  board.id = board.ContentHash();
  return board;
}

Frame BoardToImage(const Board& board) {
  auto pixels = std::make_shared<std::vector<uint8_t>>();
  pixels->reserve(board.cells.size() * 3);
  for (const CellColor color : board.cells) {
    const auto rgb = CellColorRgb(color);
    pixels->insert(pixels->end(), rgb.begin(), rgb.end());
  }
  Frame image;
  image.width_px = board.cols;
  image.height_px = board.rows;
  image.format = PixelFormat::kRgb8;
  image.pixels = std::move(pixels);
  image.origin = absl::StrCat("board ", board.id);
  return image;
}

}  // namespace weft
