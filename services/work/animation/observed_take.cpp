#include "services/work/animation/observed_take.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/named_status.h"
#include "base/random.h"
#include "base/status_macros.h"
#include "capture/take/frame_source.h"
#include "capture/take/open_dump.h"
#include "pattern/board/board_index.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/rig_file.h"
#include "services/work/animation/cloth_take.h"
#include "services/work/animation/driving_views.h"
#include "services/work/animation/filmed_views.h"
#include "services/work/animation/truth_views.h"
#include "services/work/pipeline/frame_cloud.h"

namespace weft {
namespace {

std::string FileOfTake(const ClothTake& take, const char* name) {
  return (std::filesystem::path(take.folder) / name).string();
}

// The decoder imitated.
class ImitatedTake : public ObservedTake {
 public:
  ImitatedTake(const Template& garment, const BodyShape& body, Rig rig, uint64_t seed)
      : views_(garment, body), rig_(std::move(rig)), seed_(seed) {}
  const Rig& rig() const override { return rig_; }
  absl::StatusOr<std::vector<ViewObservations>> Observe(int frame, const ClothFrame& truth) override {
    return views_.Observe(truth, rig_, MixBits(seed_) ^ static_cast<uint64_t>(frame));
  }

 private:
  TruthViews views_;
  Rig rig_;
  uint64_t seed_;
};

// Pictures, decoded.
class DecodedTake : public ObservedTake {
 public:
  DecodedTake(Rig rig, BoardIndex board, std::unique_ptr<FrameSource> dump,
              std::vector<size_t> index_of_frame)
      : rig_(std::move(rig)),
        board_(std::move(board)),
        dump_(std::move(dump)),
        index_of_frame_(std::move(index_of_frame)) {}
  const Rig& rig() const override { return rig_; }
  absl::StatusOr<std::vector<ViewObservations>> Observe(int frame, const ClothFrame& /*truth*/) override {
    const FrameImages images{rig_, board_, *dump_, index_of_frame_[static_cast<size_t>(frame)]};
    return DecodeFrame(kNeverKept, images, {}, std::nullopt, {}, {}).views;
  }

 private:
  Rig rig_;
  BoardIndex board_;
  std::unique_ptr<FrameSource> dump_;
  std::vector<size_t> index_of_frame_;
};

// Pictures that are rendered and decoded as they are asked for. What was seen of a frame is kept: several
// drives over one take are of the same pictures.
class FilmedTake : public ObservedTake {
 public:
  FilmedTake(ClothTake take, FilmedViews views, Rig rig)
      : take_(std::move(take)), views_(std::move(views)), rig_(std::move(rig)) {}
  const Rig& rig() const override { return rig_; }
  absl::StatusOr<std::vector<ViewObservations>> Observe(int frame, const ClothFrame& truth) override {
    const auto known = seen_.find(frame);
    if (known != seen_.end()) return known->second;
    WEFT_ASSIGN_OR_RETURN(const ClothFrame before, take_.Read(std::max(frame - 1, 0)));
    WEFT_ASSIGN_OR_RETURN(const ClothFrame after, take_.Read(std::min(frame + 1, take_.frames() - 1)));
    absl::StatusOr<std::vector<ViewObservations>> seen = views_.Observe({truth, before, after, frame}, rig_);
    if (seen.ok()) seen_[frame] = *seen;
    return seen;
  }

 private:
  ClothTake take_;
  FilmedViews views_;
  Rig rig_;
  std::map<int, std::vector<ViewObservations>> seen_;
};

absl::StatusOr<std::unique_ptr<ObservedTake>> FilmTake(ClothTake& take, Rig rig, const Observing& observing) {
  WEFT_ASSIGN_OR_RETURN(const Board board, ReadBoard(FileOfTake(take, "board.json")));
  WEFT_ASSIGN_OR_RETURN(const ClothFrame first, take.Read(0));
  WEFT_ASSIGN_OR_RETURN(FilmedViews views,
                        Naming(take.name(), FilmedViews::Create(observing.garment, board, take.body,
                                                                first.vertices_mm, observing.seed)));
  WEFT_ASSIGN_OR_RETURN(ClothTake own, take.OpenAgain());
  return std::make_unique<FilmedTake>(std::move(own), std::move(views), std::move(rig));
}

absl::StatusOr<std::unique_ptr<ObservedTake>> ObservePictures(const ClothTake& take, Rig rig) {
  const std::string board_path = FileOfTake(take, "board.json");
  WEFT_ASSIGN_OR_RETURN(const Board board, ReadBoard(board_path));
  WEFT_ASSIGN_OR_RETURN(BoardIndex index, Naming(board_path, BoardIndex::Build(board)));
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<FrameSource> dump, OpenDump(take.folder, rig));
  std::vector<size_t> positions;
  const std::vector<std::string>& names = dump->frame_names();
  for (const std::string& frame : take.frame_names()) {
    const auto at = std::ranges::find(names, frame);
    if (at == names.end())
      return absl::NotFoundError(
          absl::StrCat(take.folder, ": has no pictures of frame ", frame, " of its truth"));
    positions.push_back(static_cast<size_t>(at - names.begin()));
  }
  return std::make_unique<DecodedTake>(std::move(rig), std::move(index), std::move(dump),
                                       std::move(positions));
}

Rig EvenlyChosen(const Rig& rig, size_t cameras) {
  Rig out;
  out.id = rig.id;
  for (size_t k = 0; k < cameras; ++k) out.cameras.push_back(rig.cameras[k * rig.cameras.size() / cameras]);
  return out;
}

}  // namespace

VertexRays DirectionsOf(const std::vector<ViewObservations>& seen, const Rig& rig, const Template& garment,
                        const NodeVertices& nodes) {
  VertexRays out(garment.rest.vertices_mm.size());
  for (const DrivingView& view : DrivingViewsOf(seen, rig))
    for (const Observation& o : view.observations) {
      const int vertex = nodes.VertexOf(o.node);
      const auto ray = view.camera->PixelRay({o.x_px, o.y_px});
      if (vertex >= 0 && ray) out.Add(static_cast<size_t>(vertex), ray->direction);
    }
  return out;
}

absl::StatusOr<std::unique_ptr<ObservedTake>> ObserveFrom(ClothTake& take, Rig rig,
                                                          const Observing& observing) {
  if (observing.films) return FilmTake(take, std::move(rig), observing);
  return std::make_unique<ImitatedTake>(observing.garment, take.body, std::move(rig), observing.seed);
}

absl::StatusOr<std::unique_ptr<ObservedTake>> ObserveTake(ClothTake& take, int cameras,
                                                          const Observing& observing) {
  const auto wanted = static_cast<size_t>(cameras);
  const bool has_pictures = !take.frame_names().empty();
  const absl::StatusOr<Rig> rig = ReadRig(FileOfTake(take, "rig.json"));
  if (has_pictures) {
    if (!rig.ok()) return rig.status();
    if (rig->cameras.size() < wanted)
      return absl::OutOfRangeError(
          absl::StrCat(take.name(), " has pictures of ", rig->cameras.size(), " cameras, not of ", cameras));
    return ObservePictures(take, EvenlyChosen(*rig, wanted));
  }
  if (rig.ok() && rig->cameras.size() == wanted) return ObserveFrom(take, *rig, observing);
  WEFT_ASSIGN_OR_RETURN(const ClothFrame first, take.Read(0));
  WEFT_ASSIGN_OR_RETURN(Rig around, DrivingRig(cameras, first.vertices_mm, observing.seed));
  return ObserveFrom(take, std::move(around), observing);
}

}  // namespace weft
