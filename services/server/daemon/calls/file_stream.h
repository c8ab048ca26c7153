// Files on their way to clients.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <chrono>
#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "services/formats/files/confined_folder.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/daemon/calls/stall_watch.h"
#include "weft/v1/transfer.pb.h"

namespace weft {

// Where a transfer goes on: at `offset`, if the file still has `version` (FileChunk.version).
struct StreamStart {
  int64_t offset = 0;
  std::string version;  // not looked at where offset is 0
};

// A file in pieces, all of the same version of it. Thread safety: none.
class FilePieces {
 public:
  // `path` is below the folder. Errors of ConfinedFolder::OpenFile. Aborted: another version stands there
  // now. OutOfRange: it ends before the offset.
  static absl::StatusOr<FilePieces> Open(const ConfinedFolder& folder, const std::string& path,
                                         const StreamStart& start);

  // Fills in the next piece; false after the last one. A file without bytes is one empty piece. DataLoss: the
  // file was cut short. Unavailable: it cannot be read.
  absl::StatusOr<bool> Next(v1::FileChunk* chunk);

 private:
  FilePieces(std::string path, UniqueFd file) : path_(std::move(path)), file_(std::move(file)) {}

  std::string path_;
  UniqueFd file_;
  std::string version_;
  int64_t bytes_ = 0, sent_ = 0;
  bool began_ = false;
};

// Streams what `open` opens without a thread per client: one that takes nothing costs a piece of memory, and
// is let go after `patience`. `method` is for the log. Deletes itself when the stream has ended.
grpc::ServerWriteReactor<v1::FileChunk>* SendFile(
    grpc::CallbackServerContext* context, const char* method,
    const std::function<absl::StatusOr<FilePieces>()>& open,
    std::chrono::milliseconds patience = StallWatch::kReadTimeout);

}  // namespace weft
