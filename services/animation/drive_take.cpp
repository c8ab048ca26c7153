#include "services/animation/drive_take.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/stopwatch.h"
#include "services/animation/driven_frame.h"
#include "services/animation/rig_scale.h"
#include "services/job/job_folder.h"
#include "services/job/job_life.h"
#include "services/pipeline/frame_folder.h"
#include "services/pipeline/moved_views.h"
#include "services/pipeline/output_folder.h"
#include "services/pipeline/register_frame.h"
#include "services/report/html_report.h"
#include "services/report/job_verdict.h"

namespace weft {
namespace {

// A writer that was killed lets go of the folder a moment later.
constexpr std::chrono::seconds kDrivePatience{2};

// The views of a frame, decoded.
struct SeenFrame {
  absl::StatusOr<std::string> fingerprint;
  DecodedFrame decoded;
  double decode_ms = 0;
};

SeenFrame Decode(const DriveRequest& request, const DriveInputs& inputs, size_t at,
                 const std::stop_token& stop) {
  const Stopwatch watch;
  const size_t index = inputs.frames[at];
  // Taken first: images that change while they are read must not look like those that were read.
  SeenFrame out{inputs.dump->Fingerprint(index), {}, 0};
  const FrameImages images{inputs.rig, inputs.board, *inputs.dump, index};
  out.decoded = DecodeFrame(images, request.decode, std::nullopt, {}, stop);
  MovedViews moved = MovedViews::Decode(images, request.decode, stop, out.decoded);
  moved.Move(out.decoded.views);
  moved.Describe(out.decoded.reports);
  out.decode_ms = watch.Ms();
  return out;
}

// Decodes the next frame in a thread of its own while the last one is driven.
class DecodeAhead {
 public:
  DecodeAhead(const DriveRequest& request, const DriveInputs& inputs, tbb::task_arena& arena, size_t first,
              const std::stop_token& stop)
      : request_(request), inputs_(inputs), arena_(arena), stop_(stop), next_(first) {
    Begin();
  }
  ~DecodeAhead() {
    if (coming_.valid()) coming_.wait();
  }
  DecodeAhead(const DecodeAhead&) = delete;
  DecodeAhead& operator=(const DecodeAhead&) = delete;

  SeenFrame Take() {
    SeenFrame seen = coming_.get();
    ++next_;
    Begin();
    return seen;
  }

 private:
  void Begin() {
    if (next_ >= inputs_.frames.size() || stop_.stop_requested()) return;
    coming_ = std::async(std::launch::async, [this, at = next_] {
      std::optional<SeenFrame> seen;
      arena_.execute([&] { seen.emplace(Decode(request_, inputs_, at, stop_)); });
      return *std::move(seen);
    });
  }

  const DriveRequest& request_;
  const DriveInputs& inputs_;
  tbb::task_arena& arena_;
  const std::stop_token& stop_;
  size_t next_;
  std::future<SeenFrame> coming_;
};

class TakeDrive {
 public:
  TakeDrive(const DriveRequest& request, const DriveInputs& inputs, SparseViewDriver driver, std::string out,
            const DriveProgress& progress, const std::stop_token& stop)
      : request_(request),
        inputs_(inputs),
        out_(std::move(out)),
        key_(DriveKey(request, inputs)),
        progress_(progress),
        stop_(stop),
        driver_(std::move(driver)),
        life_(NewJob(), FrameNames()),
        folder_(out_, "weft avatar drive") {}

  absl::StatusOr<v1::Job> Run() {
    life_.Start();
    absl::Status status = folder_.Take(kDrivePatience);
    if (status.ok()) status = folder_.WriteJob(life_.Describe());
    if (!status.ok()) return status;
    folder_.Clean(life_.frames().infos());
    status = DriveAll();
    if (absl::IsCancelled(status)) {
      life_.EndEarly(v1::JOB_STATE_CANCELLED, "cancelled");
    } else if (!status.ok()) {
      life_.EndEarly(v1::JOB_STATE_FAILED, std::string(status.message()));
    }
    v1::Job job = life_.Outcome({});
    const JobEndings endings{AssessJobFolder, WriteJobReport};
    const absl::Status written = folder_.Finish(life_.frames().infos(), endings, job);
    if (!status.ok() && !absl::IsCancelled(status)) return status;
    if (!written.ok()) return written;
    return job;
  }

