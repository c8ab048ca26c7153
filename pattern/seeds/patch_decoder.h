// Board poses of pieces of lattice, from the colours of their cells.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "pattern/board/board_index.h"
#include "pattern/image/color_image.h"
#include "pattern/image/ink_model.h"
#include "pattern/seeds/lattice.h"

namespace weft {

struct PatchDecodeOptions {
  // Least evidence of a piece: log likelihood of its colours on the board over that of random ones, in nats.
  float min_evidence = 12.0f;
  // Least lead over the runner-up pose on the same cells, in nats.
  float min_margin = 6.0f;
  // Cells right around a piece that speak against it, per cell of the piece; a chance hit is surrounded by
  // them.
  float max_contradicted = 0.25f;
  // With this much evidence in nats no piece is chance: what contradicts it is another part of the print that
  // the lattice joined to it across a fold. Of the contradicted pieces in takes of `weft simulate`, none
  // above 20 nats was wrong, of 216 (accuracy_decode's takes and presets, November 2026).
  float min_evidence_contradicted = 30.0f;

  absl::Status Validate() const;
};

// What the inks say about one cell.
struct CellReading {
  std::array<float, kCellColors> evidence;  // log likelihood of each ink over that of a random one
  float lead;                               // of the likeliest ink over the next
  uint8_t best, second;
};

// A patch with what was measured at its cells.
struct MeasuredPatch {
  LatticePatch lattice;
  std::vector<Rgb> colors;            // [cells], relative to the light around
  std::vector<CellReading> readings;  // [cells]
  std::vector<int> grid;              // [i][j] -> cell, -1 where there is none

  int CellAt(int i, int j) const;
  int columns() const { return lattice.j_max - lattice.j_min + 1; }
};

// The cells of a patch that lie on the board under one pose (cell (i, j) is pose.ToBoard(i, j)).
struct DecodedPiece {
  BoardPose pose;
  std::vector<int> cells;    // ascending indices into the patch
  std::vector<int> centers;  // middle cells of the 3x3 windows that read this pose, ascending
  float evidence = 0;
  float margin = 0;      // over the runner-up, on 200 of the cells where there are more
  int contradicted = 0;  // cells next to the piece, outside of it, that look like another ink
};

// The colour at a point, bilinear; outside of the image that of its border.
Rgb SampleColor(const ColorImage& image, float x, float y);

// What the inks say about a colour relative to the light around.
CellReading ReadCell(const InkModel& inks, const Rgb& color);

// Reads the colours of a patch from the image in which its keypoints were found.
MeasuredPatch MeasurePatch(const LatticePatch& patch, const std::vector<Keypoint>& points,
                           const ColorImage& image);

// Evidence of one cell of a patch for a pose.
float CellEvidence(const MeasuredPatch& patch, int cell, const BoardPose& pose, const Board& board);

// Fills readings.
void ClassifyPatch(const InkModel& inks, MeasuredPatch* patch);

// Pieces that read a pose, the one with most windows first. A patch that was joined wrongly reads several; a
// cell is in one piece at most. Pieces below the options' limits are included: their evidence and margin
// tell.
std::vector<DecodedPiece> DecodePatch(const MeasuredPatch& patch, const BoardIndex& board);

// Whether the patch reads much better in a mirror: more than twice as many windows are on the board.
bool LooksMirrored(const MeasuredPatch& patch, const BoardIndex& board);

}  // namespace weft
