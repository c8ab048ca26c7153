#include "services/synthetic/take_writer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/image_file.h"
#include "services/files/atomic_file.h"
#include "services/files/board_file.h"
#include "services/files/rig_file.h"
#include "services/files/template_file.h"
#include "services/synthetic/truth_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// A folder under a temporary name; it goes away unless it is kept.
class PartialFolder {
 public:
  explicit PartialFolder(const std::string& final_path)
      : final_path_(final_path), path_(absl::StrCat(final_path, ".partial-", getpid())) {}
  ~PartialFolder() {
    std::error_code error;
    if (!path_.empty()) fs::remove_all(path_, error);
  }
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;

  const std::string& path() const { return path_; }

  absl::Status Keep() {
    std::error_code error;
    fs::rename(path_, final_path_, error);
    if (error) {
      return absl::UnavailableError(
          absl::StrCat(final_path_, ": cannot be put in place (", error.message(), ")"));
    }
    path_.clear();
    return absl::OkStatus();
  }

 private:
  std::string final_path_;
  std::string path_;
};

// `out` without a trailing slash; AlreadyExists when something stands there.
absl::StatusOr<std::string> FreePlace(const std::string& out) {
  fs::path path = fs::path(out).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_empty(path, error)) {
    return absl::AlreadyExistsError(
        absl::StrCat(path.string(), ": exists and is not an empty folder; remove it or choose another"));
  }
  return path.string();
}

struct Tally {
  // Counts of the scoreable cells by pitch; a long take has hundreds of millions.
  static constexpr double kStepPx = 0.01;
  std::vector<uint64_t> cells_by_pitch = std::vector<uint64_t>(10000, 0);
  uint64_t cells = 0;
  size_t views = 0;
  int lost = 0;
  std::string pictures_csv = "frame,camera,mid_exposure_ns,lost\n";

  void Add(double pitch_px) {
    const double step = std::clamp(pitch_px / kStepPx, 0.0, static_cast<double>(cells_by_pitch.size() - 1));
    ++cells_by_pitch[static_cast<size_t>(step)];
    ++cells;
  }
  double MedianPitchPx() const {
    uint64_t below = 0;
    size_t step = 0;
    while (step + 1 < cells_by_pitch.size() && 2 * (below += cells_by_pitch[step]) < cells) ++step;
    return (static_cast<double>(step) + 0.5) * kStepPx;
  }
};

// Values scaled to 16 bits, so that white is white whatever the number of bits.
DeepImage ToDeepImage(const Picture& picture) {
  DeepImage out{picture.width_px, picture.height_px, picture.channels(), picture.values};
  const uint32_t most = (1U << picture.bits) - 1;
  for (uint16_t& v : out.values) v = static_cast<uint16_t>((v * 65535U + most / 2) / most);
  return out;
}

absl::Status WritePicture(const std::string& path, const Picture& picture, const TakeFileOptions& options) {
  if (picture.bits > 8) return WriteDeepImageFile(path, ToDeepImage(picture));
  return WriteImageFile(path, ToFrame(picture), options.jpeg_quality);
}

// One frame: its pictures and its truth.
absl::Status WriteFrame(const SyntheticTake& take, const TakeFrame& frame, const std::string& folder,
                        const TakeFileOptions& options, const std::function<void()>& on_view,
                        const std::stop_token& stop, Tally& tally) {
  const std::string name = absl::StrFormat("%04d", frame.index);
  const std::string pictures = (fs::path(folder) / name).string();
  if (absl::Status status = CreateFolders(pictures); !status.ok()) return status;
  const std::vector<CameraModel>& cameras = take.rig().cameras;
  std::vector<FilmedView> views(cameras.size());
  std::vector<absl::Status> statuses(cameras.size());
  tbb::parallel_for(size_t{0}, cameras.size(), [&](size_t c) {
    if (stop.stop_requested()) {
      statuses[c] = absl::CancelledError(absl::StrCat("stopped at frame ", name));
      return;
    }
    absl::StatusOr<FilmedView> view = take.Film(frame, static_cast<int>(c));
    statuses[c] = view.status();
    if (!view.ok()) return;
    if (view->picture) {
      const std::string path = absl::StrCat(pictures, "/", cameras[c].id, ".", options.image_ending);
      statuses[c] = WritePicture(path, *view->picture, options);
      view->picture->values.clear();
    }
    views[c] = *std::move(view);
    if (on_view) on_view();
  });
  for (const absl::Status& status : statuses)
    if (!status.ok()) return status;
  FrameTruth truth;
  truth.mesh = frame.scene.mesh();
  for (FilmedView& view : views) {
    absl::StrAppend(&tally.pictures_csv, name, ",", view.truth.camera_id, ",", view.mid_exposure_ns, ",",
                    view.picture ? 0 : 1, "\n");
    if (!view.picture) {
      ++tally.lost;
      continue;
    }
    for (const NodeTruth& node : view.truth.nodes)
      if (node.scoreable && node.vertex >= 0) tally.Add(node.pitch_px);
    ++tally.views;
    truth.views.push_back(std::move(view.truth));
  }
  return WriteFrameTruth((fs::path(folder) / "truth" / name).string(), truth);
}

