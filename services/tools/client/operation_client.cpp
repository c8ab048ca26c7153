#include "services/tools/client/operation_client.h"

#include <grpcpp/grpcpp.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/tools/client/file_transfer.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Of a daemon that means well or does not: below the folder.
bool StaysBelow(const fs::path& path) {
  if (path.empty() || path.is_absolute()) return false;
  for (const fs::path& part : path) {
    if (part == "..") return false;
  }
  return true;
}

}  // namespace

absl::Status OperationClient::FetchFiles(const std::string& id, const std::string& folder,
                                         const std::function<void(size_t done, size_t total)>& progress) {
  WEFT_ASSIGN_OR_RETURN(const auto list, CallForPages(connection_, *stub_, &Stub::ListOperationFiles,
                                                      RequestNaming<v1::ListOperationFilesRequest>(id), 0,
                                                      &v1::ListOperationFilesResponse::files_size));
  size_t done = 0;
  for (const v1::OperationFile& file : list.files()) {
    if (!StaysBelow(file.path())) {
      return absl::DataLossError(
          absl::StrCat("the daemon names a file outside of its folder: ", file.path()));
    }
    const fs::path path = fs::path(folder) / file.path();
    WEFT_RETURN_IF_ERROR(CreateFolders(path.parent_path()));
    v1::FetchOperationFileRequest request;
    request.set_operation_id(id);
    request.set_path(file.path());
    const OpenTransfer open = [&](grpc::ClientContext* context, int64_t offset, const std::string& version) {
      request.set_offset(offset);
      request.set_version(version);
      return stub_->FetchOperationFile(context, request);
    };
    WEFT_RETURN_IF_ERROR(ReceiveFile(connection_, open, path));
    progress(++done, static_cast<size_t>(list.files_size()));
  }
  return absl::OkStatus();
}

}  // namespace weft
