#include "capture/calibration/target.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/capture/calibration/simulated_calibration.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(CalibrationTarget, RefusesTagsInMetresAndInMicrometres) {
  CalibrationTarget target{"target", {MakeBoard("A", 0, 6, 5, 0.06)}, {}};
  EXPECT_THAT(std::string(target.Validate().message()), HasSubstr("a tag of 0.06 m has 60"));
  target.boards = {MakeBoard("A", 0, 6, 5, 60'000)};
  EXPECT_THAT(std::string(target.Validate().message()), HasSubstr("lengths are in mm"));
  target.boards = {MakeBoard("A", 0, 6, 5, 60)};
  EXPECT_TRUE(target.Validate().ok());
}

}  // namespace
}  // namespace weft
