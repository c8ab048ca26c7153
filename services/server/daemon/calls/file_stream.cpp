#include "services/server/daemon/calls/file_stream.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/server/daemon/calls/server_stream.h"

namespace weft {
namespace {

constexpr size_t kChunkBytes = size_t{256} << 10;

// Files are replaced, never changed, so another content is another inode or another time.
std::string VersionOf(const struct stat& info) {
  return absl::StrCat(absl::Hex(info.st_ino), "-", absl::Hex(info.st_size), "-",
                      absl::Hex(info.st_mtim.tv_sec), ".", info.st_mtim.tv_nsec);
}

}  // namespace

absl::StatusOr<FilePieces> FilePieces::Open(const ConfinedFolder& folder, const std::string& path,
                                            const StreamStart& start) {
  WEFT_ASSIGN_OR_RETURN(UniqueFd file, folder.OpenFile(path));
  FilePieces pieces(folder.Named(path), std::move(file));
  struct stat info;
  if (fstat(pieces.file_.get(), &info) != 0)
    return absl::UnavailableError(absl::StrCat(pieces.path_, ": cannot be read (", strerror(errno), ")"));
  pieces.version_ = VersionOf(info);
  pieces.bytes_ = info.st_size;
  pieces.sent_ = start.offset;
  if (start.offset > 0 && start.version != pieces.version_) {
    return absl::AbortedError(absl::StrCat(pieces.path_, ": was written anew; fetch it from its beginning"));
  }
  if (start.offset > info.st_size || lseek(pieces.file_.get(), start.offset, SEEK_SET) < 0) {
    return absl::OutOfRangeError(
        absl::StrCat("offset: ", start.offset, ", the file has ", info.st_size, " bytes"));
  }
  return pieces;
}

absl::StatusOr<bool> FilePieces::Next(v1::FileChunk* chunk) {
  if (std::exchange(began_, true) && sent_ >= bytes_) return false;
  chunk->set_file_bytes(bytes_);
  chunk->set_version(version_);
  chunk->set_offset(sent_);
  std::string& data = *chunk->mutable_data();
  data.resize(kChunkBytes);
  ssize_t n = 0;
  do {
    n = read(file_.get(), data.data(), data.size());
  } while (n < 0 && errno == EINTR);
  if (n < 0) return absl::UnavailableError(absl::StrCat(path_, ": cannot be read (", strerror(errno), ")"));
  if (n == 0 && sent_ < bytes_) return absl::DataLossError(absl::StrCat(path_, ": was cut short"));
  data.resize(static_cast<size_t>(n));
  sent_ += n;
  return true;
}

grpc::ServerWriteReactor<v1::FileChunk>* SendFile(grpc::CallbackServerContext* context, const char* method,
                                                  const std::function<absl::StatusOr<FilePieces>()>& open,
                                                  std::chrono::milliseconds patience) {
  auto* stream = new ServerStream<v1::FileChunk>(context, method, patience);
  // Begin makes the first call, so `open` is still there.
  stream->Begin([&open, pieces = std::make_shared<std::optional<FilePieces>>()](
                    v1::FileChunk& chunk) -> absl::StatusOr<StreamNews> {
    if (!*pieces) {
      WEFT_ASSIGN_OR_RETURN(*pieces, open());
    }
    WEFT_ASSIGN_OR_RETURN(const bool has_piece, (*pieces)->Next(&chunk));
    return has_piece ? StreamNews::kMessage : StreamNews::kOver;
  });
  return stream;
}

}  // namespace weft
