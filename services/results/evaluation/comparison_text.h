// A comparison of two results to read on a terminal, as JSON, and as tables of comma-separated values.
#pragma once

#include <string>

#include "services/results/evaluation/compare_jobs.h"
#include "weft/v1/comparison.pb.h"

namespace weft {

// "A is better", "no significant difference".
std::string OutcomeText(ComparisonOutcome outcome);
// "A is better in 3 measures, B in none; 8 show no significant difference".
std::string ComparisonHeadline(const JobComparison& comparison);
// "< 0.001", "0.042". Plain text.
std::string ProbabilityText(double p);

// Both results, what differs in their jobs, a line per measure, the meshes' distance, remarks.
std::string ComparisonTable(const JobComparison& comparison);
v1::Comparison ComparisonMessage(const JobComparison& comparison);

// A line per measure.
std::string ComparisonCsv(const JobComparison& comparison);
// A line per frame: every measure of A and of B, and the meshes' distance.
std::string ComparedFrameCsv(const JobComparison& comparison);
// A line per camera that either rig has.
std::string ComparedCameraCsv(const JobComparison& comparison);
// A line per vertex of A: means over the frames; empty without any.
std::string ComparedVertexCsv(const JobComparison& comparison);

}  // namespace weft
