#include "services/animation/driven_frame.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/median.h"
#include "capture/file/checksum.h"
#include "services/files/mesh_file.h"
#include "services/files/observations_file.h"
#include "services/options/presets.h"
#include "services/pipeline/frame_folder.h"
#include "services/pipeline/stage_reports.h"

namespace weft {
namespace {

// Raised when the same inputs give other results.
constexpr int kDriveVersion = 2;
constexpr char kDriveStage[] = "drive";

const std::string& NameOfFrame(const DriveInputs& inputs, size_t at) {
  return inputs.dump->frame_names()[inputs.frames[at]];
}

std::string MissingText(int missing, size_t views) {
  return absl::StrCat(missing, " of ", views, " cameras have no usable image");
}

}  // namespace

std::string DriveKey(const DriveRequest& request, const DriveInputs& inputs) {
  const std::string text =
      absl::StrCat(inputs.hashes.rig(), " ", inputs.rig.ContentHash(), " ", inputs.hashes.board(), " ",
                   inputs.hashes.garment(), " ", inputs.avatar.about.space_checksum(), " first ",
                   NameOfFrame(inputs, 0), " ", StageOptionsText(request.spec.options().pipeline(), "decode"),
                   " mosaic ", request.spec.options().mosaic(), " fps ", request.fps);
  return absl::StrFormat("%016x", Checksum(text.data(), text.size()));
}

DrivenStanding InspectDrivenFrame(const DriveRequest& request, const DriveInputs& inputs, size_t at,
                                  const std::string& key, const std::string& out) {
  const auto folder = FrameFolder::Open(out, NameOfFrame(inputs, at), ConfinedFolder::IfMissing::kFail);
  if (!folder.ok()) return {};
  const absl::StatusOr<v1::FrameReport> report = folder->Report();
  if (!report.ok() || report->keys_size() != 1) return {};
  const v1::StageKey& was = report->keys(0);
  const absl::StatusOr<std::string> fingerprint = inputs.dump->Fingerprint(inputs.frames[at]);
  const bool stands = was.stage() == kDriveStage && was.version() == kDriveVersion && was.options() == key &&
                      fingerprint.ok() && report->images_fingerprint() == *fingerprint &&
                      folder->CheckAll(*report).empty() &&
                      (!request.write_observations || Lists(*report, FrameFile::kObservations));
  return {stands, stands && report->driven().started_anew()};
}

v1::FrameReport DescribeDriven(const DriveRequest& request, const DriveInputs& inputs, size_t at,
                               const std::string& key, const std::string& fingerprint,
                               const DecodedFrame& decoded, const DrivenFrame& driven) {
  v1::FrameReport report;
  report.set_frame(NameOfFrame(inputs, at));
  *report.mutable_inputs() = inputs.hashes;
  *report.mutable_options() = request.spec.options();
  report.set_images_fingerprint(fingerprint);
  report.set_weft_version(WEFT_VERSION);
  int missing = 0;
  for (const v1::ViewReport& view : decoded.reports) {
    missing += view.missing_reason().empty() ? 0 : 1;
    *report.add_views() = view;
  }
  report.set_views_missing(missing);
  report.set_views_used(report.views_size() - missing);
  v1::StageKey& stage = *report.add_keys();
  stage.set_stage(kDriveStage);
  stage.set_version(kDriveVersion);
  stage.set_options(key);

  v1::DrivenReport& of_driving = *report.mutable_driven();
  of_driving.set_started_anew(driven.started_anew || at == 0);
  of_driving.set_rays(driven.rays);
  of_driving.set_rejected_rays(driven.rejected_rays);
  if (driven.lost) {
    report.set_state(v1::FRAME_STATE_FAILED);
    report.set_reason(missing > 0
                          ? absl::StrCat(driven.reason, "; ", MissingText(missing, decoded.reports.size()))
                          : driven.reason);
    return report;
  }
  of_driving.set_residual_px(driven.residual_px);
  of_driving.set_median_sigma_mm(
      Median(std::vector<double>(driven.mesh.sigma_mm.begin(), driven.mesh.sigma_mm.end())));
  report.set_state(missing > 0 ? v1::FRAME_STATE_DEGRADED : v1::FRAME_STATE_DONE);
  if (missing > 0) report.set_reason(MissingText(missing, decoded.reports.size()));
  DescribeMesh(driven.mesh, inputs.garment, *report.mutable_mesh());
  return report;
}

absl::Status WriteDriven(const DriveInputs& inputs, const DecodedFrame& decoded, const DrivenFrame& driven,
                         v1::FrameReport report, const std::string& out) {
  const auto folder = FrameFolder::Open(out, report.frame(), ConfinedFolder::IfMissing::kMake);
  if (!folder.ok()) return folder.status();
  absl::Status status = folder->Clear();
  if (status.ok() && report.options().write_observations())
    status = folder->Put(
        FrameFile::kObservations,
        [&](const std::string& path) {
          std::vector<ImageObservations> images;
          for (const ViewObservations& view : decoded.views)
            images.push_back({inputs.rig.cameras[static_cast<size_t>(view.camera)].id, view.observations});
          return WriteObservations(path, images);
        },
        report);
  if (status.ok() && !driven.lost)
    status = folder->Put(
        FrameFile::kMesh,
        [&](const std::string& path) {
          return WriteRegisteredMesh(path, driven.mesh, inputs.garment.rest.faces, inputs.texture);
        },
        report);
  if (status.ok()) status = folder->Commit(std::move(report));
  return status.ok() ? folder->Sync() : status;
}

}  // namespace weft
