#include "services/studio/recording/disk_speed.h"

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "capture/file/posix_file.h"
#include "capture/image/aligned_buffer.h"

namespace weft {
namespace {

constexpr uint64_t kPieceBytes = uint64_t{8} << 20;

absl::Status WriteAll(PosixFile& file, uint64_t bytes, DiskSpeed& speed) {
  WEFT_RETURN_IF_ERROR(file.Preallocate(0, bytes));
  AlignedBuffer piece(kPieceBytes);
  std::memset(piece.data(), 0xa5, kPieceBytes);
  const Stopwatch watch;
  for (uint64_t at = 0; at < bytes; at += kPieceBytes) {
    const Stopwatch write_watch;
    WEFT_RETURN_IF_ERROR(file.WriteAt(piece.data(), kPieceBytes, at));
    speed.slowest_write_ms = std::max(speed.slowest_write_ms, write_watch.Ms());
  }
  WEFT_RETURN_IF_ERROR(file.SyncData());
  speed.bytes_per_s = static_cast<double>(bytes) / watch.Seconds();
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<DiskSpeed> MeasureDiskSpeed(const std::string& folder, uint64_t bytes) {
  DiskSpeed speed;
  struct statvfs info {};
  if (statvfs(folder.c_str(), &info) != 0) return FileError(folder, "the disk has no size", errno);
  speed.free_bytes = static_cast<uint64_t>(info.f_bavail) * info.f_frsize;
  bytes = std::min(bytes, speed.free_bytes / 4);
  bytes = std::max((bytes + kPieceBytes - 1) / kPieceBytes, uint64_t{1}) * kPieceBytes;
  if (speed.free_bytes < 2 * bytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat(folder, ": only ", speed.free_bytes >> 20, " MiB are free; make room on the disk"));
  }
  const std::string path = (std::filesystem::path(folder) / absl::StrCat(".disk_speed.", getpid())).string();
  constexpr int kNew = O_RDWR | O_CREAT | O_TRUNC;
  absl::StatusOr<PosixFile> file = PosixFile::Open(path, kNew | O_DIRECT);
  speed.bypasses_page_cache = file.ok();
  if (!file.ok()) file = PosixFile::Open(path, kNew);
  if (!file.ok()) return file.status();
  const absl::Status status = WriteAll(*file, bytes, speed);
  unlink(path.c_str());
  if (!status.ok()) return status;
  return speed;
}

}  // namespace weft
