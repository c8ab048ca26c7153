#include "services/studio/recording/sync_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/median.h"
#include "base/status_macros.h"
#include "capture/take/recorded_take.h"
#include "services/formats/verdict/verdict.h"
#include "services/studio/recording/clock_log.h"
#include "services/studio/recording/common_times.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/recording/take_words.h"

namespace weft {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kManyLost = 0.01;  // of the frames
constexpr double kPtpLimit_us = 100;

// Of the camera's clock against the host's, over the readings that no jump parts.
double Drift_ppm(const std::vector<const ClockReading*>& readings) {
  double seconds = 0, drift_ns = 0;
  for (size_t i = 1; i < readings.size(); ++i) {
    const auto step_ns =
        static_cast<double>(readings[i]->device_minus_host_ns - readings[i - 1]->device_minus_host_ns);
    if (IsClockJump(*readings[i - 1], *readings[i])) continue;
    drift_ns += step_ns;
    seconds += static_cast<double>(readings[i]->host_time_ns - readings[i - 1]->host_time_ns) / 1e9;
  }
  return seconds > 0 ? drift_ns / seconds / 1e3 : 0;
}

// One reading that the next one contradicts is none.
uint32_t JumpsBetween(const std::vector<const ClockReading*>& readings) {
  uint32_t jumps = 0;
  size_t before = 0;
  for (size_t i = 1; i < readings.size(); ++i) {
    const bool jumped = IsClockJump(*readings[before], *readings[i]);
    const bool is_alone = i + 1 < readings.size() && IsClockJump(*readings[i], *readings[i + 1]);
    if (jumped && is_alone) continue;
    jumps += jumped ? 1 : 0;
    before = i;
  }
  return jumps;
}

// `problem`: why no reading counts, empty where they do.
void DescribeClock(const std::string& id, const std::vector<LoggedReading>& all, const std::string& problem,
                   SyncAnalysis& out) {
  std::vector<const ClockReading*> readings;
  for (const LoggedReading& logged : all)
    if (logged.camera_id == id && problem.empty()) readings.push_back(&logged.reading);
  CameraSyncSeries& series = out.series.back();
  v1::CameraClock& clock = *out.report.add_clocks();
  clock.set_camera(id);
  clock.set_readings(readings.size());
  clock.set_problem(problem);
  if (readings.empty()) return;
  Spread ptp_us;
  int64_t best_ns = readings.front()->uncertainty_ns;
  for (const ClockReading* reading : readings) {
    best_ns = std::min(best_ns, reading->uncertainty_ns);
    const std::string& status = reading->ptp_status;
    const int states = clock.ptp_states_size();
    if (!status.empty() && (states == 0 || clock.ptp_states(states - 1) != status))
      clock.add_ptp_states(status);
    series.clock_ms.push_back(
        static_cast<double>(reading->device_minus_host_ns - readings.front()->device_minus_host_ns) / 1e6);
    const bool follows =
        absl::StartsWithIgnoreCase(status, "slave") || absl::EqualsIgnoreCase(status, "master");
    series.ptp_us.push_back(
        reading->ptp_offset_ns && follows ? static_cast<double>(*reading->ptp_offset_ns) / 1e3 : kNone);
    if (std::isfinite(series.ptp_us.back())) ptp_us.Add(series.ptp_us.back());
  }
  clock.set_minus_host_first_ms(static_cast<double>(readings.front()->device_minus_host_ns) / 1e6);
  clock.set_minus_host_last_ms(static_cast<double>(readings.back()->device_minus_host_ns) / 1e6);
  clock.set_uncertainty_ms(static_cast<double>(best_ns) / 1e6);
  clock.set_drift_ppm(Drift_ppm(readings));
  clock.set_jumps(JumpsBetween(readings));
  clock.set_ptp_offset_rms_us(ptp_us.rms());
  clock.set_ptp_offset_worst_us(ptp_us.worst);
}

// The recorder saw a jump, or the readings show one that it did not see.
void CountJumps(const RecordedTake& take, v1::SyncReport& report) {
  std::map<std::string, uint32_t> seen;
  for (const LedgerEntry& entry : take.ledger()) {
    if (entry.event == LedgerEvent::kDropped)
      report.set_sets_dropped(report.sets_dropped() + entry.last_set - entry.first_set + 1);
    if (absl::StrContains(entry.cause, "its clock jumped")) ++seen[entry.camera_id];
  }
  for (v1::CameraClock& clock : *report.mutable_clocks())
    clock.set_jumps(std::max(clock.jumps(), seen[clock.camera()]));
}

void DescribeSets(const RecordedTake& take, const CommonTimes& times, SyncAnalysis& out) {
  std::vector<double> spreads_ms;
  uint64_t complete = 0;
  for (size_t set = 0; set < take.sets().size(); ++set) {
    out.set_names.push_back(FrameNameOf(take.sets()[set]));
    if (const std::optional<int64_t> spread_ns = times.Spread_ns(set))
      spreads_ms.push_back(static_cast<double>(*spread_ns) / 1e6);
    bool is_complete = true;
    for (size_t camera = 0; camera < take.camera_ids().size(); ++camera) {
      const std::optional<int64_t> time_ns = times.Time_ns(set, camera);
      is_complete = is_complete && time_ns;
      out.series[camera].offset_ms.push_back(
          time_ns ? static_cast<double>(*time_ns - *times.Median_ns(set)) / 1e6 : kNone);
    }
    complete += is_complete ? 1 : 0;
  }
  out.report.set_sets_complete(complete);
  if (spreads_ms.empty()) return;
  out.report.set_spread_median_ms(Median(spreads_ms));
  out.report.set_spread_worst_ms(*std::ranges::max_element(spreads_ms));
}

// What is said of one camera, to be put together where others say the same.
using Said = std::vector<std::pair<std::string, std::string>>;

// Frames of the camera that the recorder did not match, in its words.
void FindQuarantined(const RecordedTake& take, Said& said) {
  for (const LedgerEntry& entry : take.ledger())
    if (entry.event == LedgerEvent::kNote && absl::EndsWith(entry.cause, "; they are set aside"))
      said.emplace_back(
          entry.camera_id,
          absl::StrCat(entry.cause, "; look for what sets its clock, or trigger it with the others"));
}

void FindClockFaults(const v1::SyncReport& report, Said& said) {
  for (const v1::CameraClock& clock : report.clocks()) {
    const auto say = [&](const std::string& text) { said.emplace_back(clock.camera(), text); };
    if (clock.ptp_states_size() > 1)
      say("PTP changed its state during the take (" + absl::StrJoin(clock.ptp_states(), ", ") +
          "); check the master and the switch");
    if (clock.ptp_offset_worst_us() > kPtpLimit_us)
      say(absl::StrFormat(
          "up to %.0f us from the PTP master; use a switch with PTP (boundary or transparent clock)",
          clock.ptp_offset_worst_us()));
    if (clock.jumps() > 0)
      say(absl::StrCat("its clock jumped ",
                       clock.jumps() == 1 ? "once" : absl::StrCat(clock.jumps(), " times"),
                       "; synchronize it by PTP, or find what steps the master"));
    if (!clock.problem().empty())
      say(absl::StrCat("its clock cannot be read, ", clock.problem(),
                       ": its times are those of arrival, as even as the network; PTP makes them exact"));
    else if (clock.readings() == 0)
      say("its clock was never read; its times are used unchanged");
  }
}

void FindFaults(const RecordedTake& take, v1::SyncReport& report) {
  Said said;
  FindClockFaults(report, said);
  FindQuarantined(take, said);
  for (const v1::TakeTiming& timing : report.timing()) {
    const auto all = static_cast<double>(timing.frames() + timing.missing());
    if (static_cast<double>(timing.missing()) > kManyLost * all)
      said.emplace_back(timing.camera(), absl::StrCat(WithSeparators(timing.missing()), " of ",
                                                      WithSeparators(timing.frames() + timing.missing()),
                                                      " frames are missing; the causes are below"));
  }
  for (const v1::TakeCamera& camera : report.take().cameras()) {
    for (const v1::TakeTiming& timing : report.timing())
      if (camera.unsynchronized() && timing.camera() == camera.id())
        said.emplace_back(camera.id(),
                          absl::StrFormat("unsynchronized, up to %.1f ms from the time of its set; only "
                                          "a trigger would hold it",
                                          timing.offset_worst_ms()));
  }
  for (std::string& line : CameraLines(said, static_cast<size_t>(report.timing_size())))
    report.add_findings(std::move(line));
  const auto by_arrival = std::ranges::count_if(
      report.clocks(), [](const v1::CameraClock& clock) { return !clock.problem().empty(); });
  if (report.take().own_clocks() && by_arrival < report.clocks_size())
    report.add_findings(
        "the clocks were not synchronized: offsets are good to the uncertainty of their readings; PTP makes "
        "them exact");
}

// The take's own verdict, and how far apart the frames of its sets are.
v1::Verdict AssessSync(const v1::TakeInfo& info, const v1::SyncReport& report) {
  v1::Verdict verdict = info.verdict();
  if (report.spread_median_ms() > 0 || report.sets_complete() > 0) {
    AddCheck(verdict, kSyncSpread, report.spread_median_ms(),
             absl::StrFormat("the cameras of a frame set are %.2f ms apart in the median",
                             report.spread_median_ms()));
  }
  if (!report.findings().empty())
    AddFinding(verdict, v1::GRADE_USABLE, report.findings(0), "See the findings; each says what to do.");
  return verdict;
}

}  // namespace

