// A comparison in which every field has a number of its own.
#pragma once

#include "services/results/evaluation/compare_jobs.h"
#include "tests/services/results/evaluation/sample_evaluation.h"

namespace weft {

inline const EvaluationMeasure& EvaluationMeasureNamed(std::string_view name) {
  for (const EvaluationMeasure& measure : EvaluationMeasures())
    if (measure.name == name) return measure;
  return EvaluationMeasures().front();
}

// Two frames: one that both have, and one without a mesh of B.
inline JobComparison SampleComparison() {
  JobComparison comparison;
  comparison.a = SampleEvaluation(), comparison.b = SampleEvaluation();
  comparison.a.frames[1] = {"0002", {}, {}, {}};
  comparison.b.frames[0].metrics.coverage = 0.25;
  comparison.a.result = "/a", comparison.b.result = "/b";
  comparison.a.remarks = {{"jitter", "of a"}}, comparison.b.remarks = {{"drift", "of b"}};
  comparison.remarks = {{"frames", "1 frame was left out"}};
  comparison.a.cameras = {SampleCamera("c01", 0.25)};
  comparison.b.cameras = {SampleCamera("c01", 0.5), SampleCamera("c02", 1)};
  comparison.differences = {{"preset", "paper", ""}, {"starts", "", "zero"}};
  PairedTest test{.count = 9, .mean = 0.5, .standard_error = 0.0625, .degrees_of_freedom = 6, .p = 0.0125};
  comparison.measures = {
      {&EvaluationMeasureNamed("coverage"), 9, 0.75, 0.25, test, 0.025, ComparisonOutcome::kABetter},
      {&EvaluationMeasureNamed("jitter_observed_mm"), 3, 1.5, 2, std::nullopt, 1,
       ComparisonOutcome::kNotTested}};
  comparison.frames = {{ErrorsAbove(0.5, 30), 0.125}, {}};
  comparison.total = {ErrorsAbove(1, 60), 0.375};
  comparison.maps.distance_mm = {1, 2}, comparison.maps.distance_sigmas = {3, 4};
  comparison.maps.a_minus_b = {{0.5, 0.25}, {5, 6}, {7, 8}, {9, 10}, {11, 12}};
  return comparison;
}

}  // namespace weft
