// How well the inks of a print can be told apart under a given light.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "pattern/board/board.h"
#include "pattern/image/ink_model.h"
#include "pattern/observation.h"

namespace weft {

struct PaletteInk {
  int samples = 0;
  Rgb mean = {};  // grey levels
  std::array<std::array<double, 3>, 3> covariance{};
};

// Pairs of inks, [ink][ink] as CellColor. A separation is the distance of the means in units of the scatter
// along their line; inks with fewer than 8 samples take no part and stand with zeros.
struct PaletteReport {
  std::array<PaletteInk, kCellColors> inks;
  std::array<std::array<double, kCellColors>, kCellColors> separation{};
  // Share of the row's samples that are likelier under the column's Gaussian than under any other; the
  // diagonal is the share that is read right.
  std::array<std::array<double, kCellColors>, kCellColors> confusion{};
  CellColor weakest_a = CellColor::kRed, weakest_b = CellColor::kGreen;  // of all pairs the least separated
  // Of the two the one whose other neighbours are nearer as well: a change of it helps most. Never white,
  // which is the bare cloth.
  CellColor change = CellColor::kRed;
};

struct PaletteSample {
  CellColor ink = CellColor::kRed;
  Rgb color = {};
};

// Centres of decoded cells, each the mean of the pixels in the inner half of its square, divided by the
// local light. The light is the mean ratio of cells within three rows and columns to their inks' means.
// Corners, observations off the picture and cells with no neighbour are left out. InvalidArgument: a grey
// frame.
absl::StatusOr<std::vector<PaletteSample>> SampleCells(const Frame& frame, const Board& board,
                                                       const std::vector<Observation>& observations);

// Pixels of the swatches in a print's head, in the order of CellColor, from the centre of the first swatch
// to that of the last, black one. InvalidArgument: places off the picture, a grey frame.
absl::StatusOr<std::vector<PaletteSample>> SampleSwatches(const Frame& frame,
                                                          const std::array<double, 2>& first_px,
                                                          const std::array<double, 2>& last_px);

// FailedPrecondition where fewer than two inks have 8 samples.
absl::StatusOr<PaletteReport> AssessPalette(const std::vector<PaletteSample>& samples);

}  // namespace weft
