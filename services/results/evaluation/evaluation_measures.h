// The measures of a frame as numbers: columns of tables, plots, and what comparisons test.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "services/results/evaluation/evaluate_frame.h"

namespace weft {

// kReference: of the truth, the same for all results.
enum class BetterValue { kLower, kHigher, kNeither, kReference };

struct EvaluationMeasure {
  const char* name;   // of its column in frames.csv: "mesh_visible_mean_mm"
  const char* title;  // "Vertex error, seen by 3 or more"
  const char* unit;   // "mm"; "%" with values from 0 to 1; empty for counts
  int decimals;       // of shown values
  BetterValue better;
  std::function<std::optional<double>(const EvaluatedFrame&)> value;  // empty where it was not measured
};

// In the order of the columns of frames.csv. Measures of errors are means over the frame's vertices, cells or
// observations unless their title says otherwise.
const std::vector<EvaluationMeasure>& EvaluationMeasures();

}  // namespace weft
