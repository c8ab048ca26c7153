// The measures of a frame as numbers: columns of tables, plots, and what comparisons test.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "evaluation/measures.h"
#include "services/results/evaluation/evaluate_frame.h"

namespace weft {

// A measure of FrameMetrics, under its name in evaluation/measures.h and weft.v1.MeasureScore.
struct FrameMetric {
  const char* name;
  std::variant<std::optional<double> FrameMetrics::*, std::optional<int64_t> FrameMetrics::*,
               std::optional<ErrorSummary> FrameMetrics::*>
      field;
};
std::span<const FrameMetric> FrameMetricFields();

struct EvaluationMeasure : Measure {
  std::function<std::optional<double>(const EvaluatedFrame&)> value;  // empty where it was not measured
};

// In the order of evaluation/measures.h, which is that of the columns of frames.csv.
const std::vector<EvaluationMeasure>& EvaluationMeasures();

}  // namespace weft
