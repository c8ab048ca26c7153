#include "services/work/pipeline/output_folder.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/work/spec/job_input.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

fs::path Resolved(const std::string& path) {
  std::error_code error;
  fs::path resolved = fs::weakly_canonical(path, error);
  if (error) resolved = fs::path(path).lexically_normal();
  return resolved.has_filename() ? resolved : resolved.parent_path();
}

bool LiesIn(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

}  // namespace

absl::Status CheckOutOfInputs(const v1::RegistrationSpec& spec) {
  const fs::path out = Resolved(spec.out());
  for (const JobInput& input : InputsOf(spec)) {
    if (input.path.empty()) continue;
    const fs::path read = Resolved(input.path);
    if (IsFolder(input.path) && LiesIn(out, read)) {
      return absl::InvalidArgumentError(absl::StrCat("out: ", spec.out(), " lies in the folder of ",
                                                     input.what, ", ", input.path,
                                                     ", which is only read; choose a folder outside of it"));
    }
    if (LiesIn(read, out)) {
      return absl::InvalidArgumentError(absl::StrCat("out: ", spec.out(), " contains ", input.what, ", ",
                                                     input.path,
                                                     ", which is only read; choose another folder"));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> MakeOutputFolder(const std::string& out) {
  WEFT_RETURN_IF_ERROR(CreateFolders(out));
  std::error_code error;
  const fs::path canonical = fs::canonical(out, error);
  if (error) return absl::NotFoundError(absl::StrCat(out, ": no such folder (", error.message(), ")"));
  return canonical.string();
}

}  // namespace weft
