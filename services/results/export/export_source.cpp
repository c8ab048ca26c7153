#include "services/results/export/export_source.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/natural_order.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/take/frame_range.h"
#include "services/formats/files/frame_meshes.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/listed_file.h"
#include "services/results/evaluation/listed_frames.h"
#include "services/results/export/result_mesh.h"
#include "services/results/report/job_frames.h"
#include "services/results/report/job_summary.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
constexpr size_t kVertexStates = 5;

// Why a job's results are not complete; empty when they are.
std::string Unfinished(const v1::Job& job) {
  switch (job.state()) {
    case v1::JOB_STATE_DONE:
      return "";
    case v1::JOB_STATE_QUEUED:
      return "has not begun";
    case v1::JOB_STATE_CANCELLED:
      return "was cancelled";
    case v1::JOB_STATE_FAILED:
      return absl::StrCat("failed (", job.message(), ")");
    default:
      return absl::StrFormat("has not ended, or was killed (%d of %d frames are done)",
                             job.frames().done() + job.frames().degraded(), job.frames().total());
  }
}

v1::ExportedFrame Describe(const v1::FrameReport& report, const std::string& mesh) {
  v1::ExportedFrame frame;
  frame.set_frame(report.frame());
  frame.set_state(report.state());
  frame.set_bridged(report.temporal().bridged());
  if (IsRegistered(report.state())) frame.set_coverage(report.mesh().coverage());
  if (IsRegistered(report.state()) || report.temporal().bridged()) {
    if (const v1::ResultFile* listed = FindListed(report, MeshFileName(mesh)))
      frame.set_mesh_checksum(listed->checksum());
    // Reports of earlier versions list no files.
    if (frame.mesh_checksum().empty() && report.files_size() > 0)
      frame.set_missing_because(absl::StrCat("it has no mesh ", mesh));
  } else {
    frame.set_missing_because(report.reason().empty() ? "it was not registered" : report.reason());
  }
  return frame;
}

v1::ExportedFrame WithoutReport(const std::string& name) {
  v1::ExportedFrame frame;
  frame.set_frame(name);
  frame.set_missing_because("its report.json is missing, damaged, or of other inputs than the job's");
  return frame;
}

// The names as numbers of frame sets, where these are all in a recorded take.
std::optional<std::vector<int64_t>> NumbersOfSets(const std::vector<v1::ExportedFrame>& frames,
                                                  const std::vector<int64_t>& sets) {
  const std::set<int64_t> known(sets.begin(), sets.end());
  std::vector<int64_t> numbers;
  for (const v1::ExportedFrame& frame : frames) {
    int64_t number = 0;
    if (!absl::SimpleAtoi(frame.frame(), &number) || !known.contains(number)) return std::nullopt;
    numbers.push_back(number);
  }
  return numbers;
}

}  // namespace

absl::StatusOr<ExportSource> ExportSource::Open(const ExportRequest& request) {
  WEFT_RETURN_IF_ERROR(request.Validate());
  ExportSource source;
  source.result_ = request.result;
  source.max_vertices_ = request.max_vertices;
  const FormatTraits& traits = TraitsOf(request.format);
  WEFT_ASSIGN_OR_RETURN(source.transform_,
                        ExportTransform::Make(request.up.value_or(traits.up), request.world_up,
                                              request.unit.value_or(LengthUnit::kMetre)));
  const std::string job_file = (fs::path(request.result) / kJobFile).string();
  if (absl::Status status = ReadJsonFile(job_file, source.job_); absl::IsNotFound(status)) {
    return absl::NotFoundError(
        absl::StrCat(job_file, ": no such file; give the --out folder of `weft register`"));
  } else if (!status.ok()) {
    return status;
  }
  const std::string why = Unfinished(source.job_);
  if (!why.empty() && !request.allow_unfinished) {
    return absl::FailedPreconditionError(
        absl::StrCat(job_file, ": the job ", why,
                     "; let `weft register` finish it, or export what is there with --allow-unfinished"));
  }
  if (!why.empty()) source.notes_.push_back(absl::StrCat("The job ", why, "."));
  WEFT_RETURN_IF_ERROR(source.ListFrames(request));
  source.FindRate(request);
  if (source.fps_ == 0 && traits.needs_rate) {
    const std::string& dump = source.job_.spec().dump();
    return absl::InvalidArgumentError(absl::StrCat("--fps: nothing tells the frame rate of ",
                                                   dump.empty() ? source.result_ : dump, ", and ",
                                                   traits.name, " has times; give the frames per second"));
  }
  return source;
}

