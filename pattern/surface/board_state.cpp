#include "pattern/surface/board_state.h"

#include <algorithm>
#include <utility>

namespace weft {

BoardState::BoardState(const Board& board, int width_px, int height_px, bool notes_missing)
    : board_(&board),
      width_px_(width_px),
      height_px_(height_px),
      columns_(board.cols + 2 * kBorder),
      notes_missing_(notes_missing),
      positions_(PositionCount(), Position()) {}

uint32_t BoardState::Around(int row, int col) const {
  const Position* here = &positions_[PositionOf(row, col)];
  uint32_t around = 0;
  for (int k = 0; k < 9; ++k) {
    if (k != 4 && here[(k / 3 - 1) * columns_ + k % 3 - 1].cell >= 0) around |= 1u << k;
  }
  return around;
}

void BoardState::Add(const ViewCell& cell) {
  Position& position = positions_[PositionOf(cell.row, cell.col)];
  position.cell = static_cast<int>(cells_.size());
  position.changed = true;
  cells_.push_back(cell);
}

void BoardState::Sort() {
  PixelVector<ViewCell> sorted;
  sorted.reserve(cells_.size());
  for (Position& position : positions_) {
    if (position.cell < 0) continue;
    sorted.push_back(cells_[position.cell]);
    position.cell = static_cast<int>(sorted.size()) - 1;
  }
  cells_ = std::move(sorted);
}

void BoardState::Rest() {
  for (size_t k = 0; k < positions_.size(); ++k) {
    if (positions_[k].changed) resting_.changed.push_back(k);
  }
  resting_.cells.assign(cells_.begin(), cells_.end());
  positions_ = PixelVector<Position>();
  cells_ = PixelVector<ViewCell>();
}

void BoardState::Wake() {
  if (!positions_.empty()) return;
  positions_.assign(PositionCount(), Position());
  for (const size_t k : resting_.changed) positions_[k].changed = true;
  cells_.assign(resting_.cells.begin(), resting_.cells.end());
  IndexCells();
  resting_ = {};
}

void BoardState::Evict(float min_confidence) {
  Filter([&](size_t k) { return cells_[k].confidence >= min_confidence; });
}

void BoardState::MarkRemoved(const ViewCell& cell) {
  positions_[PositionOf(cell.row, cell.col)] = {.changed = true};
  Miss(cell.row, cell.col, cell.fit.pose, WhyMissing::kUnsure);
}

void BoardState::IndexCells() {
  for (size_t k = 0; k < cells_.size(); ++k)
    positions_[PositionOf(cells_[k].row, cells_[k].col)].cell = static_cast<int>(k);
}

bool BoardState::IsScored(const ViewCell& cell) const {
  const Position* here = &positions_[PositionOf(cell.row, cell.col)];
  bool changed = false;
  for (int d = -2; d <= 2; ++d) changed |= here[d].changed | here[d * columns_].changed;
  for (const int d : {-columns_ - 1, -columns_ + 1, columns_ - 1, columns_ + 1}) changed |= here[d].changed;
  return !changed;
}

void BoardState::MarkScored() {
  for (Position& position : positions_) position.changed = false;
}

void BoardState::ForgetAttempts() {
  for (Position& position : positions_) {
    position.best_explained = 0;
    position.tried = 0;
  }
}

void BoardState::Miss(int row, int col, const CellPose& expected, WhyMissing why) {
  if (notes_missing_ && InImage(expected))
    missing_[PositionOf(row, col)] = {row, col, expected.x, expected.y, why};
}

std::vector<MissingCell> BoardState::Missing() const {
  std::vector<MissingCell> missing;
  for (const auto& [position, miss] : missing_) {
    if (positions_[position].cell < 0) missing.push_back(miss);
  }
  return missing;
}

}  // namespace weft
