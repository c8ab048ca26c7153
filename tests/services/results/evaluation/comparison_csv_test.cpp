#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "services/results/evaluation/comparison_text.h"

namespace weft {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

TEST(ComparisonCsv, VerticesHaveEmptyFieldsWhereNothingWasMeasured) {
  JobComparison comparison;
  EXPECT_EQ(ComparedVertexCsv(comparison), "");
  comparison.maps.distance_mm = {1.5, std::nan("")};
  comparison.maps.a_minus_b.error_mm = {-2};
  EXPECT_THAT(ComparedVertexCsv(comparison), EndsWith("\n0,1.5,,,-2,,,\n1,,,,,,,\n"));
}

TEST(ComparisonCsv, CamerasOfEitherRigHaveALine) {
  JobComparison comparison;
  comparison.a.cameras.emplace_back().camera_id = "only a";
  comparison.b.cameras.emplace_back().camera_id = "b,2";
  const std::string csv = ComparedCameraCsv(comparison);
  EXPECT_THAT(csv, HasSubstr("\n\"b,2\",,,,,,0,,,,\n"));
  EXPECT_THAT(csv, HasSubstr("\nonly a,0,,,,,,,,,\n"));
}

TEST(ComparisonCsv, MeasuresThatWereNotTestedHaveNoProbability) {
  JobComparison comparison;
  ComparedMeasure& compared = comparison.measures.emplace_back();
  compared.measure = &EvaluationMeasures().front();
  compared.frames = 3, compared.a = 0.75, compared.b = 0.5;
  EXPECT_THAT(ComparisonCsv(comparison), HasSubstr(",3,0.75,0.5,0.25,,,,,not tested\n"));
}

TEST(ComparisonCsv, LinesOfFramesHaveTheColumnsOfTheirHeading) {
  JobComparison comparison;
  comparison.a.frames.emplace_back().frame = "7";
  comparison.b.frames.emplace_back().frame = "7";
  comparison.frames.emplace_back().beyond_sigmas_share = 0.25;
  const std::string csv = ComparedFrameCsv(comparison);
  const size_t heading = csv.find('\n') + 1;
  EXPECT_EQ(std::count(csv.begin(), csv.begin() + static_cast<std::ptrdiff_t>(heading), ','),
            std::count(csv.begin() + static_cast<std::ptrdiff_t>(heading), csv.end(), ','));
  EXPECT_THAT(csv, EndsWith(",0.25\n"));
}

}  // namespace
}  // namespace weft
