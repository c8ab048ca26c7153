#include "services/results/evaluation/field_mean.h"

#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

TEST(FieldMean, EachVertexHasTheMeanOfTheFramesThatMeasuredIt) {
  const double none = std::nan("");
  FieldMean mean;
  mean.Add({1, none, none});
  mean.Add({});
  mean.Add({3, 5, none});
  const std::vector<double> scaled = mean.Mean(10);
  ASSERT_EQ(scaled.size(), 3u);
  EXPECT_DOUBLE_EQ(scaled[0], 20);
  EXPECT_DOUBLE_EQ(scaled[1], 50);
  EXPECT_TRUE(std::isnan(scaled[2]));
}

TEST(FieldMean, OfNothingIsEmpty) { EXPECT_TRUE(FieldMean().Mean().empty()); }

}  // namespace
}  // namespace weft
