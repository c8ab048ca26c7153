#include "services/work/animation/driven_frame.h"

#include <map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/formats/files/agreement_proto.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/work/animation/driver_memory.h"
#include "services/work/pipeline/algorithm_versions.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/pipeline/moved_views.h"
#include "services/work/pipeline/stage_reports.h"

namespace weft {
namespace {

// Besides its own.
constexpr StageList<Stage::kDecode> kDriveStages;
constexpr char kDriveStage[] = "drive";

std::string MissingText(int missing, size_t views) {
  return absl::StrCat(missing, " of ", views, " cameras have no usable image");
}

// Views of cameras that cannot be compared stay as they are: that fails no frame.
void DescribeAgreements(const Rig& rig, const std::vector<ViewObservations>& views, v1::FrameReport& report) {
  const auto agreements = MeasureSampledAgreement(rig, views, {});
  if (!agreements.ok()) return;
  for (size_t v = 0; v < views.size(); ++v) {
    const int camera = views[v].camera;
    DescribeAgreement((*agreements)[camera], rig, *report.mutable_views(camera));
  }
}

bool IsResult(v1::FrameState state) {
  return state == v1::FRAME_STATE_DONE || state == v1::FRAME_STATE_DEGRADED ||
         state == v1::FRAME_STATE_FAILED;
}

}  // namespace

SeenFrame SeeFrame(const DriveInputs& inputs, const FrameSource& dump, size_t index, int64_t time_ns,
                   const std::stop_token& stop) {
  const Stopwatch watch;
  // Taken first: images that change while they are read must not look like those that were read.
  SeenFrame out{dump.frame_names()[index], time_ns, dump.Fingerprint(index), {}, 0, {}};
  const FrameImages images{inputs.rig, inputs.board, dump, index};
  out.decoded = DecodeFrame(kDriveStages, images, inputs.decode, std::nullopt, {}, stop);
  MovedViews moved = MovedViews::Decode(images, inputs.decode, stop, out.decoded);
  moved.Move(out.decoded.views);
  moved.Describe(out.decoded.reports);
  out.decode_ms = watch.Ms();
  out.unknown_cameras = dump.unknown_cameras();
  return out;
}

StageKeys DriveKeys(const v1::RegistrationSpec& spec, const DriveInputs& inputs, DrivePace pace) {
  StageKeys keys = KeysOf(kDriveStages, inputs.hashes, spec.options());
  v1::StageKey& drive = *keys.Add();
  drive.set_stage(kDriveStage);
  drive.set_version(kDriveVersion);
  drive.set_inputs(HashOf(absl::StrCat(inputs.hashes.rig(), " ", inputs.rig.ContentHash(), " ",
                                       inputs.hashes.garment(), " ", ChecksumOfAvatar(inputs.avatar.about))));
  drive.set_options(
      HashOf(absl::StrCat("fps ", spec.driving().fps(), pace == DrivePace::kLive ? " live" : "")));
  return keys;
}

std::optional<v1::FrameReport> CachedReport(const std::string& out, const std::string& frame,
                                            const StageKeys& keys, const std::string& fingerprint,
                                            bool wants_observations) {
  const auto folder = FrameFolder::Open(out, frame, ConfinedFolder::IfMissing::kFail);
  if (!folder.ok()) return std::nullopt;
  absl::StatusOr<v1::FrameReport> report = folder->Report();
  if (!report.ok() || report->frame() != frame) return std::nullopt;
  if (!AreEqual(report->keys(), keys) || report->images_fingerprint() != fingerprint ||
      !folder->CheckAll(*report).empty() ||
      (wants_observations && !Lists(*report, FrameFile::kObservations)) || !folder->Sync().ok())
    return std::nullopt;
  return *std::move(report);
}

v1::FrameReport DescribeDriven(const v1::RegistrationSpec& spec, const DriveInputs& inputs,
                               const StageKeys& keys, const SeenFrame& seen, const DrivenFrame& driven,
                               const std::string& follows, const std::string& memory) {
  v1::FrameReport report;
  report.set_frame(seen.name);
  *report.mutable_inputs() = inputs.hashes;
  *report.mutable_options() = spec.options();
  report.set_images_fingerprint(seen.fingerprint.value_or(""));
  report.set_weft_version(WEFT_VERSION);
  int missing = 0;
  for (const v1::ViewReport& view : seen.decoded.reports) {
    missing += view.missing_reason().empty() ? 0 : 1;
    *report.add_views() = view;
  }
  if (!driven.lost)
    for (size_t k = 0; k < driven.bias_of_view.size(); ++k) {
      const size_t camera = static_cast<size_t>(seen.decoded.views[k].camera);
      DescribeBias(driven.bias_of_view[k], *report.mutable_views(static_cast<int>(camera)));
    }
  DescribeAgreements(inputs.rig, seen.decoded.views, report);
  // The pictures of cameras that are left out on purpose are no strangers.
  if (spec.driving().cameras().empty())
    report.mutable_unknown_cameras()->Assign(seen.unknown_cameras.begin(), seen.unknown_cameras.end());
  report.set_views_missing(missing);
  report.set_views_used(report.views_size() - missing);
  *report.mutable_keys() = keys;

  v1::DrivenReport& of_driving = *report.mutable_driven();
  of_driving.set_started_anew(driven.started_anew || follows.empty());
  of_driving.set_rays(driven.rays);
  of_driving.set_rejected_rays(driven.rejected_rays);
  of_driving.set_memory(memory);
  of_driving.set_follows(MemoryChecksum(follows));
  if (driven.lost) {
    report.set_state(v1::FRAME_STATE_FAILED);
    report.set_reason(
        missing > 0 ? absl::StrCat(driven.reason, "; ", MissingText(missing, seen.decoded.reports.size()))
                    : driven.reason);
    return report;
  }
  of_driving.set_residual_px(driven.residual_px);
  of_driving.set_median_sigma_mm(
      Median(std::vector<double>(driven.mesh.sigma_mm.begin(), driven.mesh.sigma_mm.end())));
  report.set_state(missing > 0 ? v1::FRAME_STATE_DEGRADED : v1::FRAME_STATE_DONE);
  if (missing > 0) report.set_reason(MissingText(missing, seen.decoded.reports.size()));
  DescribeMesh(driven.mesh, inputs.garment, *report.mutable_mesh());
  return report;
}

absl::Status WriteDriven(const DriveInputs& inputs, const SeenFrame& seen, const DrivenFrame& driven,
                         v1::FrameReport report, const std::string& out) {
  WEFT_ASSIGN_OR_RETURN(const auto folder,
                        FrameFolder::Open(out, report.frame(), ConfinedFolder::IfMissing::kMake));
  absl::Status status = folder.Clear();
  if (status.ok() && report.options().write_observations())
    status = folder.Put(
        FrameFile::kObservations,
        [&](const std::string& path) {
          std::vector<ImageObservations> images;
          for (const ViewObservations& view : seen.decoded.views)
            images.push_back({inputs.rig.cameras[static_cast<size_t>(view.camera)].id, view.observations});
          return WriteObservations(path, images);
        },
        report);
  if (status.ok() && !driven.lost)
    status = folder.PutMesh(
        kGarmentMesh, driven.mesh.vertices_mm.size(), inputs.garment.rest.faces,
        [&](const std::string& path) {
          return WriteRegisteredMesh(path, driven.mesh, inputs.garment.rest.faces, inputs.texture);
        },
        report);
  if (status.ok()) status = folder.Commit(std::move(report));
  return status.ok() ? folder.Sync() : status;
}

absl::StatusOr<std::vector<IncompleteFrame>> FindIncompleteDriven(const DriveInputs& inputs,
                                                                  const DriveFrameList& list,
                                                                  const v1::Job& job,
                                                                  const std::vector<v1::FrameInfo>& frames) {
  const v1::RegistrationSpec& spec = job.spec();
  const absl::StatusOr<ConfinedFolder> base = ConfinedFolder::Open(spec.out());
  if (!base.ok() && !absl::IsNotFound(base.status())) return base.status();
  const StageKeys keys = DriveKeys(spec, inputs);
  std::map<std::string, size_t> index_of;
  for (size_t at = 0; at < list.size(); ++at) index_of.emplace(list.NameOf(at), list.indices[at]);

  std::vector<IncompleteFrame> incomplete;
  std::string memory;
  bool knows_memory = true;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (!IsResult(frames[i].state())) {
      knows_memory = false;
      continue;
    }
    const auto found = index_of.find(frames[i].frame());
    const std::string now = found == index_of.end() ? "" : list.dump->Fingerprint(found->second).value_or("");
    const auto report =
        CachedReport(spec.out(), frames[i].frame(), keys, now, spec.options().write_observations());
    if (!report) {
      const auto folder = FrameFolder::Open(spec.out(), frames[i].frame(), ConfinedFolder::IfMissing::kFail);
      const absl::StatusOr<v1::FrameReport> other =
          folder.ok() ? folder->Report() : absl::StatusOr<v1::FrameReport>(folder.status());
      if (other.ok() && other->set_aside()) continue;  // the next frame follows the one before it
      const bool has_changed = other.ok() && other->images_fingerprint() != now;
      incomplete.push_back({i, "is not as this job wrote it", has_changed});
      knows_memory = false;
    } else if (knows_memory && report->driven().follows() != MemoryChecksum(memory)) {
      incomplete.push_back({i, "does not follow the frame before it", false});
      knows_memory = false;
    } else {
      if ((report->state() == v1::FRAME_STATE_FAILED) != (frames[i].state() == v1::FRAME_STATE_FAILED))
        incomplete.push_back({i, "is in another state than its report says", false});
      memory = report->driven().memory();
      knows_memory = true;
    }
  }
  if (base.ok()) {
    WEFT_RETURN_IF_ERROR(base->Sync());
  }
  return incomplete;
}

}  // namespace weft
