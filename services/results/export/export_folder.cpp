#include "services/results/export/export_folder.h"

#include <fcntl.h>
#include <google/protobuf/util/message_differencer.h>
#include <sys/statvfs.h>

#include <cerrno>
#include <filesystem>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/unique_fd.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr char kUnfinishedFolder[] = ".unfinished";
constexpr char kProgressFile[] = "progress.json";
constexpr uint64_t kSpareBytes = uint64_t{16} << 20;

std::string Size(uint64_t bytes) {
  constexpr double kGb = 1e9, kMb = 1e6;
  const auto size = static_cast<double>(bytes);
  return size >= kGb ? absl::StrFormat("%.2f GB", size / kGb) : absl::StrFormat("%.1f MB", size / kMb);
}

bool Exists(const std::string& path) {
  std::error_code error;
  return fs::exists(fs::symlink_status(path, error));
}

// All files but the manifest.
std::set<std::string> NamesIn(const v1::Export& wanted) {
  std::set<std::string> names(wanted.files().begin(), wanted.files().end());
  for (const v1::ExportedFrame& frame : wanted.frames())
    for (const std::string& file : {frame.file(), frame.normal_map()})
      if (!file.empty()) names.insert(file);
  return names;
}

}  // namespace

absl::Status StoppedAfter(size_t done, size_t all) {
  return absl::CancelledError(
      absl::StrCat("stopped after ", done, " of ", all, " frames; the same command goes on from there"));
}

std::string ExportFolder::Of(const std::string& name) const { return (fs::path(path_) / name).string(); }

std::string ExportFolder::UnfinishedOf(const std::string& name) const {
  return (fs::path(path_) / kUnfinishedFolder / name).string();
}

absl::StatusOr<ExportFolder::Holds> ExportFolder::Compare(const v1::Export& wanted) const {
  for (const std::string& manifest : {Of(kExportFile), UnfinishedOf(kExportFile)}) {
    if (!Exists(manifest)) continue;
    v1::Export found;
    const absl::Status read = ReadJsonFile(manifest, found);
    if (read.ok() && google::protobuf::util::MessageDifferencer::Equals(found, wanted))
      return manifest == Of(kExportFile) ? Holds::kAll : Holds::kPart;
    return absl::FailedPreconditionError(
        absl::StrCat(manifest, ": another export stands here",
                     read.ok() ? " (other frames, options or results)" : ", and cannot be read",
                     "; choose another --out, or remove the folder"));
  }
  for (const std::string& name : NamesIn(wanted)) {
    if (!Exists(Of(name))) continue;
    return absl::FailedPreconditionError(
        absl::StrCat(Of(name), ": stands here already, and is of no export; choose another --out"));
  }
  return Holds::kNothing;
}

absl::Status ExportFolder::CheckRoom(uint64_t needed_bytes, uint64_t present_bytes) const {
  // The nearest folder that exists.
  fs::path folder = fs::absolute(path_);
  while (folder.has_relative_path() && !Exists(folder.string())) folder = folder.parent_path();
  // By a descriptor: confined processes ask about no other disks.
  const UniqueFd opened(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  struct statvfs disk {};
  if (!opened.open() || fstatvfs(opened.get(), &disk) != 0) return WriteError(folder.string(), errno);
  const uint64_t free_bytes = uint64_t{disk.f_bavail} * disk.f_frsize;
  const uint64_t needed = needed_bytes > present_bytes ? needed_bytes - present_bytes : 0;
  if (needed + kSpareBytes <= free_bytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(path_, ": the export needs up to ", Size(needed + kSpareBytes), ", ", Size(free_bytes),
                   " are free; make room, choose another disk with --out, or fewer frames with --frames"));
}

absl::Status ExportFolder::Begin(const v1::Export& wanted) const {
  WEFT_RETURN_IF_ERROR(CreateFolders((fs::path(path_) / kUnfinishedFolder).string()));
  return WriteJsonFile(UnfinishedOf(kExportFile), wanted);
}

absl::StatusOr<ExportFolder::Holds> ExportFolder::BeginOrGoOn(const v1::Export& wanted,
                                                              uint64_t needed_bytes) const {
  const absl::StatusOr<Holds> holds = Compare(wanted);
  if (!holds.ok() || *holds == Holds::kAll) return holds;
  RemoveLeftovers(wanted);
  absl::Status status = CheckRoom(needed_bytes, 0);
  if (status.ok() && *holds == Holds::kNothing) status = Begin(wanted);
  if (!status.ok()) return status;
  return holds;
}

void ExportFolder::RemoveLeftovers(const v1::Export& wanted) const {
  std::set<std::string> names = NamesIn(wanted);
  names.insert(kExportFile);
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(path_, error)) {
    const std::string name = entry.path().filename().string();
    const std::string file = name.substr(0, name.find(".tmp."));
    if (names.contains(file) && IsTemporaryNameOf(name, file)) fs::remove(entry.path(), error);
  }
}

std::optional<v1::ExportCheckpoint> ExportFolder::Checkpoint() const {
  v1::ExportCheckpoint checkpoint;
  if (!ReadJsonFile(UnfinishedOf(kProgressFile), checkpoint).ok()) return std::nullopt;
  return checkpoint;
}

absl::Status ExportFolder::WriteCheckpoint(const v1::ExportCheckpoint& checkpoint) const {
  return WriteJsonFile(UnfinishedOf(kProgressFile), checkpoint);
}

absl::Status ExportFolder::Publish(const std::string& name) const {
  std::error_code error;
  fs::rename(UnfinishedOf(name), Of(name), error);
  return error ? WriteError(Of(name), error.value()) : absl::OkStatus();
}

absl::Status ExportFolder::Finish(const v1::Export& manifest) const {
  WEFT_RETURN_IF_ERROR(WriteJsonFile(Of(kExportFile), manifest));
  std::error_code error;
  fs::remove_all(fs::path(path_) / kUnfinishedFolder, error);
  return error ? WriteError(path_, error.value()) : absl::OkStatus();
}

}  // namespace weft
