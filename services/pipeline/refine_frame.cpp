#include "services/pipeline/refine_frame.h"

#include <google/protobuf/util/message_differencer.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>

#include "absl/strings/str_cat.h"
#include "alignment/temporal.h"
#include "services/files/json_file.h"
#include "services/files/mesh_file.h"
#include "services/pipeline/frame_files.h"

namespace weft {
namespace {

using google::protobuf::util::MessageDifferencer;

// The frames of a job and what their reports say, read when asked for.
class Surroundings {
 public:
  Surroundings(const RegistrationInputs& inputs, const std::vector<size_t>& job_frames,
               const std::string& out)
      : inputs_(inputs), job_frames_(job_frames), out_(out) {}

  int size() const { return static_cast<int>(job_frames_.size()); }
  const std::string& Name(int at) const { return inputs_.dump->frame_names()[job_frames_[at]]; }
  std::string File(int at, const char* name) const {
    return (std::filesystem::path(out_) / Name(at) / name).string();
  }
  // Empty while the frame is not complete.
  std::optional<v1::FrameReport> Report(int at) const {
    v1::FrameReport report;
    if (!ReadJsonFile(File(at, "report.json"), report).ok()) return std::nullopt;
    return report;
  }

 private:
  const RegistrationInputs& inputs_;
  const std::vector<size_t>& job_frames_;
  const std::string& out_;
};

// Whether both come from one registration: a neighbour of an earlier run, with other options, is not there
// yet.
bool FromSameRun(v1::FrameReport a, v1::FrameReport b) {
  for (v1::FrameReport* report : {&a, &b}) {
    if (report->options().preset().empty()) report->mutable_options()->set_preset("best");
  }
  return a.weft_version() == b.weft_version() && MessageDifferencer::Equals(a.inputs(), b.inputs()) &&
         MessageDifferencer::Equals(a.options(), b.options());
}

bool Registered(const v1::FrameReport& report) {
  return report.state() == v1::FRAME_STATE_DONE || report.state() == v1::FRAME_STATE_DEGRADED;
}

// The frames that frame `at` depends on: the nearest registered ones on either side, at most `reach` away.
struct Neighbors {
  bool complete = true;  // false while a frame in between is not dealt with
  int previous = -1, next = -1;
  std::string window;
};
Neighbors FindNeighbors(const Surroundings& frames, int at, const v1::FrameReport& own, int reach) {
  Neighbors found;
  found.window = own.images_fingerprint();
  for (const int direction : {-1, 1}) {
    int& neighbor = direction < 0 ? found.previous : found.next;
    for (int step = 1; step <= reach && neighbor < 0; ++step) {
      const int other = at + direction * step;
      if (other < 0 || other >= frames.size()) break;
      const std::optional<v1::FrameReport> report = frames.Report(other);
      if (!report || !FromSameRun(own, *report)) {
        found.complete = false;
        return found;
      }
      if (Registered(*report)) neighbor = other;
      absl::StrAppend(&found.window, " ", report->frame(), ":", report->images_fingerprint());
    }
  }
  return found;
}

absl::StatusOr<TemporalResult> Compute(const RegistrationInputs& inputs, const Surroundings& frames, int at,
                                       bool bridge, const Neighbors& neighbors, const std::stop_token& stop) {
  const absl::StatusOr<RegisteredMesh> previous =
      ReadRegisteredMesh(frames.File(neighbors.previous, "unrefined.ply"));
  if (!previous.ok()) return previous.status();
  const absl::StatusOr<RegisteredMesh> next =
      ReadRegisteredMesh(frames.File(neighbors.next, "unrefined.ply"));
  if (!next.ok()) return next.status();
  const TemporalOptions options;
  const auto cancelled = [&stop] { return stop.stop_requested(); };
  if (bridge) {
    const Gap gap{at - neighbors.previous, neighbors.next - at};
    return BridgeInTime(*inputs.model, *previous, *next, gap, options, cancelled);
  }
  const absl::StatusOr<RegisteredMesh> own = ReadRegisteredMesh(frames.File(at, "unrefined.ply"));
  if (!own.ok()) return own.status();
  return RefineInTime(*inputs.model, *previous, *own, *next, options, cancelled);
}

// The state without neighbours.
absl::Status Undo(const RegistrationInputs& inputs, const Surroundings& frames, int at, bool bridge) {
  const std::string file = frames.File(at, "mesh.ply");
  if (bridge) {
    std::error_code error;
    std::filesystem::remove(file, error);
    return error ? absl::PermissionDeniedError(absl::StrCat(file, ": ", error.message())) : absl::OkStatus();
  }
  const absl::StatusOr<RegisteredMesh> own = ReadRegisteredMesh(frames.File(at, "unrefined.ply"));
  if (!own.ok()) return own.status();
  return WriteRegisteredMesh(file, *own, inputs.garment.rest.faces);
}

absl::Status RefineFrame(const RegistrationInputs& inputs, const Surroundings& frames, int at,
                         const std::stop_token& stop) {
  const auto start = std::chrono::steady_clock::now();
  std::optional<v1::FrameReport> report = frames.Report(at);
  if (!report || report->options().frames_alone()) return absl::OkStatus();
  const bool bridge = report->state() == v1::FRAME_STATE_FAILED;
  if (!bridge && !Registered(*report)) return absl::OkStatus();
  const Neighbors neighbors = FindNeighbors(frames, at, *report, bridge ? kMaxBridge : 1);
  if (!neighbors.complete || neighbors.window == report->temporal().window()) return absl::OkStatus();
  v1::TemporalReport temporal;
  temporal.set_window(neighbors.window);
  if (neighbors.previous >= 0 && neighbors.next >= 0) {
    const absl::StatusOr<TemporalResult> result = Compute(inputs, frames, at, bridge, neighbors, stop);
    if (absl::IsCancelled(result.status())) return result.status();
    // A neighbour that is being computed anew has no mesh for a moment; whoever completes it comes back here.
    if (!result.ok()) return absl::OkStatus();
    const absl::Status written =
        WriteRegisteredMesh(frames.File(at, "mesh.ply"), result->mesh, inputs.garment.rest.faces);
    if (!written.ok()) return written;
    temporal.set_self_intersections_before(result->untangling.pairs_before);
    temporal.set_self_intersections(result->untangling.pairs_after);
    temporal.set_demoted(result->untangling.demoted_vertices);
    temporal.set_bridged(bridge);
    temporal.set_refined(!bridge);
    temporal.add_neighbors(frames.Name(neighbors.previous));
    temporal.add_neighbors(frames.Name(neighbors.next));
  } else if (report->temporal().refined() || report->temporal().bridged()) {
    if (absl::Status status = Undo(inputs, frames, at, bridge); !status.ok()) return status;
  }
  const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - start;
  temporal.set_time_ms(elapsed.count());
  *report->mutable_temporal() = std::move(temporal);
  return WriteJsonFile(frames.File(at, "report.json"), *report);
}

}  // namespace

absl::Status RefineAround(const RegistrationInputs& inputs, const std::vector<size_t>& job_frames, size_t at,
                          const std::string& out, std::stop_token stop) {
  const Surroundings frames(inputs, job_frames, out);
  const int center = static_cast<int>(at);
  for (int i = std::max(0, center - kMaxBridge); i <= std::min(frames.size() - 1, center + kMaxBridge); ++i) {
    if (stop.stop_requested()) return absl::CancelledError("the registration was cancelled");
    if (absl::Status status = RefineFrame(inputs, frames, i, stop); !status.ok()) return status;
  }
  return absl::OkStatus();
}

bool WasBridged(const std::string& out, const std::string& frame) {
  v1::FrameReport report;
  const std::string file = (std::filesystem::path(out) / frame / "report.json").string();
  return ReadJsonFile(file, report).ok() && report.temporal().bridged();
}

}  // namespace weft
