#include "services/daemon/results.h"

#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "services/rpc/result_names.h"

namespace weft {

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

}  // namespace weft
