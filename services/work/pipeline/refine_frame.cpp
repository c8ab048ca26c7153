#include "services/work/pipeline/refine_frame.h"

#include <algorithm>
#include <optional>

#include "absl/strings/str_cat.h"
#include "alignment/temporal.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/pipeline/frame_neighbors.h"

namespace weft {
namespace {

// The frames of a job and what their reports say, read when asked for.
class Surroundings {
 public:
  Surroundings(const RegistrationInputs& inputs, const std::vector<size_t>& job_frames,
               const FrameSteps& steps, const TemporalOptions& options, const std::string& out)
      : inputs_(inputs), job_frames_(job_frames), steps_(steps), options_(options), out_(out) {}

  const TemporalOptions& options() const { return options_; }
  int size() const { return static_cast<int>(job_frames_.size()); }
  const FrameSteps& steps() const { return steps_; }
  const std::string& Name(int at) const { return inputs_.dump->frame_names()[job_frames_[at]]; }
  absl::StatusOr<FrameFolder> Folder(int at) const {
    return FrameFolder::Open(out_, Name(at), ConfinedFolder::IfMissing::kFail);
  }
  // Empty while the frame is not complete.
  std::optional<v1::FrameReport> Report(int at) const {
    const absl::StatusOr<FrameFolder> folder = Folder(at);
    if (!folder.ok()) return std::nullopt;
    absl::StatusOr<v1::FrameReport> report = folder->Report();
    if (!report.ok()) return std::nullopt;
    return *std::move(report);
  }
  // The mesh that the frame got on its own. NotFound: it is not there as it was written.
  absl::StatusOr<RegisteredMesh> Unrefined(int at) const {
    return ReadChecked<RegisteredMesh>(at, FrameFile::kUnrefined,
                                       [](const std::string& path) { return ReadRegisteredMesh(path); });
  }
  // Of the frame's cloud, where there is one and the alignment follows them. NotFound as Unrefined.
  absl::StatusOr<std::vector<RayTarget>> Rays(int at) const {
    const std::optional<v1::FrameReport> report = Report(at);
    if (options_.rays.reach_mm == 0 || (report && !Lists(*report, FrameFile::kCloud)))
      return std::vector<RayTarget>();
    WEFT_ASSIGN_OR_RETURN(
        const Cloud cloud,
        ReadChecked<Cloud>(at, FrameFile::kCloud, [](const std::string& path) { return ReadCloud(path); }));
    return TargetsFromCloud(inputs_.garment, cloud).rays;
  }

 private:
  // NotFound: the file is not there as it was written.
  template <typename Result, typename Reader>
  absl::StatusOr<Result> ReadChecked(int at, FrameFile file, const Reader& read) const {
    const absl::StatusOr<FrameFolder> folder = Folder(at);
    if (!folder.ok()) return absl::NotFoundError(folder.status().message());
    WEFT_ASSIGN_OR_RETURN(const v1::FrameReport report, folder->Report());
    if (const std::string problem = folder->Check(file, report); !problem.empty())
      return absl::NotFoundError(absl::StrCat(folder->path(), ": ", problem));
    return read(folder->PathOf(file));  // a path that lasts as long as the folder is open
  }

