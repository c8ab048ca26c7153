// Files on their way from a daemon.
#pragma once

#include <grpcpp/client_context.h>
#include <grpcpp/support/sync_stream.h>

#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "services/tools/client/registration_client.h"
#include "weft/v1/transfer.pb.h"

namespace weft {

// A call that sends the file from this offset on; `version` is that of the pieces that came before.
using OpenTransfer = std::function<std::unique_ptr<grpc::ClientReader<v1::FileChunk>>(
    grpc::ClientContext* context, int64_t offset, const std::string& version)>;

// Writes the file to `path`, whose folder must exist. A transfer that breaks off goes on where it was, and
// one of a file that was written anew meanwhile begins again. Errors of the call and of WriteFileAtomically.
absl::Status ReceiveFile(const RegistrationClient& connection, const OpenTransfer& open,
                         const std::string& path);

}  // namespace weft
