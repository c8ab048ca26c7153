#include "services/studio/recording/sync_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "services/studio/recording/clock_log.h"
#include "services/studio/recording/recorder.h"
#include "services/studio/recording/take_file.h"
#include "tests/capture/pattern_frames.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kFramePeriod_ns = 100 * kMs;
constexpr int64_t kEpoch_ns = int64_t{1'700'000'000'000} * kMs;

// Three cameras with a true time of exposure and a clock each: b runs 50 ppm fast from an offset of 5 s and
// jumps back by 3.2 s before set 20; c exposes 2 ms after the others.
class SyncedTake {
 public:
  explicit SyncedTake(bool own_clocks) : own_clocks_(own_clocks), path_(folder_ / "take") {
    RecorderOptions options;
    options.low_disk_bytes = 0;
    options.take.stream.preallocate_bytes = 1 << 20;
    auto recorder = Recorder::Start(path_, {"a", "b", "c"}, options);
    EXPECT_TRUE(recorder.ok()) << recorder.status();
    v1::Take take = NewTake("");
    take.set_own_clocks(own_clocks);
    EXPECT_TRUE(WriteTakeFile(path_, take).ok());
    ClockLog clocks({"a", "b", "c"});
    EXPECT_TRUE(clocks.Open(path_).ok());
    for (uint64_t set = 0; set < 40; ++set) {
      if (set == 20)
        (*recorder)->Note("b",
                          "its clock jumped by -3.200 s; its frames are matched by the time before the jump");
      RawFrameSet frames = frames_.Set(set);
      for (size_t camera = 0; camera < 3; ++camera) {
        const int64_t true_ns =
            kEpoch_ns + static_cast<int64_t>(set) * kFramePeriod_ns + (camera == 2 ? 2 * kMs : 0);
        frames.frames[camera].device_time_ns = true_ns + MinusHost_ns(camera, true_ns, set);
        frames.frames[camera].host_time_ns = true_ns + 3 * kMs;
        if (set % 5 == 0)
          clocks.Add(camera, {true_ns - kMs, MinusHost_ns(camera, true_ns - kMs, set), kMs / 10,
                              set < 10 ? "Uncalibrated" : "Slave", set < 10 ? 9000 : 300});
      }
      if (set == 30) {
        frames.frames.erase(frames.frames.begin());
        frames.missing = {{"a", "packets lost"}};
      }
      EXPECT_TRUE((*recorder)->OfferAndWait(std::move(frames)));
    }
    // An answer that took long says nothing.
    clocks.Add(2, {kEpoch_ns + 12 * kFramePeriod_ns, 40 * kMs, 45 * kMs, "Slave", 300});
    EXPECT_TRUE((*recorder)->Stop().ok());
    SetOutcome((*recorder)->Counters(), take);
    EXPECT_TRUE(clocks.Close().ok());
    take.set_clocks_checksum(clocks.end_checksum());
    EXPECT_TRUE(WriteTakeFile(path_, take).ok());
  }
  const std::string& path() const { return path_; }

 private:
  int64_t MinusHost_ns(size_t camera, int64_t host_ns, uint64_t set) const {
    if (camera != 1) return 0;
    const int64_t own_ns = own_clocks_ ? 5000 * kMs + (host_ns - kEpoch_ns) / 20'000 : 0;
    return own_ns - (set >= 20 ? 3200 * kMs : 0);
  }

  bool own_clocks_;
  TempFolder folder_;
  std::string path_;
  PatternFrames frames_{{"a", "b", "c"}, 64, 40};
};

