#include "services/work/animation/avatar_folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "nets/net_model.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/unfinished_folder.h"
#include "services/ground/process/unique_fd.h"
#include "services/work/animation/net_sample.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMaxSpaceBytes = uint64_t{1} << 30, kMaxNetBytes = uint64_t{1} << 28;

// A file of an avatar must be the one that avatar.json tells of.
absl::Status CheckFile(const std::string& folder, const char* file, std::string_view bytes,
                       int64_t told_bytes, const std::string& told_checksum) {
  if (static_cast<int64_t>(bytes.size()) == told_bytes && ChecksumOfBytes(bytes) == told_checksum)
    return absl::OkStatus();
  return absl::DataLossError(absl::StrCat(
      PathInAvatar(folder, file), ": has ", bytes.size(), " bytes and checksum ", ChecksumOfBytes(bytes),
      ", ", PathInAvatar(folder, kAvatarFile), " says ", told_bytes, " and ", told_checksum,
      "; the files are damaged or of two avatars, copy or train the avatar again"));
}

absl::Status ReadInto(const std::string& folder, const char* file, uint64_t most, std::string* out) {
  absl::StatusOr<std::string> bytes = ReadWholeFile(PathInAvatar(folder, file), most);
  if (bytes.ok()) *out = *std::move(bytes);
  return bytes.status();
}

absl::Status RemoveFolder(const fs::path& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(folder.string(), ": cannot be removed (", error.message(), ")"));
}

absl::Status FlushFolder(const fs::path& folder) {
  const UniqueFd fd(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() < 0) return WriteError(folder.string(), errno);
  return SyncFolder(fd.get(), folder.string());
}

// Puts `from` where `to` stands or nothing does; the folder that stood there is then at `from`.
absl::Status PutInPlace(const fs::path& from, const fs::path& to) {
  const unsigned flags = PathExists(to) ? RENAME_EXCHANGE : RENAME_NOREPLACE;
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flags) == 0) return absl::OkStatus();
  if (errno != EINVAL && errno != ENOSYS) return WriteError(to.string(), errno);
  // File systems without that exchange: for a moment nothing stands there.
  WEFT_RETURN_IF_ERROR(RemoveFolder(to));
  return rename(from.c_str(), to.c_str()) == 0 ? absl::OkStatus() : WriteError(to.string(), errno);
}

}  // namespace

std::string PathInAvatar(const std::string& folder, const char* file) {
  return (fs::path(folder) / file).string();
}

std::string AvatarFolderOf(const std::string& path) {
  const fs::path given(path);
  return given.filename() == kAvatarFile ? given.parent_path().string() : path;
}

std::string ChecksumOfBytes(std::string_view bytes) {
  return absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size()));
}

void DescribeBytes(const AvatarNet& net, const AvatarBytes& bytes, v1::Avatar* to) {
  to->set_space_bytes(static_cast<int64_t>(bytes.space.size()));
  to->set_space_checksum(ChecksumOfBytes(bytes.space));
  if (net.empty()) {
    to->clear_net();
    return;
  }
  v1::AvatarNet& about = *to->mutable_net();
  about.set_atlas_level(net.atlas.level);
  about.set_atlas_gutter(net.atlas.gutter);
  about.set_onnx_bytes(static_cast<int64_t>(bytes.net.size()));
  about.set_onnx_checksum(ChecksumOfBytes(bytes.net));
  about.set_sample_bytes(static_cast<int64_t>(bytes.sample.size()));
  about.set_sample_checksum(ChecksumOfBytes(bytes.sample));
  about.clear_gain();
  for (size_t k = 0; k < net.gain.size(); ++k) {
    if (net.gain[k].frames == 0) continue;
    v1::AvatarNetGain& gain = *about.add_gain();
    gain.set_cameras(static_cast<int>(k) + 1);
    gain.set_frames(net.gain[k].frames);
    gain.set_before_mm(net.gain[k].before_mm);
    gain.set_after_mm(net.gain[k].after_mm);
  }
}

absl::Status CheckAvatarBytes(const v1::Avatar& about, const AvatarBytes& bytes, const std::string& folder) {
  const v1::AvatarNet& net = about.net();
  absl::Status status =
      CheckFile(folder, kAvatarSpaceFile, bytes.space, about.space_bytes(), about.space_checksum());
  if (about.has_net()) {
    status.Update(CheckFile(folder, kAvatarNetFile, bytes.net, net.onnx_bytes(), net.onnx_checksum()));
    status.Update(
        CheckFile(folder, kAvatarSampleFile, bytes.sample, net.sample_bytes(), net.sample_checksum()));
  }
  return status;
}

