#include "services/tools/cli/job_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

v1::FrameInfo DoneFrame(double coverage) {
  v1::FrameInfo info;
  info.set_frame("0007");
  info.set_state(v1::FRAME_STATE_DONE);
  info.set_coverage(coverage);
  info.set_total_ms(1800);
  return info;
}

TEST(FrameLine, SaysWhatWasObservedOfRegisteredFrames) {
  EXPECT_EQ(FrameLine(DoneFrame(0.932), true), "0007    done        93.2 % of the cells     1.8 s");
}

TEST(FrameLine, DrivenFramesHaveNoShareOfCells) {
  EXPECT_EQ(FrameLine(DoneFrame(0), false), "0007    done          1.8 s");
}

TEST(JobText, NamesWhatWasDone) {
  v1::Job job;
  job.mutable_frames()->set_total(12);
  job.mutable_frames()->set_done(12);
  EXPECT_EQ(JobText(job), "12 of 12 frames registered");
  job.mutable_spec()->mutable_driving();
  EXPECT_EQ(JobText(job), "12 of 12 frames driven");
  job.mutable_frames()->set_done(11);
  job.mutable_frames()->set_failed(1);
  EXPECT_THAT(OutcomeOf(job).message(), HasSubstr("could not be driven"));
  EXPECT_THAT(OutcomeOf(job).message(), Not(HasSubstr("registered")));
}

}  // namespace
}  // namespace weft