 private:
  v1::Job NewJob() const {
    v1::Job job;
    job.set_id(absl::StrCat("local-", HostTime_ns() / 1'000'000'000));
    *job.mutable_spec() = request_.spec;
    *job.mutable_inputs() = inputs_.hashes;
    job.mutable_warnings()->Add(inputs_.warnings.begin(), inputs_.warnings.end());
    v1::DrivenJob& driven = *job.mutable_driven();
    driven.set_avatar(request_.avatar);
    driven.set_avatar_checksum(inputs_.avatar.about.space_checksum());
    for (const CameraModel& camera : inputs_.rig.cameras) driven.add_cameras(camera.id);
    return job;
  }

  std::vector<std::string> FrameNames() const {
    std::vector<std::string> names;
    for (const size_t index : inputs_.frames) names.push_back(inputs_.dump->frame_names()[index]);
    return names;
  }

  // Which frames stand, and from which on the tracker is to know them.
  size_t FindStart() {
    standing_.resize(inputs_.frames.size());
    for (size_t at = 0; at < standing_.size(); ++at) {
      standing_[at] = InspectDrivenFrame(request_, inputs_, at, key_, out_);
    }
    const auto missing = std::find_if(standing_.begin(), standing_.end(),
                                      [](const DrivenStanding& frame) { return !frame.complete; });
    if (missing == standing_.end()) return standing_.size();
    auto start = static_cast<size_t>(missing - standing_.begin());
    while (start > 0 &&
           !(start < standing_.size() && standing_[start].complete && standing_[start].started_anew))
      --start;
    return start;
  }

  absl::Status DriveAll() {
    const size_t start = FindStart();
    for (size_t at = 0; at < start; ++at)
      if (absl::Status status = Reuse(at); !status.ok()) return status;
    if (start == inputs_.frames.size()) return absl::OkStatus();
    const int threads = request_.threads > 0 ? request_.threads : tbb::info::default_concurrency();
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(threads) + 1);
    tbb::task_arena decoding(threads), driving(threads);
    DecodeAhead ahead(request_, inputs_, decoding, start, stop_);
    for (size_t at = start; at < inputs_.frames.size(); ++at) {
      if (stop_.stop_requested()) return absl::CancelledError("the driving was cancelled");
      const Stopwatch watch;
      const SeenFrame seen = ahead.Take();
      if (stop_.stop_requested()) return absl::CancelledError("the driving was cancelled");
      absl::Status status;
      driving.execute([&] { status = DriveOne(at, seen, watch); });
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  absl::Status Reuse(size_t at) {
    const auto folder =
        FrameFolder::Open(out_, life_.frames().infos()[at].frame(), ConfinedFolder::IfMissing::kFail);
    if (!folder.ok()) return folder.status();
    const absl::StatusOr<v1::FrameReport> report = folder->Report();
    if (!report.ok()) return report.status();
    Finish(at, SummaryOf(*report, /*reused=*/true));
    return absl::OkStatus();
  }

  absl::Status DriveOne(size_t at, const SeenFrame& seen, const Stopwatch& watch) {
    if (!seen.fingerprint.ok()) return seen.fingerprint.status();
    if (absl::Status status = CheckScaleOnce(seen.decoded.views); !status.ok()) return status;
    std::vector<DrivingView> views;
    for (const ViewObservations& view : seen.decoded.views)
      views.push_back({&inputs_.rig.cameras[static_cast<size_t>(view.camera)], view.observations});
    const absl::StatusOr<DrivenFrame> driven = driver_.Drive(inputs_.time_ns[at], views);
    if (!driven.ok()) return driven.status();
    v1::FrameReport report =
        DescribeDriven(request_, inputs_, at, key_, *seen.fingerprint, seen.decoded, *driven);
    const auto add_time = [&report](const std::string& stage, double time_ms) {
      v1::StageTime& time = *report.add_stages();
      time.set_stage(stage);
      time.set_time_ms(time_ms);
    };
    add_time("decode", seen.decode_ms);
    for (const StageTime& stage : driven->times) add_time(stage.name, stage.time_ms);
    report.set_total_ms(watch.Ms());
    report.set_threads(tbb::this_task_arena::max_concurrency());
    if (standing_[at].complete) return Reuse(at);
    if (absl::Status status = WriteDriven(inputs_, seen.decoded, *driven, report, out_); !status.ok())
      return status;
    Finish(at, SummaryOf(report, /*reused=*/false));
    return absl::OkStatus();
  }

  // The first frame that tells the unit of the rig.
  absl::Status CheckScaleOnce(const std::vector<ViewObservations>& views) {
    if (knows_scale_) return absl::OkStatus();
    const std::optional<double> scale = RigScale(inputs_.rig, views, inputs_.garment, inputs_.graph);
    if (!scale) return absl::OkStatus();
    knows_scale_ = true;
    return CheckRigScale(*scale, request_.spec.rig(), request_.spec.garment());
  }

  void Finish(size_t at, const v1::FrameInfo& info) {
    life_.frames().Finish(at, info);
    if (progress_) progress_(++done_, inputs_.frames.size(), info);
  }

  const DriveRequest& request_;
  const DriveInputs& inputs_;
  const std::string out_, key_;
  const DriveProgress& progress_;
  const std::stop_token& stop_;
  SparseViewDriver driver_;
  JobLife life_;
  JobFolder folder_;
  std::vector<DrivenStanding> standing_;
  bool knows_scale_ = false;
  size_t done_ = 0;
};

}  // namespace

absl::StatusOr<v1::Job> DriveTake(const DriveRequest& request, const DriveProgress& progress,
                                  const std::stop_token& stop) {
  const absl::StatusOr<std::unique_ptr<DriveInputs>> inputs = LoadDriveInputs(request);
  if (!inputs.ok()) return inputs.status();
  if (absl::Status status = CheckOutOfInputs(request.spec); !status.ok()) return status;
  absl::StatusOr<SparseViewDriver> driver =
      SparseViewDriver::Create((*inputs)->garment, (*inputs)->avatar.avatar);
  if (!driver.ok()) return driver.status();
  absl::StatusOr<std::string> out = MakeOutputFolder(request.spec.out());
  if (!out.ok()) return out.status();
  TakeDrive drive(request, **inputs, *std::move(driver), *std::move(out), progress, stop);
  return drive.Run();
}

}  // namespace weft
