#include "simulation/synthetic_take.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "simulation/random.h"

namespace weft {
namespace {

constexpr double kMaxExposureMs = 100;

// Middle of a camera's exposure after the frame's time.
double OffsetMsOf(const SyntheticTakeOptions& o, const std::string& camera_id) {
  return o.shutter.time_offset_ms * (2 * UniformOf(KeyOf(o.seed, camera_id + " offset"), 0) - 1);
}

bool IsDropped(const SyntheticTakeOptions& o, const std::string& camera_id, int frame) {
  return UniformOf(KeyOf(o.seed, camera_id + " drop"), static_cast<uint64_t>(frame)) < o.shutter.drop_rate;
}

// One board for all garments of an outfit becomes one of several parts.
void SplitBoard(const Garment& garment, Board& board) {
  if (garment.worn.empty()) return;
  board.panels.assign(board.cells.size(), 0);
  uint8_t label = 0;
  for (const WornGarment& worn : garment.worn) {
    ++label;
    for (int row = worn.first_row; row < worn.first_row + worn.rows; ++row)
      std::fill_n(board.panels.begin() + static_cast<ptrdiff_t>(row) * board.cols, worn.cols, label);
    board.parts.push_back({absl::StrCat(board.id, "-", worn.name), worn.first_row, worn.rows, worn.cols,
                           garment.cell_mm, false});
  }
}

}  // namespace

absl::Status ShutterOptions::Validate() const {
  const auto bad = [](const char* field, double value, const char* expected) {
    return absl::InvalidArgumentError(
        absl::StrCat("shutter: ", field, " is ", value, ", expected ", expected));
  };
  if (!(exposure_ms >= 0 && exposure_ms <= kMaxExposureMs))
    return bad("exposure_ms", exposure_ms, "0 to 100");
  if (!(time_offset_ms >= 0 && time_offset_ms <= kMaxExposureMs))
    return bad("time_offset_ms", time_offset_ms, "0 to 100");
  if (!(drop_rate >= 0 && drop_rate <= 1)) return bad("drop_rate", drop_rate, "0 to 1");
  return absl::OkStatus();
}

absl::Status SyntheticTakeOptions::Validate() const {
  absl::Status status = performance.Validate();
  status.Update(given_rig ? given_rig->Validate() : rig.Validate());
  status.Update(look.Validate());
  status.Update(camera.Validate());
  status.Update(shutter.Validate());
  if (crop_margin_mm >= 0 && !given_rig)
    status.Update(absl::InvalidArgumentError(
        "take: pictures can only be cropped for given cameras; name them with --rig"));
  return status;
}

absl::StatusOr<SyntheticTake> SyntheticTake::Make(const SyntheticTakeOptions& options,
                                                  const std::function<void(double)>& on_progress) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(Performance performance, Performance::Start(options.performance, on_progress));
  WEFT_ASSIGN_OR_RETURN(PerformanceFrame first, performance.Next());
  SyntheticTake take(std::move(performance));
  for (const Eigen::Vector3d& v : first.vertices_mm) take.first_box_mm_.extend(v);
  take.first_ = std::move(first);
  WEFT_RETURN_IF_ERROR(take.SetUp(options));
  return take;
}

absl::StatusOr<SyntheticTake> SyntheticTake::Resume(const SyntheticTakeOptions& options,
                                                    std::string_view state) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  std::array<double, 6> box;
  if (state.size() < sizeof box) return absl::DataLossError("take: the saved state is cut off");
  std::memcpy(box.data(), state.data(), sizeof box);
  WEFT_ASSIGN_OR_RETURN(Performance performance,
                        Performance::Resume(options.performance, state.substr(sizeof box)));
  SyntheticTake take(std::move(performance));
  take.first_box_mm_ = Eigen::AlignedBox3d(Eigen::Vector3d(box.data()), Eigen::Vector3d(box.data() + 3));
  take.next_ = take.performance_.next();
  WEFT_RETURN_IF_ERROR(take.SetUp(options));
  return take;
}

absl::StatusOr<std::string> SyntheticTake::SaveState() {
  if (first_) return absl::FailedPreconditionError("take: no frame was taken yet, so there is no state");
  WEFT_ASSIGN_OR_RETURN(std::string state, performance_.SaveState());
  std::array<double, 6> box;
  Eigen::Map<Eigen::Vector3d>(box.data()) = first_box_mm_.min();
  Eigen::Map<Eigen::Vector3d>(box.data() + 3) = first_box_mm_.max();
  return std::string(reinterpret_cast<const char*>(box.data()), sizeof box) + state;
}

absl::Status SyntheticTake::SetUp(const SyntheticTakeOptions& options) {
  const Garment& garment = performance_.garment();
  WEFT_ASSIGN_OR_RETURN(Board board,
                        GenerateBoard(garment.board_rows, garment.board_cols, garment.cell_mm, options.seed));
  board.id = options.name;
  SplitBoard(garment, board);
  WEFT_ASSIGN_OR_RETURN(Template imported,
                        ImportTemplate(options.name, garment.rest, garment.cell_of_vertex, board));

  options_ = options;
  board_ = std::move(board);
  garment_ = std::move(imported);
  for (const WornGarment& worn : garment.worn)
    garment_.garments.push_back({worn.name, worn.first_vertex, worn.vertices, worn.first_face, worn.faces});
  WEFT_RETURN_IF_ERROR(ChooseShown());
  return PlaceGarment();
}