absl::StatusOr<SyncAnalysis> AnalyzeSync(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(v1::TakeInfo info, DescribeTake(path));
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<RecordedTake> take, RecordedTake::Open(path));
  const std::vector<LoggedReading> readings = ReadClockLog(path, {info.take().clocks_checksum()}).readings;
  SyncAnalysis out;
  v1::SyncReport& report = out.report;
  report.set_path(path);
  *report.mutable_take() = info.take();
  report.set_sets(info.sets());
  *report.mutable_timing() = info.timing();
  *report.mutable_causes() = info.causes();
  *report.mutable_notes() = info.notes();
  const CommonTimes times(*take, readings, info.take());
  for (size_t camera = 0; camera < take->camera_ids().size(); ++camera) {
    const std::string& id = take->camera_ids()[camera];
    std::string problem;
    for (const v1::TakeCamera& described : info.take().cameras())
      if (described.id() == id) problem = described.clock_problem();
    if (problem.empty() && times.AreReadingsWrong(camera))
      problem = "its readings contradict the times of its frames";
    out.series.push_back({id, {}, {}, {}});
    DescribeClock(id, readings, problem, out);
  }
  DescribeSets(*take, times, out);
  CountJumps(*take, report);
  FindFaults(*take, report);
  *report.mutable_verdict() = AssessSync(info, report);
  return out;
}

