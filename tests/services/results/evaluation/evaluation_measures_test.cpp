#include "services/results/evaluation/evaluation_measures.h"

#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <string>

#include "weft/v1/evaluation.pb.h"

namespace weft {
namespace {

std::optional<double> MeasureOf(const std::string& name, const EvaluatedFrame& frame) {
  for (const EvaluationMeasure& measure : EvaluationMeasures())
    if (measure.name == name) return measure.value(frame);
  ADD_FAILURE() << "no measure " << name;
  return std::nullopt;
}

TEST(EvaluationMeasures, EachHasAColumnOfItsOwn) {
  std::set<std::string> names;
  for (const EvaluationMeasure& measure : EvaluationMeasures())
    EXPECT_TRUE(names.insert(measure.name).second) << measure.name;
}

TEST(EvaluationMeasures, WhatWasNotMeasuredHasNoValue) {
  for (const EvaluationMeasure& measure : EvaluationMeasures())
    EXPECT_FALSE(measure.value({}).has_value()) << measure.name;
}

TEST(EvaluationMeasures, AreTheKeysOfTheJson) {
  std::set<std::string> of_json, of_metrics;
  for (int i = 0; i < v1::MeasureScore::descriptor()->field_count(); ++i)
    of_json.insert(v1::MeasureScore::descriptor()->field(i)->name());
  for (const FrameMetric& metric : FrameMetricFields()) of_metrics.insert(metric.name);
  EXPECT_EQ(of_json, of_metrics);
}

TEST(EvaluationMeasures, ReadThePartsOfTheFrame) {
  EvaluatedFrame frame;
  frame.metrics.coverage = 0.5;
  frame.metrics.two_view_share = 0.25;
  EXPECT_EQ(MeasureOf("coverage", frame), 0.5);
  EXPECT_EQ(MeasureOf("two_view_share", frame), 0.25);
}

}  // namespace
}  // namespace weft
