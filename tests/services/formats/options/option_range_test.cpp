#include "services/formats/options/option_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

using ::testing::StartsWith;

const OptionField& OptionAt(const std::string& path) {
  for (const OptionField& option : AllOptions())
    if (option.path == path) return option;
  ADD_FAILURE() << "no option " << path;
  return AllOptions().front();
}

TEST(OptionRange, UnitsAndRangesAreWords) {
  const OptionField& radius = OptionAt("triangulation.consensus.inlier_radius_mm");
  EXPECT_EQ(radius.Unit(), "mm");
  EXPECT_EQ(radius.Range(), "above 0, at most 1000");
  EXPECT_EQ(OptionAt("triangulation.consensus.min_pair_angle_deg").Range(), "at least 0, below 90");
  EXPECT_EQ(OptionAt("triangulation.consensus.seed").Range(), "");
  EXPECT_TRUE(OptionAt("triangulation.consensus").IsGroup());
}

TEST(OptionRange, BoundsAreInOrOutAsTheRangeSays) {
  v1::PipelineOptions options;
  v1::ConsensusOptions& consensus = *options.mutable_triangulation()->mutable_consensus();
  consensus.set_inlier_radius_mm(1000);
  consensus.set_min_pair_angle_deg(0);
  EXPECT_TRUE(CheckRanges(options).ok());
  consensus.set_inlier_radius_mm(0);
  EXPECT_THAT(std::string(CheckRanges(options).message()),
              StartsWith("triangulation.consensus.inlier_radius_mm: 0 must be above 0, at most 1000"));
  consensus.set_inlier_radius_mm(1);
  consensus.set_min_pair_angle_deg(90);
  EXPECT_THAT(std::string(CheckRanges(options).message()),
              StartsWith("triangulation.consensus.min_pair_angle_deg: 90"));
  consensus.set_min_pair_angle_deg(std::nan(""));
  EXPECT_FALSE(CheckRanges(options).ok());
}

TEST(OptionRange, OptionsThatAreLeftOutHaveNoValueAndNoFault) {
  const OptionField& views = OptionAt("triangulation.consensus.min_views");
  v1::PipelineOptions options;
  EXPECT_EQ(OptionValue(options, views), "");
  EXPECT_EQ(RangeProblem(options, views), "");
  options.mutable_triangulation()->mutable_consensus()->set_min_views(1);
  EXPECT_EQ(OptionValue(options, views), "1");
  EXPECT_EQ(RangeProblem(options, views), "1 must be at least 2, at most 1000");
}

}  // namespace
}  // namespace weft