absl::Status ExportSource::ListFrames(const ExportRequest& request) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<v1::FrameReport> reports, ReadJobFrames(result_, job_, notes_));
  if (reports.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat(result_, ": holds no frames of its job; register the take first"));
  }
  WEFT_RETURN_IF_ERROR(ListRange(request, reports));
  for (const v1::FrameReport& report : reports) {
    first_of_job_ = Describe(report, mesh_);
    if (first_of_job_.missing_because().empty()) break;
  }
  const auto has_mesh = [](const v1::ExportedFrame& frame) { return frame.missing_because().empty(); };
  // Gaps at the ends are no part of the sequence.
  frames_.erase(frames_.begin(), std::ranges::find_if(frames_, has_mesh));
  frames_.erase(std::find_if(frames_.rbegin(), frames_.rend(), has_mesh).base(), frames_.end());
  for (size_t i = 0; i < frames_.size(); ++i) {
    v1::ExportedFrame& frame = frames_[i];
    frame.set_index(static_cast<int>(i));
    if (has_mesh(frame)) {
      meshes_.push_back(i);
    } else if (TraitsOf(request.format).repeats_gaps) {
      frame.set_repeats(frames_[meshes_.back()].frame());
    }
    if (frame.bridged())
      notes_.push_back(absl::StrCat("Frame ", frame.frame(),
                                    " failed and is bridged: its mesh comes from the frames around it."));
  }
  if (!meshes_.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(result_, ": none of the frames asked for has a mesh; see report.html for the reasons"));
}

std::string ExportSource::PathOf(const v1::ExportedFrame& frame) const {
  return (fs::path(result_) / frame.frame() / MeshFileName(mesh_)).string();
}

absl::Status ExportSource::ListRange(const ExportRequest& request,
                                     const std::vector<v1::FrameReport>& reports) {
  std::map<std::string, const v1::FrameReport*, NaturalOrder> by_name;
  for (const v1::FrameReport& report : reports) by_name[report.frame()] = &report;
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> without, FramesWithoutReport(result_, job_, reports));
  for (const std::string& frame : without) by_name[frame] = nullptr;
  NoteLostFrames(by_name.size());
  std::vector<std::string> names;
  for (const auto& [name, report] : by_name) names.push_back(name);
  WEFT_ASSIGN_OR_RETURN(const FrameRange range, FindFrameRange(request.frames, names, result_));
  const auto has_report = [&](const std::string& name) { return by_name.at(name) != nullptr; };
  const auto first = names.begin() + static_cast<int64_t>(range.first);
  const auto end = names.begin() + static_cast<int64_t>(range.end);
  const auto before = static_cast<size_t>(std::count_if(names.begin(), first, has_report));
  const auto in_range = static_cast<size_t>(std::count_if(first, end, has_report));
  WEFT_ASSIGN_OR_RETURN(mesh_, ChooseMesh(std::span(reports).subspan(before, in_range), request.mesh));
  for (size_t i = range.first; i < range.end; ++i) {
    const v1::FrameReport* report = by_name.at(names[i]);
    v1::ExportedFrame& frame =
        frames_.emplace_back(report ? Describe(*report, mesh_) : WithoutReport(names[i]));
    if (!frame.missing_because().empty())
      notes_.push_back(absl::StrCat("Frame ", frame.frame(), " has no mesh: ", frame.missing_because(), "."));
  }
  return absl::OkStatus();
}

// Of a job that is done each frame has left a report.
void ExportSource::NoteLostFrames(size_t frames) {
  const auto total = static_cast<size_t>(std::max(0, job_.frames().total()));
  if (job_.state() != v1::JOB_STATE_DONE || frames >= total) return;
  notes_.push_back(
      absl::StrCat("The job had ", total, " frames, and ", result_, " holds ", frames,
                   ": the others were lost, and nothing but the take tells where. `weft register` "
                   "with the same inputs computes them again."));
}