std::string SyncReportText(const v1::SyncReport& report) {
  std::string text = VerdictText(report.verdict());
  absl::StrAppend(&text, report.path(), ": ", WithSeparators(report.sets()), " frame sets, ",
                  WithSeparators(report.sets_complete()), " of them complete, ",
                  WithSeparators(report.sets_dropped()), " dropped\n");
  if (!report.take().sync().empty()) absl::StrAppend(&text, report.take().sync(), "\n");
  absl::StrAppendFormat(&text, "between the cameras of a set: %.4f ms in the median, %.4f ms at worst\n",
                        report.spread_median_ms(), report.spread_worst_ms());
  int width = 6;
  for (const v1::TakeTiming& timing : report.timing())
    width = std::max(width, static_cast<int>(timing.camera().size()));
  text += absl::StrFormat("%-*s %8s %8s %10s %10s %9s %9s %6s %11s %11s  %s\n", width, "camera", "frames",
                          "missing", "offset ms", "jitter ms", "worst ms", "drift ppm", "jumps", "PTP rms us",
                          "worst us", "PTP");
  const auto number = [](bool is_known, int decimals, double value) {
    return is_known ? absl::StrFormat("%.*f", decimals, value) : std::string("-");
  };
  for (int i = 0; i < report.timing_size(); ++i) {
    const v1::TakeTiming& timing = report.timing(i);
    const v1::CameraClock& clock = report.clocks(i);
    const bool has_ptp = clock.ptp_states_size() > 0, is_read = clock.readings() > 1;
    text += absl::StrFormat(
        "%-*s %8d %8d %10.4f %10.4f %9.4f %9s %6d %11s %11s  %s\n", width, timing.camera(), timing.frames(),
        timing.missing(), timing.offset_mean_ms(), timing.offset_jitter_ms(), timing.offset_worst_ms(),
        number(is_read, 2, clock.drift_ppm()), clock.jumps(), number(has_ptp, 3, clock.ptp_offset_rms_us()),
        number(has_ptp, 3, clock.ptp_offset_worst_us()),
        has_ptp ? absl::StrJoin(clock.ptp_states(), ", ") : "-");
  }
  for (const std::string& line : CauseLines(report.causes())) absl::StrAppend(&text, line, "\n");
  for (const std::string& finding : report.findings()) absl::StrAppend(&text, "finding: ", finding, "\n");
  return text;
}

}  // namespace weft
