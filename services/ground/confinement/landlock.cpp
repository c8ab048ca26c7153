#include "services/ground/confinement/landlock.h"

#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

// The kernel's numbers, linux/landlock.h: Debian 12's header ends before version 3.
constexpr uint64_t kExecute = 1 << 0, kWriteFile = 1 << 1, kReadFile = 1 << 2, kReadDir = 1 << 3;
constexpr uint64_t kMakeChar = 1 << 6, kMakeSock = 1 << 9, kMakeFifo = 1 << 10, kMakeBlock = 1 << 11;
constexpr uint64_t kMakeSym = 1 << 12, kRefer = 1 << 13, kTruncate = 1 << 14, kIoctlDev = 1 << 15;
constexpr uint64_t kOfVersion1 = (1 << 13) - 1;
constexpr uint64_t kOfFiles = kExecute | kWriteFile | kReadFile | kTruncate | kIoctlDev;
constexpr uint64_t kSpecialFiles = kMakeChar | kMakeSock | kMakeFifo | kMakeBlock | kMakeSym;
constexpr uint64_t kTcp = 3;         // bind and connect
constexpr uint64_t kAllScopes = 3;   // abstract sockets and signals
constexpr uint32_t kAskVersion = 1;  // LANDLOCK_CREATE_RULESET_VERSION
constexpr int kRulePathBeneath = 1;

struct RulesetAttributes {
  uint64_t files = 0, network = 0, scopes = 0;
};

struct [[gnu::packed]] PathBeneath {
  uint64_t allowed = 0;
  int32_t parent = -1;
};

uint64_t FileAccesses(int version) {
  return kOfVersion1 | (version >= 2 ? kRefer : 0) | (version >= 3 ? kTruncate : 0) |
         (version >= 5 ? kIoctlDev : 0);
}

uint64_t AccessesOf(LandlockRules::Access access) {
  constexpr uint64_t kRead = kReadFile | kReadDir;
  switch (access) {
    case LandlockRules::Access::kRead:
      return kRead;
    case LandlockRules::Access::kReadAndRun:
      return kRead | kExecute;
    case LandlockRules::Access::kUseDevices:
      return kRead | kWriteFile | kIoctlDev;
    case LandlockRules::Access::kReadAndWrite:
      return ~(kExecute | kIoctlDev | kSpecialFiles);
  }
  return 0;
}

absl::Status LandlockError(const char* what) {
  return absl::UnavailableError(
      absl::StrCat("Landlock, which confines this process: ", what, " (", std::strerror(errno), ")"));
}

}  // namespace

int LandlockVersion() {
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, kAskVersion);
  return version > 0 ? static_cast<int>(version) : 0;
}

absl::StatusOr<LandlockRules> LandlockRules::Create(const Scope& scope) {
  const int version = LandlockVersion();
  RulesetAttributes attributes = {.files = FileAccesses(version)};
  // An older kernel takes a shorter structure.
  size_t bytes = sizeof(uint64_t);
  if (version >= 4) {
    bytes += sizeof(uint64_t);
    attributes.network = scope.may_use_network ? 0 : kTcp;
  }
  if (version >= 6) {
    bytes += sizeof(uint64_t);
    attributes.scopes = scope.may_signal ? 0 : kAllScopes;
  }
  UniqueFd rules(static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, bytes, 0)));
  if (!rules.open()) return LandlockError("no rules can be made");
  return LandlockRules(std::move(rules), attributes.files);
}

absl::Status LandlockRules::Allow(int fd, Access access) {
  struct stat info;
  if (fstat(fd, &info) != 0) return LandlockError("a file has no kind");
  PathBeneath rule = {.allowed = AccessesOf(access) & handled_, .parent = fd};
  if (!S_ISDIR(info.st_mode)) rule.allowed &= kOfFiles;
  if (rule.allowed == 0) return absl::OkStatus();
  if (syscall(SYS_landlock_add_rule, rules_.get(), kRulePathBeneath, &rule, 0) == 0) return absl::OkStatus();
  return LandlockError("a rule is refused");
}

absl::Status LandlockRules::Enforce() const {
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return LandlockError("privileges cannot be given up");
  if (syscall(SYS_landlock_restrict_self, rules_.get(), 0) == 0) return absl::OkStatus();
  return LandlockError("the rules cannot be enforced");
}

}  // namespace weft
