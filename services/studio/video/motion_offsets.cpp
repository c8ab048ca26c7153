#include "services/studio/video/motion_offsets.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/rig/camera_match.h"
#include "pattern/board/board_index.h"
#include "pattern/view_decoder.h"
#include "services/studio/video/at_once.h"
#include "services/studio/video/camera_offsets.h"
#include "services/studio/video/frame_times.h"
#include "services/studio/video/video_frames.h"
#include "triangulation/time_offsets.h"

namespace weft {
namespace {

constexpr double kWindows[] = {0.5, 0.25, 0.75};  // middles, of the time that the videos share
constexpr double kGoodPeriods = 0.05;             // a worse sigma is worth another window

// Where in each video a window lies.
std::vector<VideoRange> RangesIn(const std::vector<std::vector<double>>& times_s, double middle,
                                 double window_s) {
  double first_s = -INFINITY, last_s = INFINITY;
  for (const std::vector<double>& camera : times_s) {
    first_s = std::max(first_s, camera.front());
    last_s = std::min(last_s, camera.back());
  }
  const double at_s = first_s + middle * (last_s - first_s);
  std::vector<VideoRange> ranges;
  for (const std::vector<double>& camera : times_s) {
    const auto begin = std::ranges::lower_bound(camera, at_s - window_s / 2);
    const auto end = std::upper_bound(begin, camera.end(), at_s + window_s / 2);
    ranges.push_back({static_cast<size_t>(begin - camera.begin()), static_cast<size_t>(end - begin)});
  }
  return ranges;
}

class MotionSearch {
 public:
  MotionSearch(const Rig& rig, const BoardIndex& board, const std::vector<v1::VideoFacts>& videos,
               std::vector<std::vector<double>> times_s, const MotionOffsetOptions& options)
      : rig_(rig), board_(board), videos_(videos), times_s_(std::move(times_s)), options_(options) {}

  // Offsets that remain, by the frames of one window. Errors of VideoFrames and FindTimeOffsets.
  absl::StatusOr<std::vector<TimeOffset>> In(double middle,
                                             const std::function<bool(uint64_t, uint64_t)>& progress) const {
    const std::vector<VideoRange> ranges = RangesIn(times_s_, middle, options_.window_s);
    uint64_t total = 0;
    for (const VideoRange& range : ranges) total += range.count;
    std::atomic<uint64_t> done = 0;
    std::vector<CameraFilm> films(videos_.size());
    WEFT_RETURN_IF_ERROR(
        ForEachAtOnce(videos_.size(), std::max(1U, std::thread::hardware_concurrency()), [&](size_t i) {
          return Decode(i, ranges[i], films[i], [&] {
            const uint64_t so_far = ++done;
            return !progress || progress(so_far, total);
          });
        }));
    TimeOffsetOptions search;
    search.max_offset_s = options_.max_offset_s;
    return FindTimeOffsets(rig_, films, search);
  }

 private:
  absl::Status Decode(size_t video, const VideoRange& range, CameraFilm& film,
                      const std::function<bool()>& done) const {
    const v1::VideoFacts& facts = videos_[video];
    film.camera = rig_.IndexOf(facts.camera());
    film.period_s = std::max(Period_s(facts), 1e-6);
    if (range.count == 0) return absl::OkStatus();
    WEFT_ASSIGN_OR_RETURN(VideoFrames frames, VideoFrames::Start(facts, range, options_.mosaic));
    for (size_t i = 0; i < range.count; ++i) {
      WEFT_ASSIGN_OR_RETURN(const Frame frame, frames.Next());
      WEFT_ASSIGN_OR_RETURN(std::unique_ptr<ViewDecoder> view, ViewDecoder::Read(frame, board_, {}));
      view->Decode();
      film.moments.push_back({times_s_[video][range.first + i], view->TakeResult().observations});
      if (!done()) return absl::CancelledError("stopped");
    }
    return frames.Finish();
  }

  const Rig& rig_;
  const BoardIndex& board_;
  const std::vector<v1::VideoFacts>& videos_;
  const std::vector<std::vector<double>> times_s_;
  const MotionOffsetOptions& options_;
};

std::vector<std::string> NotFound(const std::vector<TimeOffset>& offsets,
                                  const std::vector<v1::VideoFacts>& videos) {
  std::vector<std::string> cameras;
  for (size_t i = 0; i < videos.size(); ++i)
    if (!offsets[i].offset_s) cameras.push_back(videos[i].camera());
  return cameras;
}

double WorstSigma(const std::vector<TimeOffset>& offsets) {
  double worst_s = 0;
  for (const TimeOffset& offset : offsets)
    worst_s = std::max(worst_s, offset.offset_s ? offset.sigma_s : INFINITY);
  return worst_s;
}

}  // namespace

absl::StatusOr<std::vector<v1::CameraSync>> OffsetsByMotion(
    const Rig& rig, const Board& board, const std::vector<v1::VideoFacts>& videos,
    const MotionOffsetOptions& options, const std::function<bool(uint64_t done, uint64_t total)>& progress) {
  WEFT_ASSIGN_OR_RETURN(const BoardIndex index, BoardIndex::Build(board));
  const absl::StatusOr<std::vector<v1::CameraSync>> timecodes = OffsetsByTimecode(videos);
  std::vector<v1::CameraSync> syncs = timecodes.ok() ? *timecodes : OffsetsTogether(videos);
  const MotionSearch search(rig, index, videos, CommonFrameTimes_s(videos, syncs), options);
  std::vector<TimeOffset> best;
  absl::Status status;
  for (const double middle : kWindows) {
    absl::StatusOr<std::vector<TimeOffset>> found = search.In(middle, progress);
    if (!found.ok() && !absl::IsFailedPrecondition(found.status())) return found.status();
    status = found.status();
    if (!found.ok()) continue;
    const bool is_better = best.empty() || NotFound(*found, videos).size() < NotFound(best, videos).size() ||
                           WorstSigma(*found) < WorstSigma(best);
    if (is_better) best = *std::move(found);
    if (WorstSigma(best) <= kGoodPeriods * Period_s(videos.front())) break;
  }
  constexpr const char* kRemedy =
      "; film a moment in which all cameras see the print move, or give offsets (--offset CAMERA=SECONDS)";
  if (best.empty())
    return absl::FailedPreconditionError(
        absl::StrCat("motion does not tell the offsets of the videos: ", status.message(), kRemedy));
  if (const std::vector<std::string> missing = NotFound(best, videos); !missing.empty())
    return absl::FailedPreconditionError(absl::StrCat("motion does not tie ", FirstNames(missing),
                                                      " to the other cameras: too few cells of the print "
                                                      "are seen in common, or the clips are further apart",
                                                      kRemedy));
  for (size_t i = 0; i < videos.size(); ++i) {
    syncs[i].set_offset_s(syncs[i].offset_s() + *best[i].offset_s);
    syncs[i].set_offset_sigma_s(best[i].sigma_s);
    syncs[i].set_found_by(NameOf(SyncWay::kMotion));
  }
  return syncs;
}

}  // namespace weft
