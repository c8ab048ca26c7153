// How many cameras read each cell of a garment, as views are decoded one after the other.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pattern/observation.h"

namespace weft {

// Cells are classified by the number of their cameras: three are needed for a point in space.
inline constexpr size_t kCoverageClasses = 5;
inline constexpr std::array<const char*, kCoverageClasses> kCoverageClassNames = {
    "no camera", "one", "two", "three to five", "six and more"};
size_t CoverageClass(int views);

class Coverage {
 public:
  // `garment_cells`: row and column of the cells that count; empty: all of the board.
  Coverage(int rows, int cols, const std::vector<std::pair<int, int>>& garment_cells);

  // Replaces what the camera had read before. Cells that do not count are left out.
  void Set(const std::string& camera, const std::vector<Observation>& observations);

  int rows() const { return rows_; }
  int cols() const { return cols_; }
  // Cameras that read the cell; -1 where it does not count.
  int Views(int row, int col) const { return views_[Index(row, col)]; }
  // Cells of each class.
  std::array<int64_t, kCoverageClasses> Count() const;
  // Cells that the camera read; -1 where it was never decoded.
  int64_t CellsOf(const std::string& camera) const;
  size_t cameras() const { return cells_.size(); }

 private:
  size_t Index(int row, int col) const { return static_cast<size_t>(row * cols_ + col); }

  const int rows_, cols_;
  std::vector<int> views_;                            // [rows][cols]
  std::map<std::string, std::vector<size_t>> cells_;  // by camera
};

}  // namespace weft
