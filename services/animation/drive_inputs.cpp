#include "services/animation/drive_inputs.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "capture/take/open_dump.h"
#include "services/evaluation/listed_frames.h"
#include "services/files/board_file.h"
#include "services/files/garment_parts_file.h"
#include "services/files/rig_file.h"
#include "services/files/template_file.h"
#include "services/pipeline/registration_inputs.h"

namespace weft {
namespace {

absl::Status CheckNotEmpty(const DriveRequest& request) {
  const std::pair<const char*, const std::string*> paths[] = {
      {"the take", &request.spec.dump()}, {"--rig", &request.spec.rig()},
      {"--board", &request.spec.board()}, {"--template", &request.spec.garment()},
      {"--avatar", &request.avatar},      {"--out", &request.spec.out()}};
  for (const auto& [name, path] : paths)
    if (path->empty()) return absl::InvalidArgumentError(absl::StrCat(name, " is empty"));
  return absl::OkStatus();
}

// When each frame was taken: by the take, or else at equal intervals.
std::vector<int64_t> TimesOf(const DriveRequest& request, const FrameSource& dump,
                             const std::vector<size_t>& frames, double avatar_fps) {
  const std::string truth = (std::filesystem::path(request.spec.dump()) / "truth").string();
  const double told = TimesOfTake(request.spec.dump(), truth).fps;
  const double fps = request.fps > 0 ? request.fps : told > 0 ? told : avatar_fps;
  std::vector<int64_t> out;
  bool is_told = request.fps == 0;
  for (const size_t index : frames) {
    const std::optional<int64_t> time = dump.FrameTime_ns(index);
    is_told = is_told && time && (out.empty() || *time > out.back());
    out.push_back(time.value_or(0));
  }
  if (is_told) return out;
  for (size_t k = 0; k < frames.size(); ++k)
    out[k] = std::llround(1e9 * static_cast<double>(frames[k]) / fps);
  return out;
}

}  // namespace

absl::StatusOr<Rig> CamerasNamed(const Rig& rig, const std::vector<std::string>& names,
                                 const std::string& path) {
  if (names.empty()) return rig;
  std::vector<std::string> there;
  for (const CameraModel& camera : rig.cameras) there.push_back(camera.id);
  for (size_t k = 0; k < names.size(); ++k) {
    if (rig.IndexOf(names[k]) < 0)
      return absl::InvalidArgumentError(absl::StrCat("--cameras: ", path, " has no camera \"", names[k],
                                                     "\"; it has ", absl::StrJoin(there, ", ")));
    if (std::count(names.begin(), names.end(), names[k]) > 1)
      return absl::InvalidArgumentError(absl::StrCat("--cameras: \"", names[k], "\" is given twice"));
  }
  Rig out;
  out.id = rig.id;
  for (const CameraModel& camera : rig.cameras)
    if (std::count(names.begin(), names.end(), camera.id) > 0) out.cameras.push_back(camera);
  return out;
}

absl::StatusOr<std::unique_ptr<DriveInputs>> LoadDriveInputs(const DriveRequest& request) {
  if (absl::Status status = CheckNotEmpty(request); !status.ok()) return status;
  const v1::RegistrationSpec& spec = request.spec;
  const absl::StatusOr<Rig> rig = ReadRig(spec.rig());
  if (!rig.ok()) return rig.status();
  absl::StatusOr<Rig> used = CamerasNamed(*rig, request.cameras, spec.rig());
  if (!used.ok()) return used.status();
  const absl::StatusOr<Board> board = ReadBoard(spec.board());
  if (!board.ok()) return board.status();
  absl::StatusOr<Template> garment = ReadTemplate(spec.garment());
  if (!garment.ok()) return garment.status();
  if (absl::Status status = CheckTemplateFitsBoard(*garment, *board); !status.ok()) return status;
  absl::StatusOr<AvatarFile> avatar = ReadAvatar(request.avatar);
  if (!avatar.ok()) return avatar.status();
  if (absl::Status status = CheckAvatarFits(*avatar, request.avatar, *garment, spec.garment()); !status.ok())
    return status;
  absl::StatusOr<GarmentParts> parts = ReadGarmentParts(spec.garment());
  if (!parts.ok()) return parts.status();
  parts->board_rows = board->rows, parts->board_cols = board->cols;
  absl::StatusOr<BoardIndex> index = BoardIndex::Build(*board);
  if (!index.ok())
    return absl::Status(index.status().code(), absl::StrCat(spec.board(), ": ", index.status().message()));
  absl::StatusOr<std::unique_ptr<FrameSource>> dump = OpenDump(spec.dump(), *used, spec.options().mosaic());
  if (!dump.ok()) return dump.status();
  absl::StatusOr<std::vector<size_t>> frames = FramesInRange(spec, (*dump)->frame_names());
  if (!frames.ok()) return frames.status();
  v1::InputHashes hashes;
  hashes.set_rig(rig->ContentHash());
  hashes.set_board(board->ContentHash());
  hashes.set_garment(garment->ContentHash());
  // The pictures of cameras that are left out on purpose are no strangers.
  std::vector<std::string> warnings;
  if (request.cameras.empty()) warnings = (*dump)->warnings();
  std::vector<int64_t> time_ns = TimesOf(request, **dump, *frames, avatar->avatar.fps);
  MeshTexture texture = TextureOf(*garment, *parts);
  MeshGraph graph = BuildMeshGraph(garment->rest);
  return std::make_unique<DriveInputs>(DriveInputs{*std::move(used), *std::move(index), *std::move(garment),
                                                   std::move(graph), std::move(texture), *std::move(avatar),
                                                   *std::move(dump), std::move(hashes), std::move(warnings),
                                                   *std::move(frames), std::move(time_ns)});
}

}  // namespace weft
