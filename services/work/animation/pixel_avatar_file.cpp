#include "services/work/animation/pixel_avatar_file.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "animation/paper/pixel_driver.h"
#include "animation/sparse_view/net_correction.h"
#include "base/status_macros.h"
#include "services/formats/files/json_file.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/net_sample.h"

namespace weft {

absl::StatusOr<PixelAvatarFile> AssemblePixelAvatar(v1::Avatar about, AvatarBytes bytes,
                                                    const std::string& folder) {
  const std::string space_path = PathInAvatar(folder, kAvatarSpaceFile);
  if (!about.has_net())
    return absl::InvalidArgumentError(absl::StrCat(PathInAvatar(folder, kAvatarFile), ": net is missing"));
  WEFT_RETURN_IF_ERROR(CheckAvatarBytes(about, bytes, folder));
  WEFT_ASSIGN_OR_RETURN(const std::vector<AvatarTable> tables, DecodeAvatarSpace(bytes.space, space_path));
  PixelAvatarFile out;
  out.avatar.template_hash = about.template_hash();
  out.avatar.board_hash = about.board_hash();
  out.avatar.vertices = about.vertices();
  out.avatar.fps = about.fps();
  out.avatar.training_frames = about.training_frames();
  out.avatar.held_out_frames = about.held_out_frames();
  out.avatar.left_mm = about.left_mm();
  out.avatar.seed = about.training().seed();
  WEFT_ASSIGN_OR_RETURN(out.avatar.net, NetOfBytes(about.net(), std::move(bytes), folder));
  absl::Status status = TakeTables(tables, &out.avatar);
  if (status.ok()) status = out.avatar.Validate();
  if (!status.ok())
    return absl::InvalidArgumentError(absl::StrCat(space_path, ": ", std::string(status.message())));
  out.about = std::move(about);
  return out;
}

absl::StatusOr<PixelAvatarFile> ReadPixelAvatar(const std::string& path) {
  const std::string folder = AvatarFolderOf(path);
  WEFT_ASSIGN_OR_RETURN(const std::string json, ReadAvatarJson(folder));
  WEFT_ASSIGN_OR_RETURN(v1::Avatar about, ParseAvatar(json, PathInAvatar(folder, kAvatarFile), kPixelKind));
  WEFT_ASSIGN_OR_RETURN(AvatarBytes bytes, ReadAvatarBytes(about, folder));
  WEFT_ASSIGN_OR_RETURN(PixelAvatarFile out, AssemblePixelAvatar(std::move(about), std::move(bytes), folder));
  if (absl::Status status = CheckNet(out.avatar.net, {kPixelFeatures, kPixelAnswers}); !status.ok())
    return absl::InvalidArgumentError(
        absl::StrCat(PathInAvatar(folder, kAvatarNetFile), ": ", std::string(status.message())));
  return out;
}

absl::StatusOr<v1::Avatar> ReadAnyAvatar(const std::string& path) {
  const std::string folder = AvatarFolderOf(path);
  WEFT_ASSIGN_OR_RETURN(const std::string json, ReadAvatarJson(folder));
  // The kind alone: who reads the avatar checks the rest, and says what is wrong with it.
  v1::Avatar told;
  if (ParseJson(json, PathInAvatar(folder, kAvatarFile), told).ok() && told.kind() == kPixelKind) {
    WEFT_ASSIGN_OR_RETURN(PixelAvatarFile read, ReadPixelAvatar(path));
    return std::move(read.about);
  }
  WEFT_ASSIGN_OR_RETURN(AvatarFile read, ReadAvatar(path));
  return std::move(read.about);
}

absl::Status WritePixelAvatar(const std::string& folder, v1::Avatar about, const PixelAvatar& avatar) {
  WEFT_RETURN_IF_ERROR(avatar.Validate());
  about.set_kind(kPixelKind);
  about.set_made_by("weft " WEFT_VERSION);
  about.set_template_hash(avatar.template_hash);
  about.set_board_hash(avatar.board_hash);
  about.set_vertices(avatar.vertices);
  about.set_components(avatar.prior.latents());
  about.set_fps(avatar.fps);
  about.set_training_frames(avatar.training_frames);
  about.set_held_out_frames(avatar.held_out_frames);
  about.set_left_mm(avatar.left_mm);
  about.mutable_training()->set_seed(avatar.seed);
  const AvatarBytes bytes{EncodeAvatarSpace(TablesOf(avatar)), avatar.net.onnx, EncodeNetSample(avatar.net)};
  DescribeBytes(avatar.net, bytes, &about);
  return WriteAvatarFolder(folder, about, bytes);
}

}  // namespace weft
