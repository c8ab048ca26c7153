// How sure each cell of a view is.
#pragma once

#include <array>
#include <optional>

#include "pattern/fit/cell_fitter.h"
#include "pattern/surface/board_state.h"

namespace weft {

// What speaks for a cell and against it, the regressors of its log odds: what it and the cells around it
// show, how it lies among them, and whether its run along an edge is short (edge_runs.h).
inline constexpr int kReasons = 12;
using Evidence = std::array<float, kReasons>;
// Nothing without a known cell around.
std::optional<Evidence> EvidenceFor(const BoardState& state, const ViewCell& cell);
// Probability that a cell is where it was found; one without any around it is not believed.
float Confidence(const ViewCell& cell, const std::optional<Evidence>& evidence);

// Refines the centres of the cells whose surroundings have changed since the last call (one sweep, see
// center_sweep.h), and fills confidence there and along edges. It depends on how well a cell and those around
// it are explained, and on its position relative to them. A cell without neighbours has confidence 0.
void ScoreCells(const CellFitter& fitter, BoardState* state);

}  // namespace weft
