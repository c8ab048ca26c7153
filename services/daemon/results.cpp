#include "services/daemon/results.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "services/files/unique_fd.h"
#include "services/rpc/result_names.h"

namespace weft {
namespace {

constexpr size_t kChunkBytes = size_t{256} << 10;

// Files are replaced, never changed, so another content is another inode or another time.
std::string VersionOf(const struct stat& info) {
  return absl::StrCat(absl::Hex(info.st_ino), "-", absl::Hex(info.st_size), "-",
                      absl::Hex(info.st_mtim.tv_sec), ".", info.st_mtim.tv_nsec);
}

}  // namespace

absl::StatusOr<std::string> FindResult(const v1::Job& job, const std::string& frame, v1::ResultKind kind) {
  namespace fs = std::filesystem;
  const std::string& out = job.spec().out();
  const std::string path = absl::StrCat(out, frame.empty() ? "" : "/", frame, "/", ResultFileName(kind));
  std::error_code error;
  const std::string canonical = fs::canonical(path, error).string();
  if (error) {
    return absl::NotFoundError(absl::StrCat("job ", job.id(), frame.empty() ? "" : ", frame ", frame, ": no ",
                                            ResultFileName(kind), "; is it finished?"));
  }
  const std::string folder = fs::canonical(out, error).string();
  if (error || !absl::StartsWith(canonical, folder + "/")) {
    return absl::PermissionDeniedError(absl::StrCat(path, ": leads out of the job's folder"));
  }
  return canonical;
}

absl::Status StreamFile(const std::string& path, const StreamStart& start,
                        const std::function<bool(const v1::FileChunk&)>& write) {
  const UniqueFd file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  struct stat info;
  if (!file.open() || fstat(file.get(), &info) != 0) {
    return absl::PermissionDeniedError(absl::StrCat(path, ": cannot be opened (", strerror(errno), ")"));
  }
  if (!S_ISREG(info.st_mode)) return absl::PermissionDeniedError(absl::StrCat(path, ": not a file"));
  v1::FileChunk chunk;
  chunk.set_file_bytes(info.st_size);
  chunk.set_version(VersionOf(info));
  if (start.offset > 0 && start.version != chunk.version()) {
    return absl::AbortedError(absl::StrCat(path, ": was written anew; fetch it from its beginning"));
  }
  if (start.offset > info.st_size || lseek(file.get(), start.offset, SEEK_SET) < 0) {
    return absl::OutOfRangeError(
        absl::StrCat("offset: ", start.offset, ", the file has ", info.st_size, " bytes"));
  }
  int64_t sent = start.offset;
  do {
    chunk.set_offset(sent);
    std::string& data = *chunk.mutable_data();
    data.resize(kChunkBytes);
    const ssize_t n = read(file.get(), data.data(), data.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return absl::UnavailableError(absl::StrCat(path, ": cannot be read (", strerror(errno), ")"));
    if (n == 0 && sent < info.st_size) return absl::DataLossError(absl::StrCat(path, ": was cut short"));
    data.resize(static_cast<size_t>(n));
    sent += n;
    if (!write(chunk)) return absl::CancelledError("the client went away");
  } while (sent < info.st_size);
  return absl::OkStatus();
}

}  // namespace weft
