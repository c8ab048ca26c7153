// From a few cells whose place on the board is known to all that can be seen.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "pattern/fit/cell_fitter.h"
#include "pattern/image/pixel_allocator.h"

namespace weft {

struct GrowthOptions {
  // Share of the variance around a cell that the printed pattern has to explain.
  float min_explained = 0.35f;
  // How much better the expected ink must fit the cell than any other, in units of the mean squared change
  // that another ink would make; 1 is perfect, below 0 another ink fits better.
  float min_ink_lead = 0.0f;
  // What is explained by this share is clear, and comes before all that is not.
  float clearly_explained = 0.6f;
  // Largest distance between prediction and fit, in cells.
  float max_move_cells = 0.4f;
  // Least edge and area of a cell in the image.
  float min_edge_px = 1.2f;
  float min_area_px = 4.0f;
  int iterations = 4;
  // At the rims of what is known, a cell is looked for where this many of the eight around it are known.
  int min_known_at_rims = 4;

  absl::Status Validate() const;
};

// A cell known before growth.
struct GrowthSeed {
  int row = 0;
  int col = 0;
  CellFrame frame;
  int group = 0;  // seeds of one decoded piece
};

struct GrownCell {
  int row = 0;
  int col = 0;
  CellFit fit;
  int group = 0;
  float log_odds = 0;    // logarithm of the odds that the cell is there, judged by itself; see RefineCells
  float confidence = 0;  // probability that the cell is there, the cells around taken into account
};

// As many as a view has, in memory that the next view uses again.
using GrownCells = PixelVector<GrownCell>;

// Why a board cell next to known ones was not taken.
enum class WhyMissing : uint8_t {
  kNoFit,         // no print could be fitted
  kMoved,         // the print is not where the neighbours expect it
  kNotExplained,  // the image does not look like the print
  kOtherInk,      // another ink fits better
  kTooSmall,
  kTaken,   // another cell is at that place of the image
  kUnsure,  // found, but not surely enough
};
inline constexpr int kWhyMissing = 7;
// In a few words.
std::string_view Describe(WhyMissing why);

struct MissingCell {
  int row = 0;
  int col = 0;
  float x_px = 0, y_px = 0;
  WhyMissing why = WhyMissing::kNoFit;
};

// Follows the print from the seeds cell by cell, the best explained (to 1 %) first: predicts the next cell
// from its known neighbours, fits it, and takes it when the image shows the colours that the board has there.
// A board cell is taken once, and so is a place in the image. Ordered by row and column. Growth goes on from
// the cells of `known`, too, which stay as they are. Once all that is clear has been taken, `find_more` (may
// be null) gets these cells and names further seeds. `missing` (may be null) gets the cells at which growth
// stopped within the image, in the same order.
GrownCells GrowOnBoard(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                       const GrownCells& known, const std::vector<GrowthSeed>& seeds,
                       const GrowthOptions& options,
                       const std::function<std::vector<GrowthSeed>(const GrownCells&)>& find_more = nullptr,
                       std::vector<MissingCell>* missing = nullptr);

// Grows once more where cells of `known` end, now that the parts of the print on the other side of a fold are
// known, too: what they cover does not count there. Of `missing` (may be null) those that are found are taken
// out, others are added.
GrownCells GrowAtRims(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                      const GrownCells& known, const GrowthOptions& options,
                      std::vector<MissingCell>* missing = nullptr);

}  // namespace weft
