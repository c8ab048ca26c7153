#include "services/tools/cli/take_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/tools/cli/run_aloud.h"

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

TEST(TakeText, IsWholeOfATakeThatHasAll) {
  const auto info = FromText<v1::TakeInfo>(R"(
    path: "/t" sets: 12 sets_complete: 11 duration_s: 2.04 bytes: 1049999999
    verdict { grade: GRADE_GOOD reason: "all cameras" remedy: "none" }
    take { id: "a" origin: "a hall" state: TAKE_STATE_RECORDING slate: "12A" name: "walk" notes: "wet"
           timecode: "10:00:00:00" timecode_fps: 23.976
           cameras { id: "left" source: "a.mp4" sync { frames: 7 period_ms: 41.7083 offset_s: 0.0125
                     offset_sigma_s: 0.002 found_by: "timecode" timecode: "10:00:00:01" } }
           cameras { id: "a camera" } }
    timing { camera: "left" frames: 12 interval_mean_ms: 41.7083 interval_jitter_ms: 0.25 offset_mean_ms: -0.5 offset_worst_ms: 1.25 }
    timing { camera: "a camera" frames: 11 missing: 1 }
    causes { camera: "left" cause: "3 packets lost" count: 1 }
    notes: "clocks jumped")");
  EXPECT_EQ(TakeInfoText(info),
            "good: all cameras\n"
            "  remedy: none\n"
            "/t: take a, recording; 11 of 12 sets have all cameras\n"
            "12 frame sets of 2 cameras, 2.0 s, 1.05 GB\n"
            "from a hall\n"
            "slate: 12A\nname: walk\nnotes: wet\n"
            "timecode: 10:00:00:00 at 23.976 frames a second\n"
            "camera     frames  missing  interval ms   jitter ms  offset ms   worst ms\n"
            "left           12        0       41.708      0.2500    -0.5000     1.2500\n"
            "a camera       11        1        0.000      0.0000     0.0000     0.0000\n"
            "camera    video   frames   every ms   offset ms  sigma ms  by          timecode\n"
            "left      a.mp4        7     41.708      12.500     2.000  timecode    10:00:00:01\n"
            "left: 1 frame missing, 3 packets lost\n"
            "note: clocks jumped\n");
  EXPECT_EQ(TakeInfoText({}),
            "unknown: \n: take , unspecified; 0 of 0 sets have all cameras\n0 frame sets of 0 cameras, 0.0 "
            "s, 0.00 GB\n"
            "camera   frames  missing  interval ms   jitter ms  offset ms   worst ms\n");
}

TEST(TakeText, ColumnsAreAsWideAsNames) {
  const auto take = FromText<v1::Take>(R"(
    cameras { id: "camera12" source: "GX010001.MP4" sync { frames: 1 } } cameras { id: "c" sync { frames: 2 } })");
  EXPECT_EQ(VideoSyncText(take),
            "camera    video          frames   every ms   offset ms  sigma ms  by          timecode\n"
            "camera12  GX010001.MP4        1      0.000       0.000     0.000              \n"
            "c                             2      0.000       0.000     0.000              \n");
}

TEST(TakeText, OfACheckTellsWhatWasFound) {
  const auto report = FromText<v1::TakeCheckReport>(R"(
    take: "/t" whole: true sets: 5 complete_sets: 4 frames: 9 missing: 1 dropped: 2 bytes: 2500000000
    verdict { grade: GRADE_BAD reason: "a stream is short" } problems: "left.stream ends early" warnings: "padding")");
  EXPECT_EQ(
      TakeCheckText(report),
      "bad: a stream is short\n"
      "/t: whole; 5 frame sets, 4 of them with all cameras; 9 frames intact, 1 missing with a reason, 2 sets "
      "dropped with a cause, 2.50 GB read\n"
      "problem: left.stream ends early\nwarning: padding\n");
}

TEST(TakeText, OfARecoveryIsWhole) {
  const auto report = FromText<v1::TakeRecoveryReport>(R"(
    take: "/t" sets: 5 brought_back: 2 frames_lost: 3 frames_unfinished: 1 damage: "1 KiB of left.stream"
    verdict { grade: GRADE_USABLE reason: "3 frames are lost" })");
  EXPECT_EQ(TakeRecoveryText(report),
            "usable: 3 frames are lost\n"
            "/t: 5 frame sets, 2 of them brought back; 3 frames lost, 1 frames of unfinished sets not there\n"
            "lost: 1 KiB of left.stream\n");
}

}  // namespace
}  // namespace weft
