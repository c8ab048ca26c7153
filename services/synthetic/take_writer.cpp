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
  std::vector<double> pitches_px;
  size_t views = 0;
};

// One frame: its pictures and its truth.
absl::Status WriteFrame(const SyntheticTake& take, int frame, const std::string& folder,
                        const std::function<void()>& on_view, const std::stop_token& stop, Tally& tally) {
  const std::string name = absl::StrFormat("%04d", frame);
  const std::string pictures = (fs::path(folder) / name).string();
  if (absl::Status status = CreateFolders(pictures); !status.ok()) return status;
  const absl::StatusOr<StudioScene> scene = take.SceneAt(frame);
  if (!scene.ok()) return scene.status();
  const size_t cameras = take.rig().cameras.size();
  FrameTruth truth;
  truth.mesh = scene->mesh();
  truth.views.resize(cameras);
  std::vector<absl::Status> statuses(cameras);
  tbb::parallel_for(size_t{0}, cameras, [&](size_t c) {
    if (stop.stop_requested()) {
      statuses[c] = absl::CancelledError(absl::StrCat("stopped at frame ", name));
      return;
    }
    const absl::StatusOr<Frame> picture = take.Render(*scene, frame, static_cast<int>(c));
    statuses[c] = picture.status();
    if (!picture.ok()) return;
    statuses[c] = WriteImageFile(absl::StrCat(pictures, "/", take.rig().cameras[c].id, ".png"), *picture);
    truth.views[c] = take.Truth(*scene, static_cast<int>(c));
    if (on_view) on_view();
  });
  for (const absl::Status& status : statuses)
    if (!status.ok()) return status;
  for (const ViewTruth& view : truth.views)
    for (const NodeTruth& node : view.nodes)
      if (node.scoreable && node.vertex >= 0) tally.pitches_px.push_back(node.pitch_px);
  tally.views += cameras;
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

TakeSummary Summarize(const SyntheticTake& take, Tally& tally) {
  TakeSummary out;
  out.frames = take.frames();
  out.cameras = static_cast<int>(take.rig().cameras.size());
  for (const VertexCell& cell : take.garment().cell_of_vertex) out.cells += cell.row >= 0 ? 1 : 0;
  if (tally.pitches_px.empty()) return out;
  const auto middle = tally.pitches_px.begin() + static_cast<std::ptrdiff_t>(tally.pitches_px.size() / 2);
  std::nth_element(tally.pitches_px.begin(), middle, tally.pitches_px.end());
  out.median_pitch_px = *middle;
  out.scoreable_per_view = static_cast<double>(tally.pitches_px.size()) / static_cast<double>(tally.views);
  return out;
}

}  // namespace

absl::StatusOr<TakeSummary> WriteSyntheticTake(const SyntheticTake& take, const std::string& out,
                                               const std::function<void()>& on_view,
                                               const std::stop_token& stop) {
  const absl::StatusOr<std::string> place = FreePlace(out);
  if (!place.ok()) return place.status();
  PartialFolder folder(*place);
  if (absl::Status status = WriteStudio(take, folder.path()); !status.ok()) return status;
  Tally tally;
  for (int frame = 0; frame < take.frames(); ++frame) {
    if (absl::Status status = WriteFrame(take, frame, folder.path(), on_view, stop, tally); !status.ok())
      return status;
  }
  if (absl::Status status = folder.Keep(); !status.ok()) return status;
  return Summarize(take, tally);
}

}  // namespace weft
