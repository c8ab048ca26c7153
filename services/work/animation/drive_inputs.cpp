#include "services/work/animation/drive_inputs.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "capture/take/open_dump.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/take_times.h"
#include "services/formats/files/template_file.h"
#include "services/formats/options/presets.h"
#include "services/work/pipeline/registration_inputs.h"
#include "services/work/spec/job_input.h"

namespace weft {
namespace {

absl::Status CheckGiven(const v1::RegistrationSpec& spec) {
  WEFT_RETURN_IF_ERROR(CheckInputsGiven(spec));
  if (spec.out().empty())
    return absl::InvalidArgumentError("the field spec.out is empty: name a folder for results");
  if (!(spec.driving().fps() >= 0) || !std::isfinite(spec.driving().fps()))
    return absl::InvalidArgumentError("--fps must be positive, or 0 for those of the avatar");
  return absl::OkStatus();
}

// When each frame was taken: by the take, or else at equal intervals.
std::vector<int64_t> TimesOf(const v1::RegistrationSpec& spec, const FrameSource& dump,
                             const std::vector<size_t>& frames, double avatar_fps) {
  const std::string truth = (std::filesystem::path(spec.dump()) / "truth").string();
  const TakeTimes told = TimesOfTake(spec.dump(), truth);
  const double asked = spec.driving().fps(), fps = asked > 0 ? asked : told.fps > 0 ? told.fps : avatar_fps;
  std::vector<int64_t> out;
  bool is_told = asked == 0;
  for (const size_t index : frames) {
    const std::optional<int64_t> time = dump.FrameTime_ns(index);
    is_told = is_told && time && (out.empty() || *time > out.back());
    out.push_back(time.value_or(0));
  }
  if (is_told) return out;
  for (size_t k = 0; k < frames.size(); ++k) {
    const size_t index = frames[k];
    const auto position = index < told.positions.size() ? static_cast<double>(told.positions[index])
                                                        : static_cast<double>(index);
    out[k] = std::llround(1e9 * position / fps);
  }
  return out;
}

}  // namespace

std::vector<std::string> DriveFrameList::Names() const {
  std::vector<std::string> names;
  for (size_t at = 0; at < size(); ++at) names.push_back(NameOf(at));
  return names;
}

absl::StatusOr<v1::RegistrationOptions> EffectiveDriveOptions(const v1::RegistrationOptions& options) {
  WEFT_ASSIGN_OR_RETURN(v1::RegistrationOptions out, EffectiveOptions(options));
  *out.mutable_pipeline() = OfStages(out.pipeline(), {"decode"});
  out.set_frames_alone(true);
  out.set_single_pass(true);
  return out;
}

absl::StatusOr<Rig> CamerasNamed(const Rig& rig, const std::vector<std::string>& names,
                                 const std::string& path) {
  if (names.empty()) return rig;
  std::vector<std::string> there;
  for (const CameraModel& camera : rig.cameras) there.push_back(camera.id);
  for (size_t k = 0; k < names.size(); ++k) {
    if (rig.IndexOf(names[k]) < 0)
      return absl::InvalidArgumentError(absl::StrCat("--cameras: ", path, " has no camera \"", names[k],
                                                     "\"; it has ", absl::StrJoin(there, ", ")));
    if (std::ranges::count(names, names[k]) > 1)
      return absl::InvalidArgumentError(absl::StrCat("--cameras: \"", names[k], "\" is given twice"));
  }
  Rig out;
  out.id = rig.id;
  for (const CameraModel& camera : rig.cameras)
    if (std::ranges::count(names, camera.id) > 0) out.cameras.push_back(camera);
  return out;
}

v1::DrivenJob DescribeDriving(const v1::RegistrationSpec& spec, const DriveInputs& inputs) {
  v1::DrivenJob driven;
  driven.set_avatar(spec.driving().avatar());
  driven.set_avatar_checksum(ChecksumOfAvatar(inputs.avatar.about));
  for (const CameraModel& camera : inputs.rig.cameras) driven.add_cameras(camera.id);
  return driven;
}

absl::StatusOr<std::unique_ptr<DriveInputs>> LoadDriveInputs(const v1::RegistrationSpec& spec,
                                                             NetReading reading) {
  WEFT_RETURN_IF_ERROR(CheckGiven(spec));
  WEFT_ASSIGN_OR_RETURN(const JobOptions options, MakeJobOptions(spec.options()));
  WEFT_ASSIGN_OR_RETURN(const Rig rig, ReadRig(spec.rig()));
  const auto& names = spec.driving().cameras();
  WEFT_ASSIGN_OR_RETURN(Rig used, CamerasNamed(rig, {names.begin(), names.end()}, spec.rig()));
  WEFT_ASSIGN_OR_RETURN(const Board board, ReadBoard(spec.board()));
  std::vector<std::string> warnings;
  WEFT_ASSIGN_OR_RETURN(Template garment, ReadTemplateFor(board, spec.garment(), &warnings));
  v1::InputHashes hashes;
  hashes.set_rig(rig.ContentHash());
  hashes.set_board(board.ContentHash());
  hashes.set_garment(garment.ContentHash());
  WEFT_RETURN_IF_ERROR(CheckExpectedHashes(spec, hashes));
  const std::string& avatar_path = spec.driving().avatar();
  WEFT_ASSIGN_OR_RETURN(AvatarFile avatar, ReadAvatar(avatar_path, reading));
  WEFT_RETURN_IF_ERROR(CheckAvatarFits(avatar.about, avatar_path, garment, spec.garment()));
  WEFT_ASSIGN_OR_RETURN(GarmentParts parts, ReadGarmentParts(spec.garment()));
  parts.board_rows = board.rows, parts.board_cols = board.cols;
  WEFT_ASSIGN_OR_RETURN(BoardIndex index, Naming(spec.board(), BoardIndex::Build(board)));
  MeshTexture texture = TextureOf(garment, parts);
  MeshGraph graph = BuildMeshGraph(garment.rest);
  return std::make_unique<DriveInputs>(
      DriveInputs{std::move(used), std::move(index), std::move(garment), std::move(graph), std::move(texture),
                  std::move(avatar), std::move(hashes), options.pipeline.decode, std::move(warnings)});
}

absl::StatusOr<DriveFrameList> ListDriveFrames(const v1::RegistrationSpec& spec, DriveInputs& inputs) {
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<FrameSource> dump,
                        OpenDump(spec.dump(), inputs.rig, spec.options().mosaic()));
  WEFT_ASSIGN_OR_RETURN(std::vector<size_t> frames, FramesInRange(spec, dump->frame_names()));
  // The pictures of cameras that are left out on purpose are no strangers.
  if (spec.driving().cameras().empty())
    inputs.warnings.insert(inputs.warnings.end(), dump->warnings().begin(), dump->warnings().end());
  std::vector<int64_t> time_ns = TimesOf(spec, *dump, frames, inputs.avatar.avatar.fps);
  return DriveFrameList{std::move(dump), std::move(frames), std::move(time_ns)};
}

}  // namespace weft
