#include "services/results/export/export_overlays.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/rig_file.h"
#include "services/results/export/overlay_plan.h"
#include "services/results/export/undistorted_picture.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr int kJpegQuality = 90;
constexpr char kRigFile[] = "rig.json";

v1::Export OverlayManifest(const OverlayRequest& request, const ExportSource& source,
                           const OverlayPlan& plan) {
  v1::Export manifest = source.Manifest();
  manifest.set_format(EndingOf(request.format));
  manifest.set_overlay(absl::StrCat(NameOf(request.kind), request.undistort ? ", undistorted" : ""));
  for (const size_t camera : plan.cameras) {
    const std::string& id = plan.rig.cameras[camera].id;
    manifest.add_files(IsVideo(request.format) ? absl::StrCat(id, ".", EndingOf(request.format)) : id);
  }
  if (request.undistort) manifest.add_files(kRigFile);
  if (request.kind == OverlayKind::kSigma) manifest.set_overlay_sigma_mm(plan.sigma_range_mm.high);
  return manifest;
}

absl::Status WritePicture(const Frame& drawn, PictureFormat format, const std::string& path) {
  const ImagePixels pixels{drawn.width_px, drawn.height_px, 3, 8, *drawn.pixels};
  WEFT_ASSIGN_OR_RETURN(const auto bytes,
                        format == PictureFormat::kPng ? EncodePng(pixels) : EncodeJpeg(pixels, kJpegQuality));
  return WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

// The cameras of undistorted pictures.
absl::Status WritePinholes(const OverlayPlan& plan, const ExportFolder& folder) {
  Rig chosen;
  chosen.id = absl::StrCat(plan.rig.id, " without distortion");
  for (const size_t camera : plan.cameras) chosen.cameras.push_back(plan.rig.cameras[camera]);
  return WriteRig(folder.Of(kRigFile), WithoutDistortion(chosen), "weft export --undistort");
}

// Where the pictures of a camera stand, free of what a killed export left.
absl::Status PrepareFolder(const std::string& folder) {
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (IsTemporaryNameOf(name, name.substr(0, name.find(".tmp.")))) fs::remove(entry.path(), error);
  }
  return absl::OkStatus();
}

// The cameras' pictures of one frame; those that are there are kept.
absl::Status WriteFrameOverlays(const OverlayRequest& request, const OverlayPlan& plan, ExportSource& source,
                                size_t mesh_number, const ExportFolder& folder,
                                std::vector<std::string>& warnings) {
  const std::string& name = source.frames()[source.meshes()[mesh_number]].frame();
  OverlayMesh mesh;
  for (const size_t c : plan.cameras) {
    const CameraModel& camera = plan.rig.cameras[c];
    const std::string path = folder.Of(absl::StrCat(camera.id, "/", name, ".", EndingOf(request.format)));
    if (fs::exists(path)) continue;
    const absl::StatusOr<Frame> picture = plan.dump->ReadView(plan.index_of_frame.at(name), c);
    if (!picture.ok()) {
      warnings.push_back(
          absl::StrCat("Frame ", name, ", camera ", camera.id, ": ", picture.status().message()));
      continue;
    }
    if (mesh.faces.empty() && request.kind != OverlayKind::kNone) {
      WEFT_ASSIGN_OR_RETURN(mesh, ReadOverlayMesh(request.kind, plan, source, mesh_number));
    }
    absl::StatusOr<Frame> drawn = DrawOverlay(*picture, mesh, camera, request.kind);
    if (drawn.ok() && request.undistort) drawn = UndistortPicture(*drawn, camera);
    if (!drawn.ok()) return drawn.status();
    WEFT_RETURN_IF_ERROR(WritePicture(*drawn, request.format, path));
  }
  return absl::OkStatus();
}

// At most; a JPEG of this quality takes less than a byte per pixel, H.264 less than half of one.
uint64_t MaxOverlayBytes(const OverlayRequest& request, const OverlayPlan& plan, size_t frames) {
  uint64_t pixels = 0;
  for (const size_t c : plan.cameras)
    pixels += static_cast<uint64_t>(plan.rig.cameras[c].width_px) *
              static_cast<uint64_t>(plan.rig.cameras[c].height_px);
  if (IsVideo(request.format)) return frames * pixels / 2;
  return frames * pixels * (request.format == PictureFormat::kPng ? 3 : 1);
}

}  // namespace

const char* EndingOf(PictureFormat format) {
  switch (format) {
    case PictureFormat::kPng:
      return "png";
    case PictureFormat::kMp4:
      return "mp4";
    case PictureFormat::kMkv:
      return "mkv";
    case PictureFormat::kJpeg:
      break;
  }
  return "jpg";
}

bool IsVideo(PictureFormat format) { return format == PictureFormat::kMp4 || format == PictureFormat::kMkv; }

absl::StatusOr<ExportOutcome> ExportOverlays(const OverlayRequest& request, const ExportProgress& progress,
                                             const std::stop_token& stop) {
  WEFT_ASSIGN_OR_RETURN(ExportSource source, ExportSource::Open(InTheWorld(request)));
  if (IsVideo(request.format) && source.fps() == 0) {
    return absl::InvalidArgumentError(absl::StrCat("--fps: nothing tells the frame rate of ",
                                                   source.job().spec().dump(),
                                                   ", which a video needs; give the frames per second"));
  }
  WEFT_RETURN_IF_ERROR(source.Survey(progress, stop));
  WEFT_ASSIGN_OR_RETURN(const OverlayPlan plan, PlanOverlays(request.recording, source));
  ExportOutcome outcome{OverlayManifest(request, source, plan)};
  const ExportFolder folder(request.out);
  const size_t frames = source.meshes().size();
  WEFT_ASSIGN_OR_RETURN(const ExportFolder::Holds holds,
                        folder.BeginOrGoOn(outcome.manifest, MaxOverlayBytes(request, plan, frames)));
  outcome.was_complete = holds == ExportFolder::Holds::kAll;
  if (outcome.was_complete) return outcome;
  if (request.undistort) WEFT_RETURN_IF_ERROR(WritePinholes(plan, folder));
  const bool is_video = IsVideo(request.format);
  if (is_video)
    WEFT_RETURN_IF_ERROR(WriteOverlayVideos(request, plan, source, folder, progress, stop, outcome.warnings));
  for (const size_t camera : plan.cameras)
    if (!is_video) WEFT_RETURN_IF_ERROR(PrepareFolder(folder.Of(plan.rig.cameras[camera].id)));
  for (size_t i = 0; !is_video && i < frames; ++i) {
    if (stop.stop_requested()) return StoppedAfter(i, frames);
    WEFT_RETURN_IF_ERROR(WriteFrameOverlays(request, plan, source, i, folder, outcome.warnings));
    if (progress) progress(ExportStep::kWrite, i + 1, frames);
  }
  WEFT_RETURN_IF_ERROR(folder.Finish(outcome.manifest));
  return outcome;
}

}  // namespace weft
