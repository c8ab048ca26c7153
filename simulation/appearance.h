// What printed cloth looks like: inks and fabric.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "pattern/board/board.h"

namespace weft {

// Linear reflectances in red, green, blue. The defaults are what photographs of worn printed jersey show once
// their blur is undone: dark, unsaturated, blue and magenta darkest, white bluish, lines barely darker than
// blue.
struct InkOptions {
  std::array<Eigen::Vector3f, kCellColors> color = {{{0.183f, 0.037f, 0.025f},
                                                     {0.112f, 0.199f, 0.120f},
                                                     {0.252f, 0.307f, 0.119f},
                                                     {0.015f, 0.022f, 0.143f},
                                                     {0.126f, 0.073f, 0.172f},
                                                     {0.143f, 0.242f, 0.348f},
                                                     {0.270f, 0.346f, 0.473f}}};
  Eigen::Vector3f line = {0.014f, 0.013f, 0.022f};
  Eigen::Vector3f back = {0.30f, 0.31f, 0.34f};  // the fabric's unprinted inside
  double line_growth_cells = 0.06;               // how far the ink of the lines creeps into each square
  double spread_cells = 0.10;                    // width over which square and line mix
  double corner_cells = 0.10;                    // radius of the squares' corners
  double cell_variation = 0.06;                  // standard deviation of a cell's reflectance, relative
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// Reflectance of the printed side, with the colour of every cell worked out once.
class PrintedInk {
 public:
  PrintedInk() = default;
  PrintedInk(const Board& board, const InkOptions& inks);

  // At a board position (in cells); the ink of the lines outside the board.
  Eigen::Vector3f At(float col, float row) const;

 private:
  int rows_ = 0, cols_ = 0;
  float half_square_ = 0, corner_ = 0, spread_ = 0;
  Eigen::Vector3f line_ = Eigen::Vector3f::Zero();
  std::vector<Eigen::Vector3f> cells_;  // [rows][cols]
};

// Knitted cotton. Its texture is part of the cloth, so it moves with it; what is finer than a pixel fades.
struct FabricLookOptions {
  double weave_variation = 0.05;  // standard deviation of the reflectance of spots half a millimetre in size
  double wale_mm = 0.85;          // width of a column of loops
  double course_mm = 0.65;        // height of a row of loops
  double knit_depth = 0.35;       // how much darker the gaps between loops are
  double wrinkle_slope = 0.10;    // standard deviation of the slope of wrinkles finer than the mesh
  double wrinkle_mm = 7;          // their size
  double fuzz = 0.05;             // reflectance of fibres that stand off, at grazing view
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// The texture at a place of the cloth, relative to plain cloth.
struct FabricTexture {
  float shade = 1;                                  // factor of the reflectance
  Eigen::Vector2f slope = Eigen::Vector2f::Zero();  // of the surface along board x and y
};

// At a board position in mm; `footprint_mm` is the size of a pixel on the cloth.
FabricTexture FabricAt(const FabricLookOptions& fabric, float x_mm, float y_mm, float footprint_mm);

}  // namespace weft
