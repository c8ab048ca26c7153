#include "services/studio/recording/take_look.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "capture/image/image_encoders.h"
#include "capture/image/picture_quality.h"
#include "capture/image/thumbnail.h"
#include "capture/take/recorded_take.h"
#include "services/studio/recording/take_file.h"

namespace weft {
namespace {

constexpr int kJpegQuality = 85;
constexpr size_t kLookBack = 100;  // frame sets; a camera that was away for longer has no picture

absl::Status AddPicture(const Frame& frame, int width_px, v1::CameraLook& look) {
  const PictureQuality quality = MeasurePicture(frame);
  look.set_clipped_share(quality.clipped_share);
  look.set_dark_share(quality.dark_share);
  look.set_median_value(quality.middle);
  look.set_focus(quality.focus);
  WEFT_ASSIGN_OR_RETURN(const Frame small, Thumbnail(frame, width_px));
  ImagePixels pixels;
  pixels.width_px = small.width_px;
  pixels.height_px = small.height_px;
  pixels.channels = 3;
  pixels.bytes = *small.pixels;
  WEFT_ASSIGN_OR_RETURN(const std::vector<uint8_t> jpeg, EncodeJpeg(pixels, kJpegQuality));
  look.set_jpeg(jpeg.data(), jpeg.size());
  return absl::OkStatus();
}

// `newest`: position of the set to begin with; `look_back`: how many sets may stand in for one without a
// frame.
absl::Status LookAtCamera(const RecordedTake& take, size_t camera, size_t newest, size_t look_back,
                          int width_px, v1::CameraLook& look) {
  absl::Status problem = absl::NotFoundError("it has no frame");
  for (size_t back = 0; back < std::min(newest + 1, look_back); ++back) {
    const size_t index = newest - back;
    const absl::StatusOr<RawFrame> raw = take.ReadRaw(index, camera);
    if (!raw.ok()) {
      if (back == 0) problem = raw.status();
      continue;
    }
    look.set_set(take.sets()[index]);
    look.mutable_camera()->set_width_px(raw->width_px);
    look.mutable_camera()->set_height_px(raw->height_px);
    look.mutable_camera()->set_pixel_format(std::string(RawFormatName(raw->format)));
    const absl::StatusOr<Frame> frame = ToFrame(*raw);
    return frame.ok() ? AddPicture(*frame, width_px, look) : frame.status();
  }
  return problem;
}

}  // namespace

absl::StatusOr<std::vector<v1::CameraLook>> LookAtTake(const std::string& folder,
                                                       const TakeLookOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<RecordedTake> take, RecordedTake::Open(folder));
  if (take->sets().empty()) {
    return absl::FailedPreconditionError(absl::StrCat(folder, ": has no frame set yet; look again later"));
  }
  const std::vector<uint64_t>& sets = take->sets();
  size_t newest = sets.size() - 1, look_back = kLookBack;
  if (!options.frame.empty()) {
    const auto found =
        std::ranges::find_if(sets, [&](uint64_t set) { return FrameNameOf(set) == options.frame; });
    if (found == sets.end())
      return absl::NotFoundError(
          absl::StrCat(folder, ": has no frame set \"", EscapedText(options.frame), "\""));
    newest = static_cast<size_t>(found - sets.begin());
    look_back = 1;
  }
  WEFT_ASSIGN_OR_RETURN(const v1::Take described, ReadTakeFile(folder));
  std::vector<v1::CameraLook> looks;
  for (size_t i = 0; i < take->camera_ids().size(); ++i) {
    const std::string& id = take->camera_ids()[i];
    if (!options.camera_id.empty() && options.camera_id != id) continue;
    v1::CameraLook look;
    look.mutable_camera()->set_id(id);
    for (const v1::TakeCamera& camera : described.cameras()) {
      if (camera.id() == id) *look.mutable_camera() = camera;
    }
    const absl::Status status = LookAtCamera(*take, i, newest, look_back, options.width_px, look);
    if (!status.ok()) look.set_problem(std::string(status.message()));
    looks.push_back(std::move(look));
  }
  if (!looks.empty()) return looks;
  return absl::NotFoundError(absl::StrCat(folder, ": has no camera \"", options.camera_id, "\""));
}

}  // namespace weft