TEST(SyncReport, PutsClocksOnOneAxisThroughDriftAndJumps) {
  for (const bool own_clocks : {false, true}) {
    const SyncedTake take(own_clocks);
    const absl::StatusOr<SyncAnalysis> analysis = AnalyzeSync(take.path());
    ASSERT_TRUE(analysis.ok()) << analysis.status();
    const v1::SyncReport& report = analysis->report;
    EXPECT_EQ(report.sets(), 40u);
    EXPECT_EQ(report.sets_complete(), 39u);
    EXPECT_NEAR(report.spread_median_ms(), 2, 0.01);
    EXPECT_NEAR(report.timing(1).offset_mean_ms(), 0, 0.1);
    EXPECT_NEAR(report.timing(2).offset_mean_ms(), 2, 0.1);
    EXPECT_NEAR(report.timing(1).interval_mean_ms(), 100, 0.01);
    EXPECT_NEAR(report.clocks(1).drift_ppm(), own_clocks ? 50 : 0, 0.5);
    EXPECT_EQ(report.clocks(1).jumps(), 1u);
    EXPECT_EQ(report.timing(0).missing(), 1u);
    EXPECT_TRUE(std::isnan(analysis->series[0].offset_ms[30]));
  }
}

// As the recorders of 0.1.0 left behind: a clock that answered 0 was written down as one that is at 1970.
TEST(SyncReport, TakesNoReadingThatFramesContradict) {
  const SyncedTake take(false);
  const std::vector<LoggedReading> readings = ReadClockLog(take.path(), {}).readings;
  ASSERT_FALSE(readings.empty());
  {
    ClockLog clocks({"a", "b", "c"});
    ASSERT_TRUE(clocks.Open(take.path()).ok());
    for (const LoggedReading& logged : readings) {
      ClockReading reading = logged.reading;
      if (logged.camera_id == "c") reading.device_minus_host_ns = -reading.host_time_ns;
      clocks.Add(logged.camera_id == "a" ? 0 : logged.camera_id == "b" ? 1 : 2, reading);
    }
  }
  const absl::StatusOr<SyncAnalysis> analysis = AnalyzeSync(take.path());
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  EXPECT_NEAR(analysis->report.timing(2).offset_mean_ms(), 2, 0.1);
  EXPECT_EQ(analysis->report.clocks(2).problem(), "its readings contradict the times of its frames");
  EXPECT_EQ(analysis->report.clocks(0).problem(), "");
  EXPECT_THAT(analysis->report.findings(),
              Contains(HasSubstr("camera c: its clock cannot be read, its readings contradict")));
}

TEST(SyncReport, TellsOfPtpAndWhatToDo) {
  const SyncedTake take(false);
  const absl::StatusOr<SyncAnalysis> analysis = AnalyzeSync(take.path());
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  const v1::SyncReport& report = analysis->report;
  EXPECT_THAT(report.clocks(0).ptp_states(), ElementsAre("Uncalibrated", "Slave"));
  EXPECT_NEAR(report.clocks(0).ptp_offset_rms_us(), 0.3, 1e-6);  // while it followed
  EXPECT_THAT(report.findings(),
              Contains(HasSubstr("camera b: its clock jumped once; synchronize it by PTP")));
  EXPECT_THAT(report.findings(),
              Contains(HasSubstr("3 of 3 cameras (a, b and c): PTP changed its state during the take")));
  EXPECT_THAT(report.findings(), Contains(HasSubstr("camera a: 1 of 40 frames are missing")));
  EXPECT_THAT(SyncReportText(report),
              StartsWith("usable: 39 of 40 frame sets have all cameras; a: 1 frame missing"));
  EXPECT_THAT(SyncReportText(report), HasSubstr("40 frame sets, 39 of them complete, 0 dropped"));
}

// The recorder did not see the jump, clocks.csv has it.
TEST(SyncReport, CountsJumpsThatTheReadingsShow) {
  ClockReading before, after;
  before.host_time_ns = kEpoch_ns;
  before.uncertainty_ns = after.uncertainty_ns = kMs / 10;
  after.host_time_ns = kEpoch_ns + 1000 * kMs;
  for (const auto& [step_ns, is_jump] : std::vector<std::pair<int64_t, bool>>{
           {0, false}, {kMs / 2, false}, {20 * kMs, true}, {-20 * kMs, true}}) {
    after.device_minus_host_ns = step_ns;
    EXPECT_EQ(IsClockJump(before, after), is_jump) << step_ns;
  }
  after.device_minus_host_ns = 20 * kMs;
  after.uncertainty_ns = 30 * kMs;
  EXPECT_FALSE(IsClockJump(before, after)) << "an answer that took long";
}