void ExportSource::FindRate(const ExportRequest& request) {
  const std::string& dump = job_.spec().dump();
  const fs::path truth = fs::path(dump) / "truth";
  const TakeTimes times = TimesOfTake(dump, !dump.empty() && PathExists(truth) ? truth.string() : "");
  fps_ = request.fps > 0 ? request.fps : NominalRate(times.fps);
  fps_source_ = request.fps > 0 ? "--fps" : fps_ > 0 ? times.source : "";
  const auto numbers = NumbersOfSets(frames_, times.positions);
  for (size_t i = 0; i < frames_.size(); ++i) {
    if (numbers && !TraitsOf(request.format).repeats_gaps)
      frames_[i].set_index(static_cast<int>((*numbers)[i] - numbers->front()));
    if (fps_ > 0) frames_[i].set_time_s(frames_[i].index() / fps_);
  }
}

absl::Status ExportSource::Survey(const ExportProgress& progress, const std::stop_token& stop) {
  std::vector<std::array<int, kVertexStates>> states;
  std::vector<double> sigma_sum_mm;
  for (size_t i = 0; i < meshes_.size(); ++i) {
    if (stop.stop_requested()) return absl::CancelledError("stopped while the meshes were looked through");
    const v1::ExportedFrame& frame = frames_[meshes_[i]];
    const std::string path = PathOf(frame);
    WEFT_ASSIGN_OR_RETURN(CheckedMesh mesh, ReadCheckedMesh(path, frame.mesh_checksum()));
    if (i == 0) {
      topology_.vertices = mesh.registered.vertices_mm.size();
      topology_.faces = std::move(mesh.faces);
      topology_.texture = std::move(mesh.texture);
      states.resize(topology_.vertices);
      sigma_sum_mm.resize(topology_.vertices);
    } else if (mesh.registered.vertices_mm.size() != topology_.vertices || mesh.faces != topology_.faces) {
      return absl::InvalidArgumentError(absl::StrCat(
          path, ": has other vertices or faces than the mesh of frame ", frames_[meshes_.front()].frame(),
          "; frames of one template are exported together, choose them with --frames"));
    }
    topology_.is_measured = topology_.is_measured && mesh.is_measured;
    for (size_t v = 0; v < topology_.vertices; ++v) {
      ++states[v][static_cast<size_t>(mesh.registered.state[v])];
      sigma_sum_mm[v] += mesh.registered.sigma_mm[v];
      topology_.bounds.extend(transform_.Position(mesh.registered.vertices_mm[v]));
    }
    if (progress) progress(ExportStep::kCheck, i + 1, meshes_.size());
  }
  const auto frames = static_cast<double>(meshes_.size());
  for (size_t v = 0; v < topology_.vertices; ++v) {
    const std::array<int, kVertexStates>& count = states[v];
    const int observed = count[static_cast<size_t>(VertexState::kObserved)] +
                         count[static_cast<size_t>(VertexState::kTwoView)];
    topology_.coverage.push_back(static_cast<float>(observed) / static_cast<float>(meshes_.size()));
    topology_.usual_state.push_back(static_cast<uint8_t>(std::ranges::max_element(count) - count.begin()));
    topology_.mean_sigma_mm.push_back(static_cast<float>(sigma_sum_mm[v] / frames));
  }
  vertices_in_files_ = topology_.vertices;
  return max_vertices_ > 0 ? Reduce() : absl::OkStatus();
}

absl::Status ExportSource::Reduce() {
  const std::string path = PathOf(first_of_job_);
  WEFT_ASSIGN_OR_RETURN(RegisteredMesh shape, ReadCheckedVertices(path, first_of_job_.mesh_checksum()));
  if (shape.vertices_mm.size() != vertices_in_files_) {
    return absl::InvalidArgumentError(absl::StrCat(
        path, ": has other vertices than the frames to export, which --max-vertices reduces by its shape"));
  }
  WEFT_ASSIGN_OR_RETURN(auto reduced, ReduceMesh({std::move(shape.vertices_mm), topology_.faces},
                                                 topology_.texture, static_cast<size_t>(max_vertices_)));
  whole_ = std::make_shared<const ExportTopology>(topology_);
  topology_ = {.vertices = reduced.vertices.size(),
               .faces = reduced.faces,
               .texture = reduced.texture,
               .is_measured = whole_->is_measured,
               .bounds = whole_->bounds};
  for (const int vertex : reduced.vertices) {
    topology_.coverage.push_back(whole_->coverage[vertex]);
    topology_.usual_state.push_back(whole_->usual_state[vertex]);
    topology_.mean_sigma_mm.push_back(whole_->mean_sigma_mm[vertex]);
  }
  reduced_ = std::move(reduced);
  return absl::OkStatus();
}

