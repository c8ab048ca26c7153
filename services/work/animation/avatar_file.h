// Avatars on disk: the folder X.avatar with avatar.json and space.bin, and of a net net.onnx and sample.bin
// (layout: docs/file-formats.md).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "services/work/animation/avatar_folder.h"
#include "weft/v1/avatar.pb.h"

namespace weft {

// The kind of avatar that is driven.
inline constexpr char kSparseViewKind[] = "sparse-view";

// An avatar and what is told of it.
struct AvatarFile {
  v1::Avatar about;
  SparseViewAvatar avatar;
};

// The bytes of space.bin; bases to 16 bits, so what is read back differs from what was learnt.
std::string EncodeAvatarSpace(const std::vector<AvatarTable>& tables);
// Errors name source_name: InvalidArgument for what holds no tables, DataLoss when the checksum does not
// match.
absl::StatusOr<std::vector<AvatarTable>> DecodeAvatarSpace(std::string_view bytes,
                                                           const std::string& source_name);

// InvalidArgument names source_name and the field: unknown, of another kind of avatar, or out of its limits.
absl::StatusOr<v1::Avatar> ParseAvatar(std::string_view json, const std::string& source_name,
                                       std::string_view kind = kSparseViewKind);

// The avatar of its files; `folder` names them in errors. InvalidArgument or DataLoss names the file, what
// is wrong with it, and the remedy. The net is not run.
absl::StatusOr<AvatarFile> AssembleAvatar(v1::Avatar about, AvatarBytes bytes, const std::string& folder);

// Whether a net is read into the library that runs it, and compared with its sample. Nets of strangers are
// read where jobs run, which are confined.
enum class NetReading { kRun, kBytesAlone };

// Reads a folder, or its avatar.json. NotFound with the remedy where the folder holds no avatar; errors of
// AssembleAvatar, and of CheckNet with the file's name.
absl::StatusOr<AvatarFile> ReadAvatar(const std::string& path, NetReading reading = NetReading::kRun);

// That of all its files but avatar.json.
std::string ChecksumOfAvatar(const v1::Avatar& about);

// Writes the folder under a temporary name, flushes it to the disk and puts it in place; an avatar that
// stands there is replaced. Fills in what `about` tells of `avatar` and of the files beside, but for the
// training of its net. The same bytes for the same avatar. Errors of CheckAvatarPlace and
// WriteFileAtomically.
absl::Status WriteAvatar(const std::string& folder, v1::Avatar about, const SparseViewAvatar& avatar);

// FailedPrecondition, with both names and hashes, for a template or a board that the avatar at `path` was not
// made for.
absl::Status CheckAvatarFits(const v1::Avatar& avatar, const std::string& path, const Template& garment,
                             const std::string& garment_path);

}  // namespace weft
