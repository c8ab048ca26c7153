#include "services/tools/client/file_transfer.h"

#include <grpcpp/grpcpp.h>

#include "absl/strings/str_cat.h"
#include "services/formats/files/atomic_file.h"
#include "services/tools/client/daemon_call.h"

namespace weft {
namespace {

constexpr uint64_t kMaxFileBytes = uint64_t{4} << 30;

// What has arrived of a file.
struct Transfer {
  std::string bytes;
  std::string version;
  int64_t expected = 0;
};

// One call. A daemon that knows nothing of offsets begins anew.
grpc::Status Receive(const OpenTransfer& open, Transfer* transfer) {
  grpc::ClientContext context;
  auto offset = static_cast<int64_t>(transfer->bytes.size());
  const auto stream = open(&context, offset, transfer->version);
  v1::FileChunk chunk;
  while (stream->Read(&chunk)) {
    transfer->expected = chunk.file_bytes();
    transfer->version = chunk.version();
    if (chunk.version().empty() && offset > 0) {
      transfer->bytes.clear();
      offset = 0;
    }
    transfer->bytes += chunk.data();
    if (transfer->bytes.size() > kMaxFileBytes) context.TryCancel();
  }
  return stream->Finish();
}

}  // namespace

absl::Status ReceiveFile(const RegistrationClient& connection, const OpenTransfer& open,
                         const std::string& path) {
  Transfer transfer;
  grpc::Status status;
  for (Pauses pauses;;) {
    const size_t before = transfer.bytes.size();
    status = CallWhenAdmitted([&] { return Receive(open, &transfer); });
    if (status.error_code() == grpc::StatusCode::ABORTED) {
      transfer = {};
    } else if (status.error_code() != grpc::StatusCode::UNAVAILABLE) {
      break;
    }
    if (transfer.bytes.size() > before) pauses = {};
    if (!pauses.Next()) break;
  }
  if (transfer.bytes.size() > kMaxFileBytes)
    return absl::OutOfRangeError(
        absl::StrCat(path, ": the daemon sends more than ", kMaxFileBytes, " bytes"));
  if (!status.ok()) return connection.Explain(status);
  if (static_cast<int64_t>(transfer.bytes.size()) != transfer.expected) {
    return absl::DataLossError(absl::StrCat(path, ": ", transfer.bytes.size(), " of ", transfer.expected,
                                            " bytes arrived; fetch it again"));
  }
  return WriteFileAtomically(path, transfer.bytes);
}

}  // namespace weft