v1::Export ExportSource::Manifest() const {
  v1::Export manifest;
  if (mesh_ != kGarmentMesh) manifest.set_mesh(mesh_);  // as exports of earlier versions
  manifest.set_fps(fps_);
  manifest.set_fps_source(fps_source_);
  manifest.set_vertices(static_cast<int>(topology_.vertices));
  manifest.set_faces(static_cast<int>(topology_.faces.size()));
  manifest.mutable_frames()->Add(frames_.begin(), frames_.end());
  manifest.set_job_id(job_.id());
  *manifest.mutable_inputs() = job_.inputs();
  manifest.set_weft_version(WEFT_VERSION);
  manifest.mutable_notes()->Add(notes_.begin(), notes_.end());
  return manifest;
}

ExportSource ExportSource::InWorldMm() const {
  ExportSource world = *this;
  world.transform_ = {};
  world.transform_.unit = LengthUnit::kMillimetre;
  world.transform_.unit_per_mm = 1;
  if (whole_ != nullptr) world.topology_ = *whole_;
  world.whole_ = nullptr;
  world.reduced_.reset();
  return world;
}

absl::StatusOr<std::shared_ptr<const RegisteredMesh>> ExportSource::Load(size_t mesh) {
  if (const auto found = loaded_.find(mesh); found != loaded_.end()) return found->second;
  const v1::ExportedFrame& frame = frames_[meshes_[mesh]];
  const std::string path = PathOf(frame);
  WEFT_ASSIGN_OR_RETURN(RegisteredMesh read, ReadCheckedVertices(path, frame.mesh_checksum()));
  if (read.vertices_mm.size() != vertices_in_files_) {
    return absl::DataLossError(
        absl::StrCat(path, ": was changed while it was exported; export again when its job has ended"));
  }
  std::erase_if(loaded_,
                [mesh](const auto& other) { return other.first + 1 < mesh || other.first > mesh + 1; });
  return loaded_[mesh] = std::make_shared<const RegisteredMesh>(std::move(read));
}

absl::StatusOr<ExportMesh> ExportSource::Read(size_t mesh, Velocities velocities) {
  WEFT_ASSIGN_OR_RETURN(const auto read, Load(mesh));
  const RegisteredMesh& own = *read;
  ExportMesh out;
  const auto in_file = [this](size_t v) { return reduced_ ? static_cast<size_t>(reduced_->vertices[v]) : v; };
  for (size_t i = 0; i < topology_.vertices; ++i) {
    const size_t v = in_file(i);
    out.positions.push_back(transform_.Position(own.vertices_mm[v]));
    out.state.push_back(static_cast<uint8_t>(own.state[v]));
    out.sigma.push_back(static_cast<float>(transform_.unit_per_mm * own.sigma_mm[v]));
    out.views.push_back(own.views[v]);
  }
  if (velocities == Velocities::kLeftOut) return out;
  const size_t before = mesh > 0 ? mesh - 1 : mesh, after = std::min(mesh + 1, meshes_.size() - 1);
  WEFT_ASSIGN_OR_RETURN(const auto earlier, Load(before));
  WEFT_ASSIGN_OR_RETURN(const auto later, Load(after));
  const double steps = frames_[meshes_[after]].index() - frames_[meshes_[before]].index();
  const double rate = steps > 0 ? fps_ / steps : 0;
  for (size_t i = 0; i < topology_.vertices; ++i) {
    const size_t v = in_file(i);
    out.velocities.push_back(transform_.Position(rate * (later->vertices_mm[v] - earlier->vertices_mm[v])));
  }
  return out;
}

}  // namespace weft
