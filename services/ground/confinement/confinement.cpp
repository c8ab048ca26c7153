#include "services/ground/confinement/confinement.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/ground/confinement/allowed_calls.h"
#include "services/ground/confinement/capabilities.h"
#include "services/ground/confinement/landlock.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using Access = LandlockRules::Access;

// Libraries, time zone, fonts, and what TBB and sanitizers ask about the machine and this process.
constexpr const char* kSystemFiles[] = {"/usr",
                                        "/lib",
                                        "/lib64",
                                        "/etc/ld.so.cache",
                                        "/etc/localtime",
                                        "/etc/fonts",
                                        "/var/cache/fontconfig",
                                        "/sys/devices/system",
                                        "/sys/fs/cgroup",
                                        "/proc/cpuinfo",
                                        "/proc/meminfo",
                                        "/dev/zero",
                                        "/dev/urandom"};

// Links are followed: these names are the operator's. One that does not exist needs no rule.
absl::Status AllowSystemFile(const std::string& path, Access access, LandlockRules& rules) {
  const UniqueFd file(open(path.c_str(), O_PATH | O_CLOEXEC));
  return file.open() ? rules.Allow(file.get(), access) : absl::OkStatus();
}

absl::Status AllowSystem(bool may_run_programs, LandlockRules& rules) {
  const Access access = may_run_programs ? Access::kReadAndRun : Access::kRead;
  for (const char* path : kSystemFiles) {
    WEFT_RETURN_IF_ERROR(AllowSystemFile(path, access, rules));
  }
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    WEFT_RETURN_IF_ERROR(AllowSystemFile(self.parent_path(), access, rules));
  }
  // Kept open for ever: a rule is bound to the kernel's entry, which is made anew once nobody uses it.
  static const UniqueFd own(open("/proc/self", O_PATH | O_CLOEXEC));
  absl::Status status = own.open() ? rules.Allow(own.get(), Access::kRead) : absl::OkStatus();
  status.Update(AllowSystemFile("/dev/null", Access::kUseDevices, rules));
  return status;
}

absl::Status AllowFile(const std::string& path, Access access, LandlockRules& rules) {
  const absl::StatusOr<UniqueFd> file = OpenWithoutLinks(path);
  if (file.ok()) return rules.Allow(file->get(), access);
  return absl::IsNotFound(file.status()) ? absl::OkStatus() : file.status();
}

absl::Status EnforceFiles(const Confinement& confinement) {
  WEFT_ASSIGN_OR_RETURN(LandlockRules rules, LandlockRules::Create({}));
  absl::Status status = AllowSystem(confinement.may_run_programs, rules);
  for (const std::string& path : confinement.readable) status.Update(AllowFile(path, Access::kRead, rules));
  for (const std::string& path : FindLinks(confinement.readable, confinement.links).others)
    status.Update(AllowFile(path, Access::kRead, rules));
  for (const std::string& path : confinement.writable)
    status.Update(AllowFile(path, Access::kReadAndWrite, rules));
  return status.ok() ? rules.Enforce() : status;
}

// Without Landlock, names that were exchanged for links are noticed here at least.
absl::Status CheckFiles(const Confinement& confinement) {
  for (const std::vector<std::string>* paths : {&confinement.readable, &confinement.writable}) {
    for (const std::string& path : *paths) {
      const absl::Status status = OpenWithoutLinks(path).status();
      if (!status.ok() && !absl::IsNotFound(status)) return status;
    }
  }
  return absl::OkStatus();
}

absl::Status LeaveNoCoreDump() {
  // A core would hold the users' pictures. 1 instead of 0 also keeps it from a program that takes cores.
  rlimit limit = {};
  if (getrlimit(RLIMIT_CORE, &limit) == 0) {
    limit.rlim_max = std::min<rlim_t>(limit.rlim_max, 1);
    limit.rlim_cur = limit.rlim_max;
    if (setrlimit(RLIMIT_CORE, &limit) == 0 && prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0)
      return absl::OkStatus();
  }
  return absl::UnavailableError(absl::StrCat("this process cannot be confined: ", std::strerror(errno)));
}

bool HasCallFilters() { return prctl(PR_GET_SECCOMP, 0, 0, 0, 0) >= 0; }

}  // namespace

absl::Status ConfineProcess(const Confinement& confinement) {
  WEFT_RETURN_IF_ERROR(LeaveNoCoreDump());
  WEFT_RETURN_IF_ERROR(LandlockVersion() > 0 ? EnforceFiles(confinement) : CheckFiles(confinement));
  if (!KeepFileCapabilities())
    return absl::UnavailableError(
        absl::StrCat("this process cannot give up its capabilities: ", std::strerror(errno)));
  if (!HasCallFilters()) return absl::OkStatus();
  return AllowCallsOf({.may_run_programs = confinement.may_run_programs});
}

absl::Status ConfineWriting(const std::vector<std::string>& writable) {
  if (absl::Status status = LeaveNoCoreDump(); !status.ok() || LandlockVersion() == 0) return status;
  WEFT_ASSIGN_OR_RETURN(LandlockRules rules,
                        LandlockRules::Create({.may_use_network = true, .may_signal = true}));
  absl::Status status = AllowSystemFile("/", Access::kReadAndRun, rules);
  for (const char* devices : {"/dev", "/proc/self"})
    status.Update(AllowSystemFile(devices, Access::kUseDevices, rules));
  for (const std::string& path : writable) status.Update(AllowFile(path, Access::kReadAndWrite, rules));
  if (status.ok()) status = rules.Enforce();
  return status.ok() && HasCallFilters() ? DenyCallsOnOthers() : status;
}

std::string ConfinementGaps() {
  const int version = LandlockVersion();
  std::string gaps;
  if (version == 0) {
    gaps = "this kernel has no Landlock (5.13), so workers may use all files that their user may";
  } else if (version < 6) {
    gaps = absl::StrCat("this kernel has version ", version, " of Landlock, of 6 (6.12) that are wanted: ",
                        version < 4 ? "TCP is denied by seccomp alone, and " : "",
                        "operations may signal other processes of their user");
  }
  if (!HasCallFilters()) {
    absl::StrAppend(&gaps, gaps.empty() ? "" : "; ",
                    "this kernel has no seccomp, so workers may use all calls");
  }
  return gaps;
}

}  // namespace weft
