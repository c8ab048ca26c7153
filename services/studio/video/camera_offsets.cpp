#include "services/studio/video/camera_offsets.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "services/studio/video/frame_times.h"
#include "services/studio/video/timecode.h"
#include "services/studio/video/timecode_track.h"

namespace weft {
namespace {

constexpr double kRounding_s = 0.0021;  // Matroska counts milliseconds: two of them are rounded
constexpr double kVaries = 0.02;        // of a period
// Of times that are even within a second or a frame.
const double kUniform = 1 / std::sqrt(12);

struct WayName {
  SyncWay way;
  const char* name;
};
constexpr WayName kWays[] = {
    {SyncWay::kAuto, "auto"},     {SyncWay::kTimecode, "timecode"},    {SyncWay::kLtc, "ltc"},
    {SyncWay::kMotion, "motion"}, {SyncWay::kFileTimes, "file-times"}, {SyncWay::kTogether, "together"}};

struct Distances {
  double middle_s = 0, shortest_s = 0, longest_s = 0;
};

Distances DistancesOf(const v1::VideoFacts& facts) {
  const std::vector<double> times_s = FrameTimes_s(facts);
  Distances distances{Period_s(times_s), INFINITY, 0};
  for (size_t i = 1; i < times_s.size(); ++i) {
    distances.shortest_s = std::min(distances.shortest_s, times_s[i] - times_s[i - 1]);
    distances.longest_s = std::max(distances.longest_s, times_s[i] - times_s[i - 1]);
  }
  return distances;
}

}  // namespace

absl::StatusOr<SyncWay> SyncWayFromName(const std::string& name) {
  std::string names;
  for (const WayName& known : kWays) {
    if (name == known.name) return known.way;
    absl::StrAppend(&names, names.empty() ? "" : ", ", known.name);
  }
  return absl::InvalidArgumentError(absl::StrCat("sync \"", name, "\": must be one of ", names));
}

std::string NameOf(SyncWay way) {
  for (const WayName& known : kWays)
    if (known.way == way) return known.name;
  return "";
}

absl::StatusOr<std::vector<v1::CameraSync>> OffsetsByTimecode(const std::vector<v1::VideoFacts>& videos) {
  std::vector<v1::CameraSync> syncs;
  const std::vector<double> rates = TimecodeRates(videos);
  double first_s = 0;
  for (size_t i = 0; i < videos.size(); ++i) {
    const v1::VideoFacts& video = videos[i];
    const absl::StatusOr<TimecodeAt> label = LabelOf(video, rates[i]);
    if (absl::IsNotFound(label.status()))
      return absl::FailedPreconditionError(absl::StrCat(
          label.status().message(), "; name a rig and a board (--sync motion), or give its offset (--offset ",
          video.camera(), "=SECONDS)"));
    if (!label.ok()) return label.status();
    const Timecode& timecode = label->timecode;
    double day_s = timecode.Seconds();
    if (syncs.empty()) first_s = day_s;
    day_s -= timecode.Day_s() * std::round((day_s - first_s) / timecode.Day_s());  // both sides of midnight
    v1::CameraSync& sync = syncs.emplace_back();
    sync.set_offset_s(day_s - label->at_s);
    // A label may last two frames of the film.
    sync.set_offset_sigma_s(kUniform * std::max(Period_s(video), 1 / timecode.fps));
    sync.set_found_by(NameOf(SyncWay::kTimecode));
  }
  return syncs;
}

absl::StatusOr<std::vector<v1::CameraSync>> OffsetsByFileTimes(const std::vector<v1::VideoFacts>& videos) {
  std::vector<v1::CameraSync> syncs;
  for (const v1::VideoFacts& video : videos) {
    if (video.created_unix_ns() == 0)
      return absl::FailedPreconditionError(
          absl::StrCat(video.path(), ": does not say when it was filmed; use --sync motion or together"));
    v1::CameraSync& sync = syncs.emplace_back();
    sync.set_offset_s(static_cast<double>(video.created_unix_ns() - videos.front().created_unix_ns()) / 1e9 -
                      BeginTime_s(video));
    sync.set_offset_sigma_s(kUniform);
    sync.set_found_by(NameOf(SyncWay::kFileTimes));
  }
  return syncs;
}

std::vector<v1::CameraSync> OffsetsTogether(const std::vector<v1::VideoFacts>& videos) {
  std::vector<v1::CameraSync> syncs;
  for (const v1::VideoFacts& video : videos) {
    v1::CameraSync& sync = syncs.emplace_back();
    sync.set_offset_s(-BeginTime_s(video));
    sync.set_found_by(NameOf(SyncWay::kTogether));
  }
  return syncs;
}

absl::Status UseGivenOffsets(const std::map<std::string, double>& given_s,
                             const std::vector<v1::VideoFacts>& videos, std::vector<v1::CameraSync>& syncs) {
  for (const auto& [camera, offset_s] : given_s) {
    const auto video =
        std::ranges::find_if(videos, [&](const v1::VideoFacts& facts) { return facts.camera() == camera; });
    if (video == videos.end() || !std::isfinite(offset_s))
      return absl::InvalidArgumentError(
          absl::StrCat("--offset ", camera, ": there is no video of this camera"));
    v1::CameraSync& sync = syncs[static_cast<size_t>(video - videos.begin())];
    sync.Clear();
    sync.set_offset_s(offset_s);
    sync.set_found_by("given");
  }
  return absl::OkStatus();
}

void BeginAtZero(const std::vector<v1::VideoFacts>& videos, std::vector<v1::CameraSync>& syncs) {
  double first_s = INFINITY;
  for (size_t i = 0; i < videos.size(); ++i)
    first_s = std::min(first_s, FrameTimes_s(videos[i]).front() + syncs[i].offset_s());
  for (v1::CameraSync& sync : syncs) sync.set_offset_s(sync.offset_s() - first_s);
}

std::vector<std::vector<double>> CommonFrameTimes_s(const std::vector<v1::VideoFacts>& videos,
                                                    const std::vector<v1::CameraSync>& syncs) {
  std::vector<std::vector<double>> all;
  for (size_t i = 0; i < videos.size(); ++i) {
    all.push_back(FrameTimes_s(videos[i]));
    for (double& time_s : all.back()) time_s += syncs[i].offset_s();
  }
  return all;
}

bool HasVariableRate(const v1::VideoFacts& facts) {
  const Distances distances = DistancesOf(facts);
  const double allowed_s = std::max(kRounding_s, kVaries * distances.middle_s);
  return distances.longest_s > 0 && (distances.longest_s - distances.middle_s > allowed_s ||
                                     distances.middle_s - distances.shortest_s > allowed_s);
}

void DescribeTimes(const v1::VideoFacts& facts, v1::CameraSync& sync) {
  const Distances distances = DistancesOf(facts);
  const absl::StatusOr<Timecode> first = TimecodeOfFirst(facts);
  sync.set_timecode(first.ok() ? TimecodeText(*first) : facts.timecode());
  sync.set_period_ms(1e3 * distances.middle_s);
  sync.set_frames(static_cast<uint64_t>(facts.frame_pts_size()));
  if (!HasVariableRate(facts)) return;
  sync.set_shortest_ms(1e3 * distances.shortest_s);
  sync.set_longest_ms(1e3 * distances.longest_s);
}

}  // namespace weft
