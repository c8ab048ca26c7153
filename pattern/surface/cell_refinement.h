// A second look at grown cells, now that their neighbours are known.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "pattern/surface/board_growth.h"

namespace weft {

struct CellRefinementOptions {
  // Before growth goes on from what is left, cells less certain than this make room.
  float min_confidence_to_grow = 0.85f;
  // Rims are looked at again from cells that are as certain as this; others make room there.
  float min_confidence_at_rims = 0.95f;
  // A cell whose identity and place are less certain is dropped in the end.
  float min_confidence = 0.975f;
  // Down to here, cells still connect others and help to place them, before they are dropped.
  float min_confidence_to_help = 0.92f;
  // Fewer connected cells than this may be chance, in a view of up to a thousand; larger ones ask for more.
  int min_component = 5;

  absl::Status Validate() const;
};

// Where growth starts again.
struct Regrowth {
  GrownCells known;               // sure, and all cells around them are
  std::vector<GrowthSeed> seeds;  // sure, next to others that are not
  GrownCells judged;              // all cells, with their centres fitted together and their confidence
};

// Leaves out cells that are less sure than min_confidence_to_grow: what was taken wrongly is in the way of
// what is there.
Regrowth RegrowthFrom(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                      const CellRefinementOptions& options, const GrownCells& cells);

// Judges cells that were grown from `again`: `known` are those of at least min_confidence_at_rims, with their
// centres as fitted together.
Regrowth RegrowthAtRims(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                        const CellRefinementOptions& options, const Regrowth& again, GrownCells cells);

// Fits the centres of neighbouring cells together (but for those of `again` that have not changed since, nor
// has anything around them: they are taken as they were judged), drops cells that are no help and those that
// are left in small groups, fits the rest once more, and drops those that are too uncertain and those whose
// centres lie outside the image. Order is kept.
void RefineCells(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                 const CellRefinementOptions& options, const Regrowth& again, GrownCells* cells);

}  // namespace weft
