#include "services/tools/cli/take_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(TakeText, TellsStateSetsAndDescription) {
  v1::TakeInfo info;
  info.set_path("/t");
  info.mutable_take()->set_id("a");
  info.mutable_take()->set_state(v1::TAKE_STATE_STOPPED);
  info.mutable_take()->set_stop_cause("disk full");
  info.mutable_take()->set_slate("12A");
  info.set_sets(1000);
  info.set_sets_dropped(234);
  info.set_sets_complete(999);
  info.set_bytes(2'500'000'000);
  info.set_duration_s(33.3);
  info.add_notes("clocks jumped");
  const std::string text = TakeInfoText(info);
  EXPECT_THAT(text, HasSubstr("/t: take a, stopped: disk full; 999 of 1,234 sets have all cameras\n"));
  EXPECT_THAT(text, HasSubstr("1,000 frame sets of 0 cameras, 33.3 s, 2.50 GB\n"));
  EXPECT_THAT(text, HasSubstr("\nslate: 12A\n"));
  EXPECT_THAT(text, HasSubstr("\nnote: clocks jumped\n"));
}

// People know the word "complete" of sets.
TEST(TakeText, CallsATakeClosed) {
  v1::TakeInfo info;
  info.mutable_take()->set_state(v1::TAKE_STATE_COMPLETE);
  EXPECT_THAT(TakeInfoText(info), HasSubstr(", closed; "));
}

TEST(TakeText, OfVideosAloneTellsHowTheyCameInStep) {
  v1::Take take;
  take.add_cameras()->set_id("cam");
  EXPECT_EQ(VideoSyncText(take), "");
  v1::CameraSync& sync = *take.mutable_cameras(0)->mutable_sync();
  sync.set_offset_s(0.0125);
  sync.set_found_by("sound");
  EXPECT_THAT(VideoSyncText(take), HasSubstr("    12.500  "));
  EXPECT_THAT(VideoSyncText(take), HasSubstr("sound"));
}

TEST(TakeText, OfARecoveryTellsWhatWouldBeDone) {
  v1::TakeRecoveryReport report;
  report.set_take("/t");
  report.add_changes("cut c01.stream");
  EXPECT_THAT(TakeRecoveryText(report), HasSubstr("\ndone: cut c01.stream\n"));
  report.set_dry_run(true);
  EXPECT_THAT(TakeRecoveryText(report), HasSubstr("\nwould do: cut c01.stream\n"));
  report.set_kept_aside("/t/aside");
  EXPECT_THAT(TakeRecoveryText(report), HasSubstr("`weft take recover --purge /t` removes it\n"));
}

}  // namespace
}  // namespace weft
