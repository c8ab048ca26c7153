#include "services/results/export/export_stream.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

constexpr size_t kBufferBytes = size_t{1} << 20;

}  // namespace

absl::StatusOr<ExportStream> ExportStream::Open(const std::string& path, uint64_t keep_bytes) {
  UniqueFd file(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666));
  struct stat info {};
  if (!file.open() || fstat(file.get(), &info) != 0) return WriteError(path, errno);
  if (static_cast<uint64_t>(info.st_size) < keep_bytes) {
    return absl::DataLossError(absl::StrCat(path, ": has ", info.st_size, " bytes, ", keep_bytes,
                                            " were written; remove the folder of the export, and export "
                                            "again"));
  }
  const auto keep = static_cast<off_t>(keep_bytes);
  if (S_ISREG(info.st_mode) && ftruncate(file.get(), keep) != 0) return WriteError(path, errno);
  if (lseek(file.get(), keep, SEEK_SET) < 0) return WriteError(path, errno);
  return ExportStream(std::move(file), path, keep_bytes);
}

void ExportStream::Append(std::string_view bytes) {
  size_ += bytes.size();
  if (buffer_.size() + bytes.size() > kBufferBytes) Flush();
  if (bytes.size() < kBufferBytes) {
    buffer_.append(bytes);
  } else if (const int error = status_.ok() ? WriteAll(file_.get(), bytes) : 0) {
    status_ = WriteError(path_, error);
  }
}

void ExportStream::Overwrite(uint64_t offset, std::string_view bytes) {
  Flush();
  while (status_.ok() && !bytes.empty()) {
    const ssize_t n = pwrite(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      status_ = WriteError(path_, errno);
      return;
    }
    bytes.remove_prefix(static_cast<size_t>(n));
    offset += static_cast<uint64_t>(n);
  }
}

absl::Status ExportStream::Sync() {
  Flush();
  if (status_.ok() && fsync(file_.get()) != 0) status_ = WriteError(path_, errno);
  return status_;
}

void ExportStream::Flush() {
  if (const int error = status_.ok() ? WriteAll(file_.get(), buffer_) : 0) status_ = WriteError(path_, error);
  buffer_.clear();
}

}  // namespace weft
