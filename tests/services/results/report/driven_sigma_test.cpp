#include "services/results/report/driven_sigma.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(DrivenSigma, IsKnownToBeTooSmallBeforeThreeCameras) {
  v1::Job job;
  EXPECT_EQ(DrivenSigmaNote(job), "");
  job.mutable_driven()->add_cameras("c01");
  job.mutable_driven()->add_cameras("c02");
  EXPECT_EQ(DrivenSigmaNote(job), "");
  job.mutable_driven()->add_cameras("c03");
  EXPECT_THAT(DrivenSigmaNote(job), ::testing::HasSubstr("too small before 3 cameras"));
}

}  // namespace
}  // namespace weft
