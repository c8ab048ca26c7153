// What all kinds of avatars have in common on the disk: avatar.json, and beside it space.bin, and of a net
// net.onnx and sample.bin (layout: docs/file-formats.md).
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "weft/v1/avatar.pb.h"

namespace weft {

// The files of an avatar's folder.
inline constexpr char kAvatarFile[] = "avatar.json";
inline constexpr char kAvatarSpaceFile[] = "space.bin";
inline constexpr char kAvatarNetFile[] = "net.onnx";
inline constexpr char kAvatarSampleFile[] = "sample.bin";

// What stands beside avatar.json; of an avatar without a net the space alone.
struct AvatarBytes {
  std::string space, net, sample;
};

std::string PathInAvatar(const std::string& folder, const char* file);
// The folder of an avatar that is named by it, or by its avatar.json.
std::string AvatarFolderOf(const std::string& path);
std::string ChecksumOfBytes(std::string_view bytes);

// Fills in what avatar.json tells of these files, but for the training of the net.
void DescribeBytes(const AvatarNet& net, const AvatarBytes& bytes, v1::Avatar* about);
// DataLoss names the first file that is not the one that avatar.json tells of.
absl::Status CheckAvatarBytes(const v1::Avatar& about, const AvatarBytes& bytes, const std::string& folder);
// Atlas, sample and gain; the bytes of the net are those of its file. InvalidArgument names the file.
absl::StatusOr<AvatarNet> NetOfBytes(const v1::AvatarNet& about, AvatarBytes bytes,
                                     const std::string& folder);

// NotFound with the remedy where the folder holds no avatar.
absl::StatusOr<std::string> ReadAvatarJson(const std::string& folder);
// The files beside. Errors of ReadWholeFile; DataLoss where files of a net are there that nothing tells of.
absl::StatusOr<AvatarBytes> ReadAvatarBytes(const v1::Avatar& about, const std::string& folder);

// AlreadyExists where something stands at `folder` that is no avatar.
absl::Status CheckAvatarPlace(const std::string& folder);

// Writes the folder under a temporary name, flushes it to the disk and puts it in place; an avatar that
// stands there is replaced. Errors of CheckAvatarPlace and WriteFileAtomically.
absl::Status WriteAvatarFolder(const std::string& folder, const v1::Avatar& about, const AvatarBytes& bytes);

}  // namespace weft
