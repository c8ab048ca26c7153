#include "base/process_identity.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace weft {

std::string KernelText(const std::string& path) {
  std::string text(4096, '\0');
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const ssize_t size = fd >= 0 ? read(fd, text.data(), text.size()) : -1;
  if (fd >= 0) close(fd);
  text.resize(static_cast<size_t>(std::max<ssize_t>(0, size)));
  return std::string(absl::StripAsciiWhitespace(text));
}

int64_t StartOfProcess(int64_t pid) {
  const std::string stat = KernelText(absl::StrCat("/proc/", pid, "/stat"));
  // The second field, in parentheses, may hold any character; the state is the third.
  const size_t name_end = stat.rfind(')');
  if (name_end == std::string::npos) return 0;
  const std::vector<std::string> fields = absl::StrSplit(stat.substr(name_end + 1), ' ', absl::SkipEmpty());
  constexpr size_t kStart = 19;  // behind the name
  int64_t start = 0;
  if (!fields.empty() && (fields[0] == "Z" || fields[0] == "X")) return -1;
  return fields.size() > kStart && absl::SimpleAtoi(fields[kStart], &start) ? start : 0;
}

std::string BootId() { return KernelText("/proc/sys/kernel/random/boot_id"); }

std::string PidNamespace() {
  char name[64] = "";
  const ssize_t size = readlink("/proc/self/ns/pid", name, sizeof name);
  return std::string(name, static_cast<size_t>(std::max<ssize_t>(0, size)));
}

}  // namespace weft
