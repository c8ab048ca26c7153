#include "alignment/map_place.h"

#include <utility>
#include <vector>

namespace weft {
namespace {

// A right map of 98,618 cells, whose cloth was seen by 24 cameras, lacks 0.1 % of the cells that were
// triangulated, and one that counts from 1 lacks 1.3 %. Templates may lack cells at one border, not at that
// alone which another place would bring in.
constexpr int kTellingCells = 500, kFewOutside = 20;
constexpr double kOutside = 0.003, kOutsideThere = 0.25;

class MappedCells {
 public:
  MappedCells(const Template& garment, const Board& board)
      : board_(board), has_(static_cast<size_t>(board.rows) * board.cols, false) {
    for (const VertexNode& node : garment.node_of_vertex)
      if (node.IsCell() && board.Contains(node.row, node.col)) has_[At(node.row, node.col)] = true;
  }

  // Of the cells that were triangulated, those that no vertex has once the map is elsewhere.
  int CountOutside(const std::vector<BoardNode>& seen, const MapPlace& place) const {
    int outside = 0;
    for (const BoardNode& cell : seen) {
      int row = cell.row - place.rows, col = cell.col - place.cols;
      if (place.half_turn) row = board_.rows - 1 - row, col = board_.cols - 1 - col;
      outside += !board_.Contains(row, col) || !has_[At(row, col)];
    }
    return outside;
  }

 private:
  size_t At(int row, int col) const { return static_cast<size_t>(row) * board_.cols + col; }

  const Board& board_;
  std::vector<bool> has_;  // [rows * cols]
};

}  // namespace

std::optional<MapPlace> FindOtherPlace(const Template& garment, const Board& board, const Cloud& cloud) {
  std::vector<BoardNode> seen;
  for (const CloudPoint& point : cloud.points)
    if (point.node.kind == NodeKind::kCenter) seen.push_back(point.node);
  const MappedCells mapped(garment, board);
  const auto cells = static_cast<int>(seen.size());
  const int outside = mapped.CountOutside(seen, {});
  if (cells < kTellingCells || outside < kFewOutside || outside < kOutside * cells) return std::nullopt;
  std::optional<MapPlace> best;
  // Of places that fit as well the first: maps of which rows alone count from 1 are rare.
  std::vector<MapPlace> places = {{.half_turn = true}};
  for (const auto& [rows, cols] : {std::pair(-1, -1), std::pair(1, 1), std::pair(-1, 0), std::pair(0, -1),
                                   std::pair(1, 0), std::pair(0, 1), std::pair(-1, 1), std::pair(1, -1)})
    places.push_back({.rows = rows, .cols = cols});
  for (const MapPlace& place : places) {
    const int there = mapped.CountOutside(seen, place);
    if (there > kOutsideThere * outside || (best && there >= best->outside_there)) continue;
    best = place;
    best->cells = cells;
    best->outside = outside;
    best->outside_there = there;
  }
  return best;
}

}  // namespace weft
