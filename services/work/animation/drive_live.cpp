#include "services/work/animation/drive_live.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "base/natural_order.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "capture/take/open_dump.h"
#include "capture/take/take_files.h"
#include "capture/take/take_progress.h"
#include "services/formats/files/frame_folders.h"
#include "services/results/report/job_report.h"
#include "services/results/report/job_verdict.h"
#include "services/studio/recording/take_verdict.h"
#include "services/work/animation/camera_feed.h"
#include "services/work/animation/drive_inputs.h"
#include "services/work/animation/driver_memory.h"
#include "services/work/animation/frame_driver.h"
#include "services/work/animation/live_feed.h"
#include "services/work/job/job_folder.h"
#include "services/work/job/job_life.h"
#include "services/work/pipeline/output_folder.h"
#include "services/work/pipeline/register_frame.h"

namespace weft {
namespace {

v1::Job NewDriveJob(const v1::RegistrationSpec& spec, const DriveInputs& inputs) {
  v1::Job job = NewLocalJob(spec, inputs.hashes, inputs.warnings);
  *job.mutable_driven() = DescribeDriving(spec, inputs);
  return job;
}

// A writer that was killed lets go of the folder a moment later.
constexpr std::chrono::seconds kLivePatience{2};

// Latencies and rate so far.
class Pace {
 public:
  void Add(const LiveFrame& frame, int64_t done_ns) {
    arrived_ += 1 + frame.passed_over;
    passed_over_ += frame.passed_over;
    if (!first_ns_) first_ns_ = frame.arrived_ns;
    last_ns_ = done_ns;
    latency_ms_.push_back(1e-6 * static_cast<double>(done_ns - frame.arrived_ns));
  }
  v1::LiveDriving Describe() const {
    v1::LiveDriving out;
    out.set_frames_arrived(arrived_);
    out.set_frames_passed_over(passed_over_);
    if (latency_ms_.empty()) return out;
    std::vector<double> sorted = latency_ms_;
    std::ranges::sort(sorted);
    out.set_latency_median_ms(sorted[sorted.size() / 2]);
    out.set_latency_p95_ms(sorted[std::min(sorted.size() - 1, sorted.size() * 95 / 100)]);
    const double took_s = 1e-9 * static_cast<double>(last_ns_ - *first_ns_);
    if (took_s > 0) out.set_frames_per_s(static_cast<double>(sorted.size()) / took_s);
    return out;
  }

 private:
  int arrived_ = 0, passed_over_ = 0;
  std::optional<int64_t> first_ns_;
  int64_t last_ns_ = 0;
  std::vector<double> latency_ms_;
};

// A frame that arrived, with its views decoded.
struct Arrival {
  LiveFrame frame;
  SeenFrame seen;
  Stopwatch since;  // its decoding began
};

class LiveRun {
 public:
  LiveRun(const LiveDriveRequest& request, const DriveInputs& inputs, StageKeys keys, std::string out,
          std::vector<v1::FrameReport> standing, const LiveDriveProgress& progress,
          const std::stop_token& stop)
      : inputs_(inputs),
        keys_(std::move(keys)),
        out_(std::move(out)),
        progress_(progress),
        stop_(stop),
        standing_(std::move(standing)),
        life_(NewDriveJob(request.spec, inputs), std::vector<std::string>()),
        folder_(out_, "weft avatar drive --live") {}

  absl::StatusOr<v1::Job> Run(LiveFeed& feed, int threads) {
    life_.Start();
    absl::Status status = folder_.Take(kLivePatience);
    for (const v1::FrameReport& report : standing_) Append(SummaryOf(report, /*reused=*/true));
    if (status.ok()) status = folder_.WriteJob(life_.Describe());
    if (!status.ok()) return status;
    folder_.Clean(life_.frames().infos());
    status = DriveAll(feed, threads);
    if (!status.ok()) life_.Abort(v1::JOB_STATE_FAILED, std::string(status.message()));
    v1::Job job = life_.Outcome({});
    *job.mutable_driven()->mutable_live() = pace_.Describe();
    const JobEndings endings{AssessJobFolder, WriteJobReport};
    const absl::Status written = folder_.Finish(life_.frames().infos(), endings, job);
    if (!status.ok()) return status;
    if (!written.ok()) return written;
    return job;
  }

