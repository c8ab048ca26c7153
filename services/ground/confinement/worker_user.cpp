#include "services/ground/confinement/worker_user.h"

#include <grp.h>
#include <linux/capability.h>
#include <pwd.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/ground/confinement/landlock.h"

namespace weft {
namespace {

struct UserNumbers {
  uid_t user = 0;
  gid_t group = 0;
};

absl::StatusOr<UserNumbers> FindUser(const std::string& name) {
  passwd entry = {};
  passwd* found = nullptr;
  std::vector<char> buffer(16384);
  if (getpwnam_r(name.c_str(), &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat("--worker-user: no user \"", name,
                                                   "\" on this machine; make it with `useradd --system`"));
  }
  if (entry.pw_uid == 0)
    return absl::InvalidArgumentError("--worker-user: is root; name a user of the workers' own");
  return UserNumbers{entry.pw_uid, entry.pw_gid};
}

bool KeepFileCapability() {
  __user_cap_header_struct header = {.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  constexpr uint32_t kKept = 1u << CAP_DAC_OVERRIDE;
  __user_cap_data_struct sets[2] = {{.effective = kKept, .permitted = kKept, .inheritable = kKept}, {}};
  return syscall(SYS_capset, &header, sets) == 0 &&
         prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_RAISE, CAP_DAC_OVERRIDE, 0, 0) == 0;
}

}  // namespace

absl::Status CheckWorkerUser(const std::string& name) {
  WEFT_RETURN_IF_ERROR(FindUser(name).status());
  if (geteuid() != 0) {
    return absl::FailedPreconditionError(
        "--worker-user: needs a daemon of root; start weftd as that user instead, and leave it out");
  }
  if (LandlockVersion() > 0) return absl::OkStatus();
  return absl::FailedPreconditionError(
      "--worker-user: this kernel has no Landlock, which such workers need; leave it out");
}

absl::Status BecomeWorkerUser(const std::string& name) {
  WEFT_RETURN_IF_ERROR(CheckWorkerUser(name));
  WEFT_ASSIGN_OR_RETURN(const UserNumbers user, FindUser(name));
  if (initgroups(name.c_str(), user.group) == 0 && prctl(PR_SET_KEEPCAPS, 1, 0, 0, 0) == 0 &&
      setresgid(user.group, user.group, user.group) == 0 && setresuid(user.user, user.user, user.user) == 0 &&
      KeepFileCapability()) {
    return absl::OkStatus();
  }
  return absl::UnavailableError(
      absl::StrCat("--worker-user: this process cannot become ", name, " (", std::strerror(errno), ")"));
}

}  // namespace weft
