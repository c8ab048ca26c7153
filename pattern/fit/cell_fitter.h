// One printed cell and its neighbours, rendered under an affine pose and fitted to the image.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "pattern/board/board.h"
#include "pattern/fit/appearance.h"
#include "pattern/fit/cell.h"
#include "pattern/fit/cell_bounds.h"
#include "pattern/fit/cell_kernel.h"
#include "pattern/fit/sampled_profile.h"
#include "pattern/fit/small_cholesky.h"
#include "pattern/image/color_image.h"

namespace weft {

struct CellFit {
  CellPose pose;
  bool converged = false;
  float moved_cells = 0;  // distance from the initial position, in cells
  float explained =
      0;  // share of the weighted variance that the model explains before the last step, at most 1
  float predicted = 0;  // the share after the last step, by its normal equations
  float gain = 0;       // light
  float offset = 0;     // grey levels
  float noise = 0;      // RMS residual over the window, grey levels
  float center_contrast =
      0;               // RMS of what another ink would have changed in the cell, least over the other inks
  float ink_lead = 0;  // how much worse the next best ink fits the cell: difference of mean squared residuals
  float sigma_px = 0;  // predicted standard deviation of the position per axis
};

// What a fit must fulfil to be taken; see Reject.
struct FitLimits {
  int iterations = 4;
  // Share of the variance around the cell that the printed pattern has to explain.
  float min_explained = 0.35f;
  // How much better the expected ink must fit the cell than any other, in units of the mean squared change
  // that another ink would make. 1 is perfect, below 0 another ink fits better.
  float min_ink_lead = 0.0f;
  // Largest distance between prediction and fit, in cells.
  float max_move_cells = 0.4f;
  // Least edge and area of the cell in the image.
  float min_edge_px = 1.2f;
  float min_area_px = 4.0f;

  // Field names in errors begin with `prefix`.
  absl::Status Validate(std::string_view prefix) const;
};

// Residuals of neighbouring pixels are alike, which the fit does not know: measured errors of a centre are
// this much larger than CellFit::sigma_px. Ray-traced views ask for 1.6 without compression and 2.1 as JPEG
// files.
inline constexpr float kSigmaFactor = 1.9f;

// Standard deviation of the fit's own belief that a cell is where it is expected, in cells.
inline constexpr float kPositionPrior = 0.35f;

// A sum of squares over small moves of a centre: half its second derivative (1 / px^2) and half its slope
// (1 / px) where the centre is, in units of its noise.
struct CenterNormal {
  float xx = 0, xy = 0, yy = 0;
  float x = 0, y = 0;
};

// Fits cells of one board to one image, whose halvings `pyramid` holds (level k is 2^k times smaller).
// Pyramid, board and profile must outlive it. Thread-safe.
class CellFitter {
 public:
  CellFitter(const std::vector<ColorImage>& pyramid, const Board& board, const SampledProfile& profile,
             const Appearance& appearance);

  // Gauss-Newton from where the cell is expected, on the six parameters of the pose; gain and offset of the
  // light are eliminated. The window reaches one cell to all sides and counts less towards its border. Not
  // converged where the window leaves the image or the print cannot be there; nor where a step promises so
  // little that the fit will hardly come to limits.min_explained. The cell must lie on the board. `visible`
  // (may be null) weighs the samples: 0 where something covers the print.
  CellFit Fit(const PredictedCell& expected, const FitLimits& limits,
              const SampleMask* visible = nullptr) const;

  // What the image says about moves of the centre alone, in a print that is interpolated bilinearly between
  // the nine centres (cloth creased at the centres, as a mesh with a vertex per cell); the noise of `normal`
  // is noise(). Where neighbours count less than fully, parts of the window that are not like the print
  // count less, too. Nothing moves, and sigma_px is not filled. Where `normal` is null, inks are not scored.
  CellFit FitCenter(int row, int col, const NineCenters& centers, const NeighborWeights& weights,
                    CenterNormal* normal) const;

  const std::vector<ColorImage>& pyramid() const { return pyramid_; }
  // Appearance::noise.
  float noise() const { return appearance_.noise; }

 private:
  // The image of the pyramid that a cell is measured in.
  struct Level {
    PixelView image;
    float scale;
  };
  Level LevelFor(const CellPose& pose) const;
  CellPrint PrintAt(int row, int col, const CellPose& pose, float scale,
                    const NeighborWeights& weights) const;

  const std::vector<ColorImage>& pyramid_;
  const Board& board_;
  std::vector<uint8_t> labels_;  // [rows + 4][cols + 4], the inks with two cells off the board all around
  const SampledProfile& profile_;
  const Appearance appearance_;
  const CellKernels& kernels_;
  SmallVector<6> prior_;                                      // precisions of a step, in units of noise()
  std::array<std::array<float, 4>, kCellColors + 1> colors_;  // minus black; the last is off the board
};

}  // namespace weft
