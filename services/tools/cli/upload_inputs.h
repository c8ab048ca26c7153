// Inputs on their way to a daemon's library, for `weft library upload` and `weft register --upload`.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "services/tools/client/registration_client.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/library_item.pb.h"

namespace weft {

// Whether the text names something of a daemon instead of a path: "take:ID", "job:ID" or "library:ITEM".
bool IsOfDaemon(const std::string& path);
// Against the working folder of this process, without "." and "..".
std::string AbsolutePath(const std::string& path);
// What a daemon on this machine is asked for: names of its own and "job:ID" as they are, a path as an
// absolute one.
std::string NameAtDaemon(const std::string& input);
// The inputs so, and the output as an absolute path, which mean the same in every folder.
v1::RegistrationSpec WithAbsolutePaths(v1::RegistrationSpec spec);

// What to upload, and as what.
struct LocalInput {
  v1::ItemKind kind;
  std::string path;
  std::string name;  // empty: that of the path
};

// Hashes the files, sends those that the daemon lacks, and draws progress unless `quiet`. Errors of
// ListLocalItem and LibraryClient::Upload.
absl::StatusOr<v1::LibraryItem> UploadInput(const RegistrationClient& connection, const LocalInput& input,
                                            bool quiet);

// Uploads dump, rig, board, template and avatar, and names them by their content. InvalidArgument: no server,
// results that would lie in the inputs, or errors of UploadInput.
absl::StatusOr<v1::RegistrationSpec> UploadInputs(const std::string& server, v1::RegistrationSpec spec,
                                                  bool quiet);

}  // namespace weft
