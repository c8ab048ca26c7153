#include "services/studio/print/panel_label.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace weft {
namespace {

constexpr double kInsetMm = 0.4;                     // keeps the box off seam and cut lines
constexpr double kAdvance = 0.68;                    // of a letter, at most, by the font's size
constexpr double kLargestMm = 5, kSmallestMm = 2.5;  // legible on cloth

Eigen::Vector2d BoxOf(const std::string& text, double size_mm) {
  return {(kAdvance * static_cast<double>(text.size()) + 0.4) * size_mm, 1.4 * size_mm};
}

struct Block {
  int row = 0, col = 0;
};

// The lowest block of `rows` x `cols` cells that are all of the allowance; of those in one row the first.
std::optional<Block> FreeBlock(const PrintPiece& piece, const std::vector<uint8_t>& cells, int rows,
                               int cols) {
  for (int row = piece.rows - rows; row >= 0; --row) {
    int run = 0;  // columns that are free over all rows of the block
    for (int col = 0; col < piece.cols; ++col) {
      bool free = true;
      for (int i = row; i < row + rows; ++i) free &= cells[static_cast<size_t>(i) * piece.cols + col] == 1;
      run = free ? run + 1 : 0;
      if (run == cols) return Block{row, col - cols + 1};
    }
  }
  return std::nullopt;
}

std::optional<PanelLabel> InAllowance(const PrintPiece& piece, const std::vector<uint8_t>& cells,
                                      double cell_mm, const std::string& text) {
  for (double size_mm = kLargestMm; size_mm >= kSmallestMm; size_mm -= 0.5) {
    for (const bool upright : {false, true}) {
      Eigen::Vector2d box = BoxOf(text, size_mm);
      if (upright) std::swap(box.x(), box.y());
      const auto cells_for = [&](double mm) {
        return static_cast<int>(std::ceil((mm + 2 * kInsetMm) / cell_mm));
      };
      const int rows = cells_for(box.y()), cols = cells_for(box.x());
      const std::optional<Block> block = FreeBlock(piece, cells, rows, cols);
      if (!block) continue;
      const Eigen::Vector2d middle(piece.x_mm + (block->col + 0.5 * cols) * cell_mm,
                                   piece.y_mm + (block->row + 0.5 * rows) * cell_mm);
      return PanelLabel{text, size_mm, middle - box / 2, middle + box / 2, upright, {}};
    }
  }
  return std::nullopt;
}

// The point of the printed cells nearest to `from`.
Eigen::Vector2d NearestPoint(const PrintPiece& piece, const std::vector<uint8_t>& cells, double cell_mm,
                             const Eigen::Vector2d& from) {
  Eigen::Vector2d best = from;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < piece.rows; ++i) {
    for (int j = 0; j < piece.cols; ++j) {
      if (cells[static_cast<size_t>(i) * piece.cols + j] == 0) continue;
      const Eigen::Vector2d low(piece.x_mm + j * cell_mm, piece.y_mm + i * cell_mm);
      const Eigen::Vector2d at = from.cwiseMax(low).cwiseMin(low + Eigen::Vector2d(cell_mm, cell_mm));
      if ((at - from).squaredNorm() >= least) continue;
      least = (at - from).squaredNorm();
      best = at;
    }
  }
  return best;
}

}  // namespace

PanelLabel PlacePanelLabel(const PrintPiece& piece, const std::vector<uint8_t>& cells, double cell_mm) {
  if (std::optional<PanelLabel> label = InAllowance(piece, cells, cell_mm, piece.label)) return *label;
  // The gap is free below and to the right of every piece.
  const double room_mm = piece.cols * cell_mm + kPrintGapMm - 2;
  PanelLabel label{.text = piece.label};
  label.size_mm = std::min(3.5, room_mm / BoxOf(piece.label, 1).x());
  const Eigen::Vector2d box = BoxOf(piece.label, label.size_mm);
  label.low_mm = {piece.x_mm, piece.y_mm + piece.rows * cell_mm + 4};
  label.high_mm = label.low_mm + box;
  label.leader_mm = NearestPoint(piece, cells, cell_mm, {label.low_mm.x() + box.x() / 2, label.low_mm.y()});
  return label;
}

}  // namespace weft
