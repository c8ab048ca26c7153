#include "services/tools/cli/upload_inputs.h"

#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/studio/recording/session_file.h"
#include "services/tools/cli/progress.h"
#include "services/tools/client/library_client.h"
#include "services/work/items/item_files.h"
#include "services/work/items/item_words.h"
#include "services/work/pipeline/output_folder.h"
#include "services/work/spec/job_input.h"
#include "services/work/spec/kind_info.h"

namespace weft {
bool IsOfDaemon(const std::string& path) {
  return absl::StartsWith(path, kTakePrefix) || absl::StartsWith(path, kJobPrefix) ||
         absl::StartsWith(path, kLibraryPrefix);
}

std::string AbsolutePath(const std::string& path) {
  return std::filesystem::absolute(path).lexically_normal().string();
}

std::string NameAtDaemon(const std::string& input) {
  return input.empty() || IsOfDaemon(input) ? input : AbsolutePath(input);
}

v1::RegistrationSpec WithAbsolutePaths(v1::RegistrationSpec spec) {
  for (const JobInput& input : InputsOf(spec)) {
    if (!input.path.empty()) SetInput(input, NameAtDaemon(input.path), &spec);
  }
  if (!spec.out().empty()) spec.set_out(AbsolutePath(spec.out()));
  return spec;
}

absl::StatusOr<v1::LibraryItem> UploadInput(const RegistrationClient& connection, const LocalInput& input,
                                            bool quiet) {
  const std::string kind = ItemKindWord(input.kind);
  absl::StatusOr<LocalItem> files;
  {
    StageBars bars(quiet);
    files = ListLocalItem(input.kind, input.path, [&](uint64_t done, uint64_t total) {
      bars.Set("read " + kind, done, total, ProgressUnit::kPercent);
    });
  }
  if (!files.ok()) return files.status();
  StageBars bars(quiet);
  return LibraryClient(connection)
      .Upload(input.kind, input.name.empty() ? ItemNameOfPath(input.path) : input.name, *files,
              [&](uint64_t done, uint64_t total) {
                bars.Set("upload " + kind, done, total, ProgressUnit::kPercent);
              });
}

absl::StatusOr<v1::RegistrationSpec> UploadInputs(const std::string& server, v1::RegistrationSpec spec,
                                                  bool quiet) {
  if (server.empty()) {
    return absl::InvalidArgumentError(
        "--upload sends the inputs to a daemon, so it needs --server HOST:PORT");
  }
  WEFT_RETURN_IF_ERROR(CheckOutOfInputs(spec));
  WEFT_ASSIGN_OR_RETURN(const auto connection, RegistrationClient::Connect(server));
  for (const JobInput& input : InputsOf(spec)) {
    if (input.kind == v1::ITEM_KIND_UNSPECIFIED || IsOfDaemon(input.path)) continue;
    WEFT_ASSIGN_OR_RETURN(const v1::LibraryItem item,
                          UploadInput(*connection, {input.kind, input.path, ""}, quiet));
    SetInput(input, absl::StrCat(kLibraryPrefix, "sha256:", item.id()), &spec);
  }
  return spec;
}

}  // namespace weft