absl::StatusOr<AvatarNet> NetOfBytes(const v1::AvatarNet& about, AvatarBytes bytes,
                                     const std::string& folder) {
  AvatarNet out;
  out.atlas.level = about.atlas_level(), out.atlas.gutter = about.atlas_gutter();
  if (absl::Status status = out.atlas.Validate(); !status.ok())
    return absl::InvalidArgumentError(
        absl::StrCat(PathInAvatar(folder, kAvatarFile), ": net: ", std::string(status.message())));
  for (const v1::AvatarNetGain& gain : about.gain()) {
    if (gain.cameras() < 1 || gain.cameras() > SigmaScale::kCameras)
      return absl::InvalidArgumentError(absl::StrCat(PathInAvatar(folder, kAvatarFile),
                                                     ": net.gain: cameras is ", gain.cameras(),
                                                     ", expected 1 to ", SigmaScale::kCameras));
    out.gain[static_cast<size_t>(gain.cameras() - 1)] = {gain.frames(), gain.before_mm(), gain.after_mm()};
  }
  WEFT_RETURN_IF_ERROR(DecodeNetSample(bytes.sample, PathInAvatar(folder, kAvatarSampleFile), &out));
  // Also where nobody runs it, as of uploads.
  if (absl::Status status = ReadNetModel(bytes.net).status(); !status.ok())
    return absl::InvalidArgumentError(absl::StrCat(PathInAvatar(folder, kAvatarNetFile),
                                                   ": is no net that can be read: ", status.message()));
  out.onnx = std::move(bytes.net);
  return out;
}

absl::StatusOr<std::string> ReadAvatarJson(const std::string& folder) {
  const std::string path = PathInAvatar(folder, kAvatarFile);
  absl::StatusOr<std::string> json = ReadWholeFile(path, kMaxJsonBytes);
  if (absl::IsNotFound(json.status()))
    return absl::NotFoundError(
        absl::StrCat(path, ": is missing, so this is no avatar; `weft avatar train` makes one"));
  return json;
}

absl::StatusOr<AvatarBytes> ReadAvatarBytes(const v1::Avatar& about, const std::string& folder) {
  AvatarBytes bytes;
  absl::Status status = ReadInto(folder, kAvatarSpaceFile, kMaxSpaceBytes, &bytes.space);
  if (about.has_net()) {
    status.Update(ReadInto(folder, kAvatarNetFile, kMaxNetBytes, &bytes.net));
    status.Update(ReadInto(folder, kAvatarSampleFile, kMaxNetBytes, &bytes.sample));
  } else {
    for (const char* file : {kAvatarNetFile, kAvatarSampleFile})
      if (std::error_code error; fs::exists(PathInAvatar(folder, file), error))
        status.Update(absl::DataLossError(
            absl::StrCat(PathInAvatar(folder, file), ": is there, and ", PathInAvatar(folder, kAvatarFile),
                         " tells of no net; the files are of two avatars, copy the avatar again")));
  }
  if (!status.ok()) return status;
  return bytes;
}

absl::Status CheckAvatarPlace(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(folder, error))) return absl::OkStatus();
  if (fs::is_directory(folder, error) &&
      (fs::exists(PathInAvatar(folder, kAvatarFile), error) || fs::is_empty(folder, error)))
    return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat(folder, ": is there and is no avatar; choose another name, or remove it"));
}

absl::Status WriteAvatarFolder(const std::string& folder, const v1::Avatar& about, const AvatarBytes& bytes) {
  fs::path place = fs::path(folder).lexically_normal();
  if (!place.has_filename()) place = place.parent_path();
  WEFT_RETURN_IF_ERROR(CheckAvatarPlace(place.string()));
  const fs::path parent = place.has_parent_path() ? place.parent_path() : fs::path(".");
  WEFT_ASSIGN_OR_RETURN(const UnfinishedFolder draft, UnfinishedFolder::BeginBeside(place.string()));
  const std::string& in_draft = draft.path();
  absl::Status status = WriteFileAtomically(PathInAvatar(in_draft, kAvatarSpaceFile), bytes.space);
  if (status.ok() && about.has_net()) {
    status = WriteFileAtomically(PathInAvatar(in_draft, kAvatarNetFile), bytes.net);
    status.Update(WriteFileAtomically(PathInAvatar(in_draft, kAvatarSampleFile), bytes.sample));
  }
  if (status.ok()) status = WriteJsonFile(PathInAvatar(in_draft, kAvatarFile), about);
  if (status.ok()) status = PutInPlace(in_draft, place);
  if (status.ok()) status = FlushFolder(parent);
  status.Update(RemoveFolder(in_draft));  // by now what stood there before
  return status;
}

}  // namespace weft
