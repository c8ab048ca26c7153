// The printed board: a grid of cells in seven colours whose 3x3 windows are unique.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/image/frame.h"

namespace weft {

enum class CellColor : uint8_t { kRed, kGreen, kYellow, kBlue, kMagenta, kCyan, kWhite };
inline constexpr int kCellColors = 7;
std::string_view CellColorName(CellColor color);
// 8-bit RGB of board.png.
std::array<uint8_t, 3> CellColorRgb(CellColor color);

// Two 3x3 windows of a board that read the same under some rotation.
struct CodeClash {
  int row_a = 0, col_a = 0;  // upper left cell of the window
  int row_b = 0, col_b = 0;
  int quarter_turns = 0;
};

// Where one of several boards lies on a joint one (joint_board.h).
struct BoardPart {
  std::string id;
  int first_row = 0;  // its column 0 is column 0 of the joint board
  int rows = 0, cols = 0;
  double cell_mm = 0;
  bool has_panels = false;

  auto operator<=>(const BoardPart&) const = default;
};

struct Board {
  std::string id;
  int rows = 0;
  int cols = 0;
  double cell_mm = 0;             // pitch; 0 where unknown (a plain board.png)
  double square_fraction = 0.75;  // coloured part of the pitch, the rest is ink
  std::vector<CellColor> cells;   // [rows][cols], row 0 at the top
  // [rows][cols], the panel of each cell, 0 outside of all. Where there are panels only windows within one of
  // them count: the others are cut apart before anybody sees them. Empty: the whole board counts.
  std::vector<uint8_t> panels;
  std::vector<BoardPart> parts;  // of a joint board, from top to bottom; empty: an ordinary one

  CellColor at(int row, int col) const { return cells[static_cast<size_t>(row) * cols + col]; }
  bool Contains(int row, int col) const { return row >= 0 && row < rows && col >= 0 && col < cols; }

  // The part of a joint board that a row belongs to, -1 for none.
  int PartAt(int row) const;
  // Sizes match, at least 3x3, at most 4096 a side. InvalidArgument names the field.
  absl::Status Validate() const;
  // 16 hex digits over rows, cols and colours: what decides whether two files are the same board.
  std::string ContentHash() const;
  // Whether the 3x3 window with this upper left cell lies on the board, and within one panel where there are
  // any.
  bool HasWindow(int row, int col) const;
  // Pairs of 3x3 windows that read the same under the four rotations; at most `limit` of them.
  std::vector<CodeClash> FindClashes(size_t limit) const;
};

// From an image with one pixel per cell in the seven colours (each pixel must lie within 60 of one of them in
// every channel). InvalidArgument names the first pixel that does not.
absl::StatusOr<Board> BoardFromImage(const Frame& image);
Frame BoardToImage(const Board& board);

// A plain random board (board_generation.h makes better ones) whose 3x3 windows are unique under rotation,
// without equal 4-neighbours; the same for the same seed. ResourceExhausted when no such board of this size
// is found.
absl::StatusOr<Board> GenerateBoard(int rows, int cols, double cell_mm, uint64_t seed);

}  // namespace weft