absl::Status WriteStudio(const SyntheticTake& take, const std::string& folder) {
  const std::string provenance = absl::StrCat("made by weft simulate, ", take.options().name);
  if (absl::Status status = CreateFolders(folder); !status.ok()) return status;
  absl::Status status = WriteRig((fs::path(folder) / "rig.json").string(), take.rig(), provenance);
  if (status.ok()) status = WriteBoard(folder, take.board(), provenance);
  if (status.ok())
    status = WriteTemplate((fs::path(folder) / "template").string(), take.garment(), provenance);
  return status;
}

TakeSummary Summarize(const SyntheticTake& take, const Tally& tally) {
  TakeSummary out;
  out.frames = take.frames();
  out.cameras = static_cast<int>(take.rig().cameras.size());
  out.lost_pictures = tally.lost;
  for (const VertexCell& cell : take.garment().cell_of_vertex) out.cells += cell.row >= 0 ? 1 : 0;
  if (tally.cells == 0) return out;
  out.median_pitch_px = tally.MedianPitchPx();
  out.scoreable_per_view = static_cast<double>(tally.cells) / static_cast<double>(tally.views);
  return out;
}

}  // namespace

absl::Status TakeFileOptions::Validate(int bits) const {
  const bool jpeg = image_ending == "jpg" || image_ending == "jpeg";
  if (!jpeg && image_ending != "png" && image_ending != "tif")
    return absl::InvalidArgumentError(
        absl::StrCat("pictures: \"", image_ending, "\" is none of png, jpg, tif"));
  if (jpeg && bits > 8)
    return absl::InvalidArgumentError(
        absl::StrCat("pictures: JPEG holds 8 bits, not ", bits, "; choose png or tif"));
  if (jpeg_quality < 1 || jpeg_quality > 100)
    return absl::InvalidArgumentError(
        absl::StrCat("pictures: jpeg_quality is ", jpeg_quality, ", expected 1 to 100"));
  return absl::OkStatus();
}

absl::StatusOr<TakeSummary> WriteSyntheticTake(SyntheticTake& take, const std::string& out,
                                               const TakeFileOptions& options,
                                               const std::function<void()>& on_view,
                                               const std::stop_token& stop) {
  if (absl::Status status = options.Validate(take.options().camera.sensor.bits); !status.ok()) return status;
  const absl::StatusOr<std::string> place = FreePlace(out);
  if (!place.ok()) return place.status();
  PartialFolder folder(*place);
  if (absl::Status status = WriteStudio(take, folder.path()); !status.ok()) return status;
  Tally tally;
  for (int i = 0; i < take.frames(); ++i) {
    const absl::StatusOr<TakeFrame> frame = take.Next();
    if (!frame.ok()) return frame.status();
    absl::Status status = WriteFrame(take, *frame, folder.path(), options, on_view, stop, tally);
    if (!status.ok()) return status;
  }
  const std::string pictures = (fs::path(folder.path()) / "truth" / "pictures.csv").string();
  absl::Status status = WriteFileAtomically(pictures, tally.pictures_csv);
  if (status.ok()) status = folder.Keep();
  if (!status.ok()) return status;
  return Summarize(take, tally);
}

}  // namespace weft
