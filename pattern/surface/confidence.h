// How sure each cell of a view is.
#pragma once

#include <array>
#include <optional>

#include "pattern/fit/cell_fitter.h"
#include "pattern/surface/board_state.h"

namespace weft {

// What speaks for a cell and against it, the regressors of its log odds: what it shows itself, and how it
// lies among the eight cells around.
inline constexpr int kReasons = 11;
using Evidence = std::array<float, kReasons>;
// Nothing without a known cell around.
std::optional<Evidence> EvidenceFor(const BoardState& state, const ViewCell& cell);
// Mean log odds of the known cells around; nothing without any.
std::optional<float> MeanLogOddsAround(const BoardState& state, const ViewCell& cell);

// Refines the centres of the cells whose surroundings have changed since the last call (one sweep, see
// center_sweep.h), and fills log_odds and confidence there. A cell's own log odds depend on how well it is
// explained and on its position relative to the cells around it. Cells are right or wrong together, so its
// confidence includes theirs. A cell without neighbours has confidence 0.
void ScoreCells(const CellFitter& fitter, BoardState* state);

}  // namespace weft