 private:
  absl::Status DriveAll(LiveFeed& feed, int threads) {
    absl::StatusOr<FrameDriver> driver = FrameDriver::Create(life_.job().spec(), inputs_, keys_, out_);
    if (!driver.ok()) return driver.status();
    if (!standing_.empty())
      WEFT_RETURN_IF_ERROR(driver->Restore(standing_.back().driven().memory(), standing_.back().frame()));
    const int cores = threads > 0 ? threads : tbb::info::default_concurrency();
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(cores) + 1);
    tbb::task_arena decoding(cores), driving(cores);
    const auto decode_newest = [&] { return DecodeNewest(feed, decoding); };
    auto coming = std::async(std::launch::async, decode_newest);
    std::future<absl::Status> writing;  // of the frame before
    const auto settle = [&writing] { return writing.valid() ? writing.get() : absl::OkStatus(); };
    for (;;) {
      absl::StatusOr<std::optional<Arrival>> arrival = coming.get();
      const bool has_frame = arrival.ok() && arrival->has_value();
      std::optional<absl::StatusOr<FrameDriver::Driven>> driven;
      if (has_frame) {
        coming = std::async(std::launch::async, decode_newest);
        driving.execute([&] { driven.emplace(driver->Drive((**arrival).seen, (**arrival).since)); });
      }
      absl::Status status = settle();
      if (status.ok()) status = arrival.status();
      if (status.ok() && driven) status = driven->status();
      if (!status.ok() || !has_frame) {
        failed_ = true;  // the future waits for the decoding
        return status;
      }
      writing = std::async(std::launch::async,
                           [this, &driver, of = std::move(**arrival), result = **std::move(driven)] {
                             return WriteOne(of, result, *driver);
                           });
    }
  }

  absl::StatusOr<std::optional<Arrival>> DecodeNewest(LiveFeed& feed, tbb::task_arena& arena) {
    WEFT_ASSIGN_OR_RETURN(std::optional<LiveFrame> frame, feed.Newest(stop_));
    if (!frame.has_value() || stop_.stop_requested() || failed_) return std::nullopt;
    std::optional<Arrival> out;
    const Stopwatch watch;
    arena.execute([&] {
      out = Arrival{*frame, SeeFrame(inputs_, *frame->source, frame->index, frame->time_ns, stop_), watch};
    });
    if (stop_.stop_requested()) return std::nullopt;
    return out;
  }

  // Alone with counts and frames of the job while one is written.
  absl::Status WriteOne(const Arrival& arrival, const FrameDriver::Driven& driven,
                        const FrameDriver& driver) {
    WEFT_RETURN_IF_ERROR(driver.Write(arrival.seen, driven));
    const int64_t done_ns = HostTime_ns();
    pace_.Add(arrival.frame, done_ns);
    v1::FrameInfo info = SummaryOf(driven.report, /*reused=*/false);
    info.set_latency_s(1e-9 * static_cast<double>(done_ns - arrival.frame.arrived_ns));
    Append(info);
    life_.frames().SetLatency(life_.frames().infos().size() - 1, info.latency_s());
    if (progress_) progress_(pace_.Describe(), info);
    return absl::OkStatus();
  }

  void Append(const v1::FrameInfo& info) {
    life_.Append({info.frame()});
    const size_t position = life_.frames().infos().size() - 1;
    life_.frames().Start(position);
    life_.frames().Finish(position, info);
  }

  const DriveInputs& inputs_;
  const StageKeys keys_;
  const std::string out_;
  const LiveDriveProgress& progress_;
  const std::stop_token& stop_;
  const std::vector<v1::FrameReport> standing_;
  JobLife life_;
  JobFolder folder_;
  Pace pace_;
  std::atomic<bool> failed_ = false;
};

// Results of an earlier part of this run, in their order.
absl::StatusOr<std::vector<v1::FrameReport>> CachedFrames(const v1::RegistrationSpec& spec,
                                                          const std::string& out, const StageKeys& keys,
                                                          const FrameSource* dump) {
  std::vector<v1::FrameReport> standing;
  const absl::StatusOr<std::vector<std::string>> listed = ListFrameFolders(out, FrameFile::kReport);
  if (!listed.ok() || listed->empty()) return standing;
  std::vector<std::string> names = *listed;
  std::ranges::sort(names, NaturalLess);
  std::string memory;
  for (const std::string& name : names) {
    std::optional<v1::FrameReport> report;
    if (dump != nullptr) {
      const auto& of_dump = dump->frame_names();
      const auto found = std::ranges::find(of_dump, name);
      if (found != of_dump.end())
        report = CachedReport(out, name, keys,
                              dump->Fingerprint(static_cast<size_t>(found - of_dump.begin())).value_or(""),
                              spec.options().write_observations());
    }
    if (!report || report->driven().follows() != MemoryChecksum(memory))
      return absl::FailedPreconditionError(absl::StrCat(
          out, ": holds frame ", name, " of another run, after which this one cannot go on; choose another ",
          "folder, or drive without --live, which drives every frame anew"));
    memory = report->driven().memory();
    standing.push_back(*std::move(report));
  }
  return standing;
}

bool IsGrowing(const std::string& take) {
  if (!IsRecordedTake(take) || !IsBeingRecorded(take)) return false;
  const absl::StatusOr<TakeProgress> progress = ReadTakeProgress(take);
  return progress.ok() && !progress->closed;
}

absl::Status CheckLiveRequest(const LiveDriveRequest& request, bool is_followed) {
  if (!(request.speed > 0)) return absl::InvalidArgumentError("--speed must be positive");
  const v1::RegistrationSpec& spec = request.spec;
  const bool is_live = is_followed || !request.session_file.empty();
  if (is_live && (!spec.frames().empty() || spec.first_frame() != 0 || spec.end_frame() != 0))
    return absl::InvalidArgumentError("--frames: frames that are still to come cannot be chosen");
  if (is_live && request.speed != 1)
    return absl::InvalidArgumentError("--speed: cameras film as fast as they do; it is for recordings");
  return absl::OkStatus();
}

}  // namespace

