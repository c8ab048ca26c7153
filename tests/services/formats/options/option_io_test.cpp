#include "services/formats/options/option_io.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "weft/v1/options.pb.h"

namespace weft {
namespace {

TEST(OptionIo, ReadingKeepsWhatTheMessageLeavesOut) {
  v1::TriangulationOptions message;
  message.mutable_consensus()->set_min_views(5);
  const OptionIo io = OptionIo::Reading(message).At("consensus");
  int min_views = 3;
  double radius_mm = 7;
  io("min_views", min_views);
  io("inlier_radius_mm", radius_mm);
  EXPECT_EQ(min_views, 5);
  EXPECT_DOUBLE_EQ(radius_mm, 7);
}

TEST(OptionIo, WritingMakesGroupsAndAllValues) {
  v1::TriangulationOptions message;
  const OptionIo io = OptionIo::Writing(message).At("consensus");
  double none = 0;
  uint64_t seed = 9;
  io("min_residual_px", none);
  io("seed", seed);
  EXPECT_TRUE(message.consensus().has_min_residual_px());
  EXPECT_EQ(message.consensus().seed(), 9u);
}

TEST(OptionIo, NamesAndTypesThatTheMessageLacksAreMistakesOfTheProgram) {
  const v1::TriangulationOptions message;
  const OptionIo io = OptionIo::Reading(message).At("consensus");
  double number = 0;
  EXPECT_THROW(io("no_such_option", number), std::logic_error);
  EXPECT_THROW(io("min_views", number), std::logic_error);
  EXPECT_THROW(io.At("min_views"), std::logic_error);
}

}  // namespace
}  // namespace weft
