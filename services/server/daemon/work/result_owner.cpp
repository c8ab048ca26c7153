#include "services/server/daemon/work/result_owner.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/server/callers/owners.h"
#include "services/server/rpc/error_detail.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// One of ours has some kilobytes. Whatever else calls itself job.json may be large, and no work for a daemon.
constexpr JsonLimits kOwnJobFile = {.bytes = uint64_t{256} << 10, .values = 20'000};
constexpr uint64_t kMostOfAll_bytes = uint64_t{2} << 20;

class OwnerCheck {
 public:
  explicit OwnerCheck(const Caller& caller) : caller_(caller) {}

  absl::Status CheckFolder(const fs::path& folder) {
    const absl::StatusOr<std::string> owner = OwnerOfResults(folder);
    if (!owner.ok() || owner->empty()) return owner.status();
    return CheckMayChange(caller_, "spec.out", "the results in " + folder.string(), *owner);
  }

 private:
  // Empty: nobody's.
  absl::StatusOr<std::string> OwnerOfResults(const fs::path& folder) {
    const fs::path file = folder / kJobFile;
    std::error_code error;
    // Weft writes no links there.
    if (!fs::is_regular_file(fs::symlink_status(file, error))) return "";
    const uintmax_t bytes = fs::file_size(file, error);
    if (error || bytes > kOwnJobFile.bytes) return "";
    read_bytes_ += bytes;
    if (read_bytes_ > kMostOfAll_bytes) {
      return FieldError(absl::StatusCode::kInvalidArgument,
                        {"spec.out",
                         absl::StrCat("its folders have more than ", kMostOfAll_bytes >> 20, " MiB of ",
                                      kJobFile, ", so that nobody knows whose they are"),
                         "choose another folder"});
    }
    v1::Job job;
    return ReadJsonFile(file.string(), job, kOwnJobFile).ok() ? job.submitted_by() : "";
  }

  const Caller& caller_;
  uint64_t read_bytes_ = 0;
};

}  // namespace

absl::Status CheckResultOwner(const v1::Job& job, const std::vector<std::string>& frames,
                              const Caller& caller) {
  const fs::path out = job.spec().out();
  OwnerCheck check(caller);
  absl::Status status;
  for (fs::path folder = out; folder != folder.root_path(); folder = folder.parent_path())
    status.Update(check.CheckFolder(folder));
  for (const std::string& frame : frames) {
    if (status.ok()) status = check.CheckFolder(out / frame);
  }
  return status;
}

}  // namespace weft