  const RegistrationInputs& inputs_;
  const std::vector<size_t>& job_frames_;
  const FrameSteps& steps_;
  const TemporalOptions& options_;
  const std::string& out_;
};

absl::StatusOr<TemporalResult> Compute(const RegistrationInputs& inputs, const Surroundings& frames, int at,
                                       bool bridge, const Neighbors& neighbors, const std::stop_token& stop) {
  WEFT_ASSIGN_OR_RETURN(const RegisteredMesh previous, frames.Unrefined(neighbors.previous));
  WEFT_ASSIGN_OR_RETURN(const RegisteredMesh next, frames.Unrefined(neighbors.next));
  const TemporalOptions& options = frames.options();
  const auto cancelled = [&stop] { return stop.stop_requested(); };
  if (bridge) {
    const auto steps = [&](int from, int to) {
      const int64_t way = frames.steps().Between(static_cast<size_t>(from), static_cast<size_t>(to));
      return static_cast<int>(std::max<int64_t>(way, 1));
    };
    const Gap gap{steps(neighbors.previous, at), steps(at, neighbors.next)};
    return BridgeInTime(*inputs.model, previous, next, gap, options, cancelled);
  }
  WEFT_ASSIGN_OR_RETURN(const RegisteredMesh own, frames.Unrefined(at));
  WEFT_ASSIGN_OR_RETURN(const std::vector<RayTarget> rays, frames.Rays(at));
  return RefineInTime(*inputs.model, previous, own, next, options, rays, cancelled);
}

// Makes `mesh` the frame's mesh.ply.
absl::Status PutMesh(const RegistrationInputs& inputs, const RegisteredMesh& mesh, const FrameFolder& folder,
                     v1::FrameReport& report) {
  const auto write = [&](const std::string& path) {
    return WriteRegisteredMesh(path, mesh, inputs.garment.rest.faces, inputs.texture);
  };
  return folder.PutMesh(kGarmentMesh, mesh.vertices_mm.size(), inputs.garment.rest.faces, write, report);
}

// The state without neighbours.
absl::Status Undo(const RegistrationInputs& inputs, const Surroundings& frames, int at,
                  const FrameFolder& folder, v1::FrameReport& report) {
  if (report.state() == v1::FRAME_STATE_FAILED) return folder.DropMesh(kGarmentMesh, report);
  WEFT_ASSIGN_OR_RETURN(const RegisteredMesh own, frames.Unrefined(at));
  return PutMesh(inputs, own, folder, report);
}

// The state with both neighbours.
absl::Status Refine(const RegistrationInputs& inputs, const Surroundings& frames, int at,
                    const Neighbors& neighbors, const std::stop_token& stop, const FrameFolder& folder,
                    v1::FrameReport& report) {
  const bool bridge = report.state() == v1::FRAME_STATE_FAILED;
  WEFT_ASSIGN_OR_RETURN(const TemporalResult result, Compute(inputs, frames, at, bridge, neighbors, stop));
  const absl::Status status = PutMesh(inputs, result.mesh, folder, report);
  v1::TemporalReport& temporal = *report.mutable_temporal();
  temporal.set_self_intersections_before(result.untangling.pairs_before);
  temporal.set_self_intersections(result.untangling.pairs_after);
  temporal.set_demoted(result.untangling.demoted_vertices);
  temporal.set_bridged(bridge);
  temporal.set_refined(!bridge);
  temporal.add_neighbors(frames.Name(neighbors.previous));
  temporal.add_neighbors(frames.Name(neighbors.next));
  return status;
}

absl::Status RefineFrame(const RegistrationInputs& inputs, const Surroundings& frames, int at,
                         const std::stop_token& stop) {
  const Stopwatch watch;
  const absl::StatusOr<FrameFolder> folder = frames.Folder(at);
  if (!folder.ok()) return absl::NotFoundError(folder.status().message());
  WEFT_ASSIGN_OR_RETURN(v1::FrameReport report, folder->Report());
  const FrameFacts own = FactsOf(report);
  if (own.frames_alone || (!own.registered && !own.failed)) return absl::OkStatus();
  const Neighbors neighbors =
      FindNeighbors(at, frames.size(), frames.steps(), own, [&](int other) -> std::optional<FrameFacts> {
        const std::optional<v1::FrameReport> there = frames.Report(other);
        if (!there || !FromSameRun(report, *there)) return std::nullopt;
        return FactsOf(*there);
      });
  if (!neighbors.complete || neighbors.window == report.temporal().window()) return absl::OkStatus();
  const bool changed = report.temporal().refined() || report.temporal().bridged();
  report.mutable_temporal()->Clear();
  report.mutable_temporal()->set_window(neighbors.window);
  absl::Status status;
  if (neighbors.previous >= 0 && neighbors.next >= 0) {
    status = Refine(inputs, frames, at, neighbors, stop, *folder, report);
  } else if (changed) {
    status = Undo(inputs, frames, at, *folder, report);
  }
  if (!status.ok()) return folder->InWords(status);
  report.mutable_temporal()->set_time_ms(watch.Ms());
  return folder->Commit(std::move(report));
}

}  // namespace

absl::Status RefineAround(const RegistrationInputs& inputs, const std::vector<size_t>& job_frames,
                          const FrameSteps& steps, size_t at, const TemporalOptions& options,
                          const std::string& out, std::stop_token stop) {
  const Surroundings frames(inputs, job_frames, steps, options, out);
  const int center = static_cast<int>(at);
  for (int i = std::max(0, center - kMaxBridge); i <= std::min(frames.size() - 1, center + kMaxBridge); ++i) {
    if (stop.stop_requested()) return absl::CancelledError("the registration was cancelled");
    const absl::Status status = RefineFrame(inputs, frames, i, stop);
    // A frame that is being computed anew has no mesh for a moment; whoever completes it comes back here. One
    // that somebody removed is found before the job ends (results_check.h).
    if (!status.ok() && !absl::IsNotFound(status)) return status;
  }
  return absl::OkStatus();
}

FrameSteps StepsOf(const RegistrationInputs& inputs, const std::vector<size_t>& job_frames) {
  std::vector<std::string> names;
  for (const size_t frame : job_frames) names.push_back(inputs.dump->frame_names()[frame]);
  return FrameSteps(names);
}

bool WasBridged(const std::string& out, const std::string& frame) {
  const absl::StatusOr<FrameFolder> folder = FrameFolder::Open(out, frame, ConfinedFolder::IfMissing::kFail);
  const absl::StatusOr<v1::FrameReport> report = folder.ok() ? folder->Report() : folder.status();
  return report.ok() && report->temporal().bridged();
}

}  // namespace weft