TEST(SyncReport, DescribesTheClockByItsReadings) {
  const SyncedTake take(true);
  const absl::StatusOr<SyncAnalysis> analysis = AnalyzeSync(take.path());
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  const v1::CameraClock& clock = analysis->report.clocks(1);
  EXPECT_EQ(clock.camera(), "b");
  EXPECT_EQ(clock.readings(), 8u);
  EXPECT_NEAR(clock.minus_host_first_ms(), 5000, 1e-3);
  EXPECT_NEAR(clock.minus_host_last_ms(), 5000 + 3500 / 20e3 - 3200, 1e-3);  // 50 ppm of 3.5 s, and the jump
  EXPECT_DOUBLE_EQ(clock.uncertainty_ms(), 0.1);
  EXPECT_NEAR(clock.ptp_offset_worst_us(), 0.3, 1e-9);
  ASSERT_EQ(analysis->series[1].clock_ms.size(), 8u);
  EXPECT_EQ(analysis->series[1].clock_ms[0], 0);
  EXPECT_NEAR(analysis->series[1].clock_ms[1], 0.025, 1e-3);  // 50 ppm of half a second
  EXPECT_TRUE(std::isnan(analysis->series[1].ptp_us[1]));     // it did not follow yet
  EXPECT_DOUBLE_EQ(analysis->series[1].ptp_us[2], 0.3);
  EXPECT_EQ(analysis->set_names.front(), "0000");
  EXPECT_EQ(analysis->set_names.size(), 40u);
  EXPECT_THAT(analysis->report.findings(), Contains(HasSubstr("the clocks were not synchronized")));
  EXPECT_NEAR(analysis->report.spread_worst_ms(), 2, 0.2);
}

v1::SyncReport ReportOfOneCamera() {
  v1::SyncReport report;
  report.set_path("/t");
  report.set_sets(2000);
  report.set_sets_complete(1999);
  report.set_sets_dropped(3);
  report.set_spread_median_ms(0.5);
  report.set_spread_worst_ms(1.25);
  v1::TakeTiming& timing = *report.add_timing();
  timing.set_camera("c01");
  timing.set_frames(1999);
  timing.set_missing(1);
  timing.set_offset_mean_ms(0.25);
  timing.set_offset_jitter_ms(0.125);
  timing.set_offset_worst_ms(1);
  v1::CameraClock& clock = *report.add_clocks();
  clock.set_camera("c01");
  clock.set_readings(2);
  clock.set_drift_ppm(1.5);
  return report;
}

TEST(SyncReport, TextHasALineForEachCamera) {
  v1::SyncReport report = ReportOfOneCamera();
  EXPECT_THAT(SyncReportText(report),
              HasSubstr("/t: 2,000 frame sets, 1,999 of them complete, 3 dropped\n"
                        "between the cameras of a set: 0.5000 ms in the median, 1.2500 ms at worst\n"));
  EXPECT_THAT(SyncReportText(report), HasSubstr("c01        1999        1     0.2500     0.1250    1.0000    "
                                                "  1.50      0           -           -  -\n"));
  report.mutable_clocks(0)->set_readings(1);
  EXPECT_THAT(SyncReportText(report), HasSubstr("1.0000         -      0"));
  report.mutable_clocks(0)->add_ptp_states("Slave");
  report.mutable_clocks(0)->set_ptp_offset_rms_us(0.25);
  report.mutable_clocks(0)->set_ptp_offset_worst_us(0.5);
  report.mutable_take()->set_sync("free run");
  report.add_findings("of a clock");
  EXPECT_THAT(SyncReportText(report), HasSubstr("      0.250       0.500  Slave\n"));
  EXPECT_THAT(SyncReportText(report), HasSubstr("dropped\nfree run\nbetween"));
  EXPECT_THAT(SyncReportText(report), HasSubstr("finding: of a clock\n"));
}

