// Overlays as a video per camera.
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "capture/image/frame.h"
#include "services/ground/process/ffmpeg_process.h"
#include "services/results/export/export_stream.h"
#include "services/results/export/overlay_plan.h"
#include "services/results/export/undistorted_picture.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// H.264 that every player shows: even sides, 4:2:0, the colours of HD video. Quality 18 hides no thread of
// the overlay. Without times and names of this machine in the file.
std::vector<std::string> EncoderArguments(const CameraModel& camera, double fps, const std::string& file) {
  std::vector<std::string> arguments = absl::StrSplit(
      absl::StrFormat("-f rawvideo -pixel_format rgb24 -video_size %dx%d -framerate %.9g -i pipe:0 "
                      "-vf pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv "
                      "-c:v libx264 -crf 18 -pix_fmt yuv420p -colorspace bt709 -color_primaries bt709 "
                      "-color_trc bt709 -movflags +faststart -fflags +bitexact",
                      camera.width_px, camera.height_px, fps),
      ' ');
  arguments.push_back(FileArgument(file));
  return arguments;
}

// The video of one camera.
class CameraVideo {
 public:
  CameraVideo(const OverlayRequest& request, const OverlayPlan& plan, ExportSource& source, size_t camera,
              std::vector<std::string>& warnings)
      : request_(request),
        plan_(plan),
        source_(source),
        camera_(plan.rig.cameras[camera]),
        number_(camera),
        warnings_(warnings) {}

  // `on_frame`: after each; false ends it.
  absl::Status Write(const std::string& file, const std::function<bool()>& on_frame) {
    WEFT_ASSIGN_OR_RETURN(FfmpegProcess ffmpeg,
                          FfmpegProcess::Start(EncoderArguments(camera_, source_.fps(), file)));
    const std::vector<v1::ExportedFrame>& frames = source_.frames();
    size_t mesh_number = 0;
    for (size_t i = 0; i < frames.size(); ++i) {
      const bool has_mesh = frames[i].missing_because().empty();
      if (has_mesh && i > 0) ++mesh_number;
      WEFT_RETURN_IF_ERROR(Draw(frames[i].frame(), has_mesh, mesh_number));
      // Frame sets that the job left out have passed nevertheless.
      const int next = i + 1 < frames.size() ? frames[i + 1].index() : frames[i].index() + 1;
      for (int t = frames[i].index(); t < next; ++t)
        if (absl::Status status = ffmpeg.Write(shown_.data(), shown_.size()); !status.ok())
          return Naming(camera_.id, status);
      if (!on_frame()) return absl::CancelledError("stopped");
    }
    return ffmpeg.Finish();
  }

 private:
  // Into `shown_`, which otherwise stays as it was.
  absl::Status Draw(const std::string& frame, bool has_mesh, size_t mesh_number) {
    const auto size = 3 * static_cast<size_t>(camera_.width_px) * static_cast<size_t>(camera_.height_px);
    shown_.resize(size);  // black before the first picture
    const auto at = plan_.index_of_frame.find(frame);
    absl::StatusOr<Frame> picture =
        at == plan_.index_of_frame.end()
            ? absl::StatusOr<Frame>(absl::NotFoundError("is not in the recording"))
            : plan_.dump->ReadView(at->second, number_);
    if (picture.ok() && has_mesh) {
      WEFT_ASSIGN_OR_RETURN(const OverlayMesh mesh,
                            ReadOverlayMesh(request_.kind, plan_, source_, mesh_number));
      picture = DrawOverlay(*picture, mesh, camera_, request_.kind);
      if (!picture.ok()) return picture.status();
    } else if (picture.ok()) {
      picture = ToRgb(*picture);
    }
    if (picture.ok() && request_.undistort) {
      picture = UndistortPicture(*picture, camera_);
      if (!picture.ok()) return picture.status();
    }
    if (!picture.ok()) {
      warnings_.push_back(
          absl::StrCat("Frame ", frame, ", camera ", camera_.id, ": ", picture.status().message()));
      return absl::OkStatus();
    }
    if (picture->pixels->size() != size) {
      return absl::InvalidArgumentError(
          absl::StrCat("frame ", frame, ", camera ", camera_.id, ": has ", picture->width_px, "x",
                       picture->height_px, " px, the rig says ", camera_.width_px, "x", camera_.height_px));
    }
    shown_ = *picture->pixels;
    return absl::OkStatus();
  }

  const OverlayRequest& request_;
  const OverlayPlan& plan_;
  ExportSource& source_;
  const CameraModel& camera_;
  const size_t number_;
  std::vector<std::string>& warnings_;
  std::vector<uint8_t> shown_;  // RGB
};

absl::Status Sync(const std::string& file) {
  std::error_code error;
  absl::StatusOr<ExportStream> stream = ExportStream::Open(file, fs::file_size(file, error));
  return stream.ok() ? stream->Sync() : stream.status();
}

}  // namespace

absl::Status WriteOverlayVideos(const OverlayRequest& request, const OverlayPlan& plan, ExportSource& source,
                                const ExportFolder& folder, const ExportProgress& progress,
                                const std::stop_token& stop, std::vector<std::string>& warnings) {
  const size_t all = plan.cameras.size() * source.frames().size();
  size_t done = 0, videos = 0;
  for (const size_t camera : plan.cameras) {
    const std::string name = absl::StrCat(plan.rig.cameras[camera].id, ".", EndingOf(request.format));
    if (fs::exists(folder.Of(name))) {
      done += source.frames().size();
      ++videos;
      continue;
    }
    CameraVideo video(request, plan, source, camera, warnings);
    absl::Status status = video.Write(folder.UnfinishedOf(name), [&] {
      if (progress) progress(ExportStep::kWrite, ++done, all);
      return !stop.stop_requested();
    });
    if (status.ok()) status = Sync(folder.UnfinishedOf(name));
    if (status.ok()) status = folder.Publish(name);
    // A signal of the terminal ends ffmpeg, too, which is no fault of its own then.
    if (!status.ok() && stop.stop_requested()) {
      return absl::CancelledError(absl::StrCat("stopped after ", videos, " of ", plan.cameras.size(),
                                               " videos; the same command goes on from there"));
    }
    if (!status.ok()) return status;
    ++videos;
  }
  return absl::OkStatus();
}

}  // namespace weft
