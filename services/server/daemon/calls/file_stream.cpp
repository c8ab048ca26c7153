#include "services/server/daemon/calls/file_stream.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/server/daemon/calls/answer.h"

namespace weft {
namespace {

constexpr size_t kChunkBytes = size_t{256} << 10;

// Files are replaced, never changed, so another content is another inode or another time.
std::string VersionOf(const struct stat& info) {
  return absl::StrCat(absl::Hex(info.st_ino), "-", absl::Hex(info.st_size), "-",
                      absl::Hex(info.st_mtim.tv_sec), ".", info.st_mtim.tv_nsec);
}

class FileReactor final : public grpc::ServerWriteReactor<v1::FileChunk> {
 public:
  FileReactor(grpc::CallbackServerContext* context, const char* method, std::chrono::milliseconds patience)
      : method_(method), stalls_(context, patience) {}

  void Begin(const std::function<absl::StatusOr<FilePieces>()>& open) {
    const grpc::Status status = Answer(method_, [&] {
      absl::StatusOr<FilePieces> pieces = open();
      if (pieces.ok()) pieces_ = *std::move(pieces);
      return pieces.status();
    });
    if (status.ok()) return WriteNext();
    Finish(status);
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return Finish(stalls_.StatusOfFailure());
    stalls_.Moved();
    WriteNext();
  }

  void OnDone() override { delete this; }

 private:
  void WriteNext() {
    bool has_piece = false;
    const grpc::Status status = Answer(method_, [&] {
      const absl::StatusOr<bool> next = pieces_->Next(&chunk_);
      has_piece = next.ok() && *next;
      return next.status();
    });
    if (has_piece) return StartWrite(&chunk_);
    Finish(status);
  }

  const char* const method_;
  StallWatch stalls_;
  std::optional<FilePieces> pieces_;
  v1::FileChunk chunk_;
};

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
  auto* reactor = new FileReactor(context, method, patience);
  reactor->Begin(open);
  return reactor;
}

}  // namespace weft
