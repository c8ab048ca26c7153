// Avatars of pixels (animation/paper/pixel_avatar.h) on disk: a folder as all avatars have, with tables of
// their own in space.bin.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/paper/pixel_avatar.h"
#include "services/work/animation/avatar_folder.h"
#include "weft/v1/avatar.pb.h"

namespace weft {

inline constexpr char kPixelKind[] = "paper";

struct PixelAvatarFile {
  v1::Avatar about;
  PixelAvatar avatar;
};

// The avatar of its files; errors as of AssembleAvatar. The net is not run.
absl::StatusOr<PixelAvatarFile> AssemblePixelAvatar(v1::Avatar about, AvatarBytes bytes,
                                                    const std::string& folder);

// Reads a folder, or its avatar.json. InvalidArgument where it is an avatar of another kind; errors as of
// ReadAvatar.
absl::StatusOr<PixelAvatarFile> ReadPixelAvatar(const std::string& path);

// What any kind of avatar tells of itself, its files read and checked.
absl::StatusOr<v1::Avatar> ReadAnyAvatar(const std::string& path);

// As WriteAvatar.
absl::Status WritePixelAvatar(const std::string& folder, v1::Avatar about, const PixelAvatar& avatar);

}  // namespace weft