TEST(SyncReport, NamesCamerasWithoutTriggerAndWithoutReadings) {
  const SyncedTake take(false);
  v1::Take described = ReadTakeFile(take.path()).value();
  for (const char* id : {"a", "b", "c"}) described.add_cameras()->set_id(id);
  described.mutable_cameras(2)->set_unsynchronized(true);
  described.mutable_cameras(1)->set_clock_problem("it reads 0");
  ASSERT_TRUE(WriteTakeFile(take.path(), described).ok());
  const absl::StatusOr<SyncAnalysis> analysis = AnalyzeSync(take.path());
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  EXPECT_EQ(analysis->report.clocks(1).problem(), "it reads 0");
  EXPECT_EQ(analysis->report.clocks(1).readings(), 0u);
  EXPECT_THAT(analysis->report.findings(),
              Contains(HasSubstr("camera c: unsynchronized, up to 2.0 ms from the time of its set")));
  EXPECT_THAT(analysis->report.findings(),
              Contains(HasSubstr("camera b: its clock cannot be read, it reads 0")));
}

// A camera far from its PTP master, one that nobody read, and frames that no set took.
TEST(SyncReport, SaysWhatToDoForEachCamera) {
  const TempFolder folder;
  const std::string path = folder / "take";
  PatternFrames frames({"a", "b"}, 64, 40);
  auto recorder = Recorder::Start(path, {"a", "b"}, SmallRecorder());
  ASSERT_TRUE(recorder.ok()) << recorder.status();
  ASSERT_TRUE(WriteTakeFile(path, NewTake("")).ok());
  ClockLog clocks({"a", "b"});
  ASSERT_TRUE(clocks.Open(path).ok());
  (*recorder)->NoteDropped(0, 2, 0, "no camera delivered a frame");
  (*recorder)->Note("a", "its times are those of no set; they are set aside");
  for (uint64_t set = 3; set < 5; ++set) {
    RawFrameSet both = frames.Set(set);
    for (RawFrame& frame : both.frames)
      frame.device_time_ns = frame.host_time_ns = kEpoch_ns + static_cast<int64_t>(set) * kFramePeriod_ns;
    clocks.Add(0, {kEpoch_ns + static_cast<int64_t>(set) * kFramePeriod_ns, 0, kMs / 10, "Slave",
                   set == 3 ? 100'000 : 250'000});
    EXPECT_TRUE((*recorder)->OfferAndWait(std::move(both)));
  }
  ASSERT_TRUE((*recorder)->Stop().ok());
  ASSERT_TRUE(clocks.Close().ok());
  const auto analysis = AnalyzeSync(path);
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  EXPECT_EQ(analysis->report.sets_dropped(), 3u);
  EXPECT_EQ(analysis->report.sets_complete(), 2u);
  EXPECT_THAT(
      analysis->report.findings(),
      ElementsAre("camera a: up to 250 us from the PTP master; use a switch with PTP (boundary or "
                  "transparent clock)",
                  "camera b: its clock was never read; its times are used unchanged",
                  "camera a: its times are those of no set; they are set aside; look for what sets its "
                  "clock, or trigger it with the others"));
}

TEST(SyncReport, ACameraAloneIsApartByNothing) {
  const TempFolder folder;
  PatternFrames frames({"a"}, 64, 40);
  RecordPattern(folder / "take", frames);
  const auto analysis = AnalyzeSync(folder / "take");
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  EXPECT_EQ(analysis->report.spread_median_ms(), 0);
  EXPECT_EQ(analysis->report.path(), folder / "take");
  EXPECT_TRUE(absl::IsNotFound(AnalyzeSync(folder / "none").status()));
}

}  // namespace
}  // namespace weft