absl::Status SyntheticTake::ChooseShown() {
  const Garment& garment = performance_.garment();
  shown_faces_ = garment.rest.faces;
  if (options_.show.empty()) return absl::OkStatus();
  std::string names;
  for (const WornGarment& worn : garment.worn) {
    absl::StrAppend(&names, names.empty() ? "" : ", ", worn.name);
    if (worn.name != options_.show) continue;
    const auto of_part = [&](const auto& all) {
      return std::remove_cvref_t<decltype(all)>(all.begin() + worn.first_face,
                                                all.begin() + worn.first_face + worn.faces);
    };
    shown_faces_ = of_part(garment.rest.faces);
    print_.of_face = of_part(garment.print.of_face);
    locator_ = PrintLocator(print_);
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      garment.worn.empty()
          ? absl::StrCat("take: show is \"", options_.show, "\", but there is one garment only")
          : absl::StrCat("take: show is \"", options_.show, "\", which is none of ", names));
}

absl::Status SyntheticTake::PlaceGarment() {
  const Eigen::AlignedBox3d& box = first_box_mm_;
  if (!options_.given_rig) {
    StudioRigOptions rig = options_.rig;
    rig.aim_mm += box.center();
    WEFT_ASSIGN_OR_RETURN(Rig made, MakeStudioRig(options_.name, rig));
    rig_ = std::move(made);
    options_.look.room.center_mm = box.center().cast<float>();
    return absl::OkStatus();
  }
  rig_ = *options_.given_rig;
  const Eigen::Vector3d volume_mm = AimOf(rig_);
  place_mm_ = volume_mm - box.center();
  options_.look.room.center_mm = volume_mm.cast<float>();
  if (options_.crop_margin_mm < 0) return absl::OkStatus();
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(options_.crop_margin_mm);
  WEFT_ASSIGN_OR_RETURN(Rig cropped, CropRig(rig_, Eigen::AlignedBox3d(box.min() + place_mm_ - margin,
                                                                       box.max() + place_mm_ + margin)));
  rig_ = std::move(cropped);
  return absl::OkStatus();
}

absl::StatusOr<PerformanceFrame> SyntheticTake::NextMoment() {
  absl::StatusOr<PerformanceFrame> moment = first_ ? *std::move(first_) : performance_.Next();
  first_.reset();
  if (moment.ok()) ++next_;
  return moment;
}

absl::Status SyntheticTake::Skip() { return NextMoment().status(); }

absl::StatusOr<PerformanceFrame> SyntheticTake::NextCloth() {
  WEFT_ASSIGN_OR_RETURN(PerformanceFrame moment, NextMoment());
  for (auto* part : {&moment.vertices_mm, &moment.body_vertices_mm})
    for (Eigen::Vector3d& v : *part) v += place_mm_;
  if (moment.pose) moment.pose->root_mm += place_mm_;
  return moment;
}

Shot SyntheticTake::ShotOf(int frame, const std::string& camera_id) const {
  const double time_ns = frame * 1e9 / options_.performance.fps;
  return {std::llround(time_ns) + std::llround(1e6 * OffsetMsOf(options_, camera_id)),
          IsDropped(options_, camera_id, frame)};
}

absl::StatusOr<TakeFrame> SyntheticTake::Next() {
  WEFT_ASSIGN_OR_RETURN(PerformanceFrame moment, NextMoment());
  MovingMesh cloth{{std::move(moment.vertices_mm), shown_faces_}, std::move(moment.velocities_mm_s)};
  MovingMesh body{{std::move(moment.body_vertices_mm), performance_.body_faces()},
                  std::move(moment.body_velocities_mm_s)};
  for (MovingMesh* part : {&cloth, &body})
    for (Eigen::Vector3d& v : part->mesh.vertices_mm) v += place_mm_;
  WEFT_ASSIGN_OR_RETURN(const StudioScene scene,
                        StudioScene::Build(std::move(cloth), print_, board_, std::move(body), options_.look));
  WEFT_ASSIGN_OR_RETURN(StudioScene exposed, scene.Exposed(0, options_.shutter.exposure_ms / 1000));
  return TakeFrame{next_ - 1, moment.time_ns, std::move(exposed)};
}

absl::StatusOr<FilmedView> SyntheticTake::Film(const TakeFrame& frame, int camera) const {
  const CameraModel& model = rig_.cameras[camera];
  const double offset_ms = OffsetMsOf(options_, model.id);
  FilmedView out;
  const Shot shot = ShotOf(frame.index, model.id);
  out.mid_exposure_ns = shot.mid_exposure_ns;
  out.truth.camera_id = model.id;
  if (shot.lost) return out;
  std::optional<StudioScene> own;
  if (offset_ms != 0) {
    WEFT_ASSIGN_OR_RETURN(StudioScene moved,
                          frame.scene.Exposed(offset_ms / 1000, options_.shutter.exposure_ms / 1000));
    own = std::move(moved);
  }
  const StudioScene& scene = own ? *own : frame.scene;
  WEFT_ASSIGN_OR_RETURN(Picture picture, RenderView(scene, model, options_.camera, frame.index));
  out.picture = std::move(picture);
  out.truth = FindViewTruth(scene.mesh(), locator_, scene.rays(), model);
  return out;
}

}  // namespace weft
