#include "services/formats/synthetic/take_writer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "alignment/untangle/self_intersection.h"
#include "base/status_macros.h"
#include "capture/image/image_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/synthetic/studio_files.h"
#include "services/formats/synthetic/truth_file.h"

namespace weft {
namespace {

struct Tally {
  // Counts of the scoreable cells by pitch; a long take has hundreds of millions.
  static constexpr double kStepPx = 0.01;
  std::vector<uint64_t> cells_by_pitch = std::vector<uint64_t>(10000, 0);
  uint64_t cells = 0;
  size_t views = 0;
  int intersecting_frames = 0;

  void Add(const FrameTruth& truth) {
    if (!FindIntersectingPairs(truth.mesh.vertices_mm, truth.mesh.faces).empty()) ++intersecting_frames;
    views += truth.views.size();
    for (const ViewTruth& view : truth.views)
      for (const NodeTruth& node : view.nodes)
        if (node.scoreable && node.vertex >= 0) Add(node.pitch_px);
  }
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
absl::Status WriteFrame(const SyntheticTake& take, const TakeFrame& frame, const TakeFolder& folder,
                        const TakeFileOptions& options, const std::function<void()>& on_view,
                        const std::stop_token& stop, Tally& tally) {
  WEFT_ASSIGN_OR_RETURN(const TakeFolder::Draft draft, folder.BeginFrame(frame.index));
  const std::vector<CameraModel>& cameras = take.rig().cameras;
  std::vector<FilmedView> views(cameras.size());
  std::vector<absl::Status> statuses(cameras.size());
  tbb::parallel_for(size_t{0}, cameras.size(), [&](size_t c) {
    if (stop.stop_requested()) {
      statuses[c] = absl::CancelledError(absl::StrCat("stopped at frame ", TakeFolder::NameOf(frame.index),
                                                      "; the same command resumes it"));
      return;
    }
    absl::StatusOr<FilmedView> view = take.Film(frame, static_cast<int>(c));
    statuses[c] = view.status();
    if (!view.ok()) return;
    if (view->picture) {
      const std::string path = absl::StrCat(draft.pictures, "/", cameras[c].id, ".", options.image_ending);
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
  for (FilmedView& view : views)
    if (view.picture) truth.views.push_back(std::move(view.truth));
  WEFT_RETURN_IF_ERROR(WriteFrameTruth(draft.truth, truth));
  tally.Add(truth);
  return folder.KeepFrame(frame.index);
}

// A frame that was finished before the take was stopped.
absl::Status CountFrame(const TakeFolder& folder, int frame, Tally& tally) {
  const absl::StatusOr<FrameTruth> truth = ReadFrameTruth(folder.TruthOf(frame));
  // Without a single picture there is nothing to count.
  if (absl::IsNotFound(truth.status())) return absl::OkStatus();
  if (truth.ok()) tally.Add(*truth);
  return truth.status();
}

// When each camera looked, and what was lost.
std::string PicturesTable(const SyntheticTake& take) {
  std::string out = "frame,camera,mid_exposure_ns,lost\n";
  for (int frame = 0; frame < take.frames(); ++frame)
    for (const CameraModel& camera : take.rig().cameras) {
      const Shot shot = take.ShotOf(frame, camera.id);
      absl::StrAppend(&out, TakeFolder::NameOf(frame), ",", camera.id, ",", shot.mid_exposure_ns, ",",
                      shot.lost ? 1 : 0, "\n");
    }
  return out;
}

int CountLost(const SyntheticTake& take) {
  int lost = 0;
  for (int frame = 0; frame < take.frames(); ++frame)
    for (const CameraModel& camera : take.rig().cameras) lost += take.ShotOf(frame, camera.id).lost ? 1 : 0;
  return lost;
}

TakeSummary Summarize(const SyntheticTake& take, const Tally& tally) {
  TakeSummary out;
  out.frames = take.frames();
  out.cameras = static_cast<int>(take.rig().cameras.size());
  out.lost_pictures = CountLost(take);
  out.intersecting_frames = tally.intersecting_frames;
  for (const VertexNode& cell : take.garment().node_of_vertex) out.cells += cell.IsCell() ? 1 : 0;
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

absl::StatusOr<TakeSummary> WriteSyntheticTake(SyntheticTake& take, const TakeFolder& folder,
                                               const TakeFileOptions& options,
                                               const std::function<void()>& on_view,
                                               const std::stop_token& stop) {
  WEFT_RETURN_IF_ERROR(options.Validate(take.options().camera.sensor.bits));
  WEFT_RETURN_IF_ERROR(WriteStudio(take, folder.path()));
  Tally tally;
  absl::StatusOr<TakeFrame> frame = absl::UnavailableError("no frame was made yet");
  for (int i = 0; i < take.frames(); ++i) {
    if (folder.HasFrame(i)) {
      absl::Status status = CountFrame(folder, i, tally);
      if (status.ok() && take.next() == i) status = take.Skip();
      if (!status.ok()) return status;
      for (size_t c = 0; on_view && c < take.rig().cameras.size(); ++c) on_view();
      continue;
    }
    if (take.next() == i) frame = take.Next();
    if (!frame.ok()) return frame.status();
    // The cloth moves on while this frame is filmed.
    absl::Status status;
    absl::StatusOr<TakeFrame> following = absl::UnavailableError("the take is over");
    tbb::parallel_invoke([&] { status = WriteFrame(take, *frame, folder, options, on_view, stop, tally); },
                         [&] {
                           if (i + 1 < take.frames() && !folder.HasFrame(i + 1)) following = take.Next();
                         });
    if (!status.ok()) return status;
    frame = std::move(following);
  }
  WEFT_RETURN_IF_ERROR(WriteFileAtomically(folder.PicturesCsv(), PicturesTable(take)));
  return Summarize(take, tally);
}

}  // namespace weft