std::string LiveDrivingText(const v1::LiveDriving& live) {
  return absl::StrFormat("latency %.0f ms (median), %.0f ms (95 %%), %.1f frames/s, %d of %d passed over",
                         live.latency_median_ms(), live.latency_p95_ms(), live.frames_per_s(),
                         live.frames_passed_over(), live.frames_arrived());
}

absl::StatusOr<v1::Job> DriveLive(const LiveDriveRequest& request, const LiveDriveProgress& progress,
                                  const std::stop_token& stop) {
  const v1::RegistrationSpec& spec = request.spec;
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<DriveInputs> inputs, LoadDriveInputs(spec));
  const bool films = !request.session_file.empty(), is_followed = !films && IsGrowing(spec.dump());
  WEFT_RETURN_IF_ERROR(CheckLiveRequest(request, is_followed));
  WEFT_RETURN_IF_ERROR(CheckOutOfInputs(spec));
  WEFT_ASSIGN_OR_RETURN(std::string out, MakeOutputFolder(spec.out()));
  const StageKeys keys = DriveKeys(spec, *inputs, DrivePace::kLive);
  const double fps = spec.driving().fps() > 0 ? spec.driving().fps() : inputs->avatar.avatar.fps;

  DriveFrameList list;
  std::shared_ptr<const FrameSource> dump;
  if (!films && !is_followed) {
    WEFT_ASSIGN_OR_RETURN(list, ListDriveFrames(spec, *inputs));
    dump = list.dump;
  } else if (is_followed) {
    // None before its first frame set.
    if (absl::StatusOr<std::unique_ptr<FrameSource>> so_far = OpenDump(spec.dump(), inputs->rig); so_far.ok())
      dump = *std::move(so_far);
  }
  WEFT_ASSIGN_OR_RETURN(std::vector<v1::FrameReport> standing, CachedFrames(spec, out, keys, dump.get()));
  const std::string last = standing.empty() ? "" : standing.back().frame();
  std::unique_ptr<LiveFeed> feed;
  CameraFeed* cameras = nullptr;
  if (films) {
    WEFT_ASSIGN_OR_RETURN(auto started,
                          CameraFeed::Start(request.session_file, spec.dump(), inputs->rig, fps));
    cameras = started.get();
    feed = std::move(started);
  } else if (is_followed) {
    feed = FollowTake(spec.dump(), inputs->rig, last, fps);
  } else {
    size_t first = 0;
    while (first < list.size() && !last.empty() && !NaturalLess(last, list.NameOf(first))) ++first;
    list.indices.erase(list.indices.begin(), list.indices.begin() + static_cast<std::ptrdiff_t>(first));
    list.time_ns.erase(list.time_ns.begin(), list.time_ns.begin() + static_cast<std::ptrdiff_t>(first));
    feed = PlayFrames(std::move(list), request.speed);
  }
  absl::StatusOr<v1::Job> job =
      LiveRun(request, *inputs, keys, std::move(out), std::move(standing), progress, stop)
          .Run(*feed, request.threads);
  if (cameras == nullptr) return job;
  const absl::StatusOr<v1::Take> take = cameras->Finish();
  if (job.ok() && !take.ok()) return take.status();
  if (job.ok() && !take->stop_cause().empty())
    job->add_warnings(absl::StrCat("the take: ", take->stop_cause()));
  return job;
}

}  // namespace weft
