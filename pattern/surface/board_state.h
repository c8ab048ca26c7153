// What one view has shown of the board so far: the one state that all policies of the decoder work on.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "pattern/board/board.h"
#include "pattern/fit/cell_check.h"
#include "pattern/fit/cell_fitter.h"
#include "pattern/image/pixel_allocator.h"

namespace weft {

// A board cell that is seen in the view.
struct ViewCell {
  int row = 0;
  int col = 0;
  CellFit fit;
  int group = 0;         // of the lattice piece that it grew from
  float confidence = 0;  // probability that the cell is there; see ScoreCells
  bool is_read = false;  // see PlacedCell
};

// The cells of one view, by board position. A board cell is in it at most once.
class BoardState {
 public:
  // `board` must outlive it. Missing cells are noted where `notes_missing`.
  BoardState(const Board& board, int width_px, int height_px, bool notes_missing = false);

  const Board& board() const { return *board_; }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  // Whether a pixel centre of the image is there.
  bool InImage(const CellPose& pose) const {
    return pose.x >= 0 && pose.y >= 0 && pose.x <= static_cast<float>(width_px_ - 1) &&
           pose.y <= static_cast<float>(height_px_ - 1);
  }

  // In the order in which they were added; by row and column after Sort.
  const PixelVector<ViewCell>& cells() const { return cells_; }
  ViewCell& cell(size_t index) { return cells_[index]; }
  // Index of the cell, -1 where there is none; at most kBorder rows or columns off the board.
  int At(int row, int col) const { return positions_[PositionOf(row, col)].cell; }
  const ViewCell* Find(int row, int col) const {
    const int k = At(row, col);
    return k < 0 ? nullptr : &cells_[k];
  }
  // Which of the eight cells around are there: bit k of row k / 3 - 1, column k % 3 - 1 (k = 4 left out).
  uint32_t Around(int row, int col) const;

  // The position must be empty and on the board.
  void Add(const ViewCell& cell);
  void Sort();
  // Removes the cells for which keep(index) is false; the order stays.
  template <typename Keep>
  void Filter(const Keep& keep) {
    size_t kept = 0;
    for (size_t k = 0; k < cells_.size(); ++k) {
      if (keep(k)) {
        cells_[kept++] = cells_[k];
      } else {
        MarkRemoved(cells_[k]);
      }
    }
    cells_.resize(kept);
    IndexCells();
  }
  // Removes cells below `min_confidence`. A false positive blocks its board cell and its image area, so the
  // true cell could not be grown.
  void Evict(float min_confidence);

  // Whether nothing has been added or removed, since MarkScored, where the fit of a centre looks.
  bool IsScored(const ViewCell& cell) const;
  void MarkScored();

  // Growth's memory of a position, for the growth going on: the best candidate's share of explained variance,
  // and what need not be tried again (0 at first; the growth knows what its bits say).
  float& BestExplained(int row, int col) { return positions_[PositionOf(row, col)].best_explained; }
  uint32_t& Tried(int row, int col) { return positions_[PositionOf(row, col)].tried; }
  void ForgetAttempts();
  // Fetches what a growth reads of a position.
  void Prefetch(int row, int col) const { __builtin_prefetch(&positions_[PositionOf(row, col)]); }

  // Gives back all memory but for the cells, for which nothing may be asked until Wake.
  void Rest();
  void Wake();

  // Notes why a cell was not taken; the last reason counts. Nothing outside of the image is noted.
  void Miss(int row, int col, const CellPose& expected, WhyMissing why);
  // The noted cells that are still missing, by row and column.
  std::vector<MissingCell> Missing() const;

  static constexpr int kBorder = 3;

 private:
  struct Position {
    int cell = -1;
    float best_explained = 0;
    uint32_t tried = 0;
    bool changed = false;  // since MarkScored
  };

  size_t PositionOf(int row, int col) const {
    return static_cast<size_t>(row + kBorder) * columns_ + col + kBorder;
  }
  size_t PositionCount() const { return static_cast<size_t>(columns_) * (board_->rows + 2 * kBorder); }
  void MarkRemoved(const ViewCell& cell);
  void IndexCells();

  const Board* board_;
  int width_px_, height_px_, columns_;
  bool notes_missing_;
  PixelVector<Position> positions_;  // empty at rest
  PixelVector<ViewCell> cells_;      // empty at rest
  struct Resting {
    std::vector<ViewCell> cells;
    std::vector<size_t> changed;  // positions
  };
  Resting resting_;
  std::map<size_t, MissingCell> missing_;  // by position
};

}  // namespace weft
