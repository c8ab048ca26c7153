#include "services/results/report/frame_overlays.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"
#include "capture/image/thumbnail.h"
#include "capture/take/open_dump.h"
#include "services/formats/files/rig_file.h"
#include "services/results/report/image_overlay.h"

namespace weft {
namespace {

bool IsThere(const std::string& path) { return !path.empty() && PathExists(path); }

}  // namespace

absl::StatusOr<JobImages> JobImages::Open(const v1::Job& job) {
  const v1::RegistrationSpec& spec = job.spec();
  for (const std::string& path : {spec.dump(), spec.rig()})
    if (!IsThere(path)) return absl::NotFoundError(absl::StrCat(path, ": is not there any more"));
  WEFT_ASSIGN_OR_RETURN(Rig rig, ReadRig(spec.rig()));
  if (!job.inputs().rig().empty() && rig.ContentHash() != job.inputs().rig())
    return absl::FailedPreconditionError(absl::StrCat(spec.rig(), ": has hash ", rig.ContentHash(),
                                                      ", the job was computed with ", job.inputs().rig()));
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<FrameSource> dump,
                        OpenDump(spec.dump(), rig, spec.options().mosaic()));
  JobImages out;
  out.rig_ = std::move(rig), out.dump_ = std::move(dump);
  return out;
}

std::vector<size_t> CamerasToShow(const Rig& rig, const v1::FrameReport& report) {
  constexpr double kOtherSide = 0.5;            // cosine: 60 degrees
  std::vector<std::pair<int, size_t>> readers;  // cells, position in the rig
  for (const v1::ViewReport& view : report.views()) {
    const int camera = rig.IndexOf(view.camera());
    if (camera >= 0 && view.missing_reason().empty() && view.centers() > 0)
      readers.emplace_back(view.centers(), static_cast<size_t>(camera));
  }
  std::ranges::stable_sort(readers, [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<size_t> shown;
  const auto axis = [&](size_t camera) { return rig.cameras[camera].rotation.row(2); };
  for (const auto& [cells, camera] : readers) {
    if (shown.empty()) {
      shown.push_back(camera);
    } else if (axis(camera).dot(axis(shown[0])) < kOtherSide) {
      shown.push_back(camera);
      break;
    }
  }
  return shown;
}

std::vector<MeshPicture> JobImages::Plain(const v1::FrameReport& report) const {
  constexpr int kLongestSidePx = 560, kJpegQuality = 82;
  const std::vector<std::string>& names = dump_->frame_names();
  const auto at = std::ranges::find(names, report.frame());
  std::vector<MeshPicture> pictures;
  if (at == names.end()) return pictures;
  std::vector<size_t> cameras = CamerasToShow(rig_, report);
  for (size_t c = 0; cameras.empty() && c < std::min<size_t>(2, rig_.cameras.size()); ++c)
    cameras.push_back(c);
  if (cameras.size() == 1 && rig_.cameras.size() > 1) cameras.push_back(cameras[0] == 0 ? 1 : 0);
  for (const size_t camera : cameras) {
    const absl::StatusOr<Frame> image = dump_->ReadView(static_cast<size_t>(at - names.begin()), camera);
    if (!image.ok()) continue;
    const int longest_px = std::max(image->width_px, image->height_px);
    const absl::StatusOr<Frame> small =
        Thumbnail(*image, std::max(1, std::min(longest_px, kLongestSidePx) * image->width_px / longest_px));
    if (!small.ok()) continue;
    const auto jpeg = EncodeJpeg({small->width_px, small->height_px, 3, 8, *small->pixels}, kJpegQuality);
    if (!jpeg.ok()) continue;
    pictures.push_back({rig_.cameras[camera].id, std::string(jpeg->begin(), jpeg->end()), small->width_px,
                        small->height_px, "image/jpeg"});
  }
  return pictures;
}

std::vector<MeshPicture> JobImages::Overlays(const v1::FrameReport& report, const PicturedMesh& mesh) const {
  const std::vector<std::string>& names = dump_->frame_names();
  const auto at = std::ranges::find(names, report.frame());
  std::vector<MeshPicture> pictures;
  if (at == names.end()) return pictures;
  for (const size_t camera : CamerasToShow(rig_, report)) {
    const absl::StatusOr<Frame> image = dump_->ReadView(static_cast<size_t>(at - names.begin()), camera);
    if (!image.ok()) continue;
    absl::StatusOr<MeshPicture> picture = DrawOverlay(*image, rig_.cameras[camera], mesh.mesh, mesh.faces);
    if (picture.ok()) pictures.push_back(*std::move(picture));
  }
  return pictures;
}

}  // namespace weft
