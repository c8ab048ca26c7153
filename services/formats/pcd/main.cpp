// `weft-pcl read|write|filter [PARENT]`: PCD on standard input becomes PLY on standard output, PLY becomes
// PCD, or a scan of either format becomes PLY without outliers. Started by programs of Weft (pcl_program.h),
// which link no PCL themselves, and by people. `read` leaves points without a measurement out, `read-all`
// does not.
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <utility>

#include "absl/strings/match.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/ply.h"
#include "services/formats/files/ply_points.h"
#include "services/formats/pcd/pcl_convert.h"
#include "services/formats/pcd/pcl_filter.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/process_limits.h"

namespace {

constexpr char kInput[] = "/proc/self/fd/0";

// A header may announce any number of points, and PCL makes room for them before it looks at the data. A file
// of text needs 20 times its size, a compressed one more.
absl::Status LimitResources() {
  struct stat info = {};
  if (fstat(STDIN_FILENO, &info) != 0 || !S_ISREG(info.st_mode)) {
    return absl::InvalidArgumentError("standard input must be a file");
  }
  const int64_t mib = info.st_size >> 20;
  const auto seconds = static_cast<rlim_t>(60 + mib);
  const rlimit time = {seconds, seconds}, none = {0, 0};
  setrlimit(RLIMIT_CPU, &time);
  setrlimit(RLIMIT_CORE, &none);
  return weft::LimitMemory(1024 + 64 * mib);
}

absl::StatusOr<std::string> Convert(std::string_view task) {
  WEFT_RETURN_IF_ERROR(LimitResources());
  if (task == "read" || task == "read-all") {
    absl::StatusOr<weft::Ply> ply = weft::PlyFromPcdFile(kInput);
    if (ply.ok() && task == "read") weft::DropUnmeasured(*ply);
    return ply.ok() ? weft::SerializePly(*ply) : ply.status();
  }
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, weft::ReadWholeFile(kInput));
  absl::StatusOr<weft::Ply> ply = task == "filter" && !absl::StartsWith(bytes, "ply")
                                      ? weft::PlyFromPcdFile(kInput)
                                      : weft::ParsePly(bytes, "standard input");
  if (!ply.ok()) return ply.status();
  if (task == "write") return weft::PcdFromPly(*ply);
  weft::DropUnmeasured(*ply);
  ply = weft::WithoutOutliers(*std::move(ply), {});
  return ply.ok() ? weft::SerializePly(*ply) : ply.status();
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view task = argc > 1 ? argv[1] : "";
  if (task == "--version") {
    std::printf("weft-pcl " WEFT_VERSION "\n");
    return weft::kExitDone;
  }
  if (argc > 3 || (task != "read" && task != "read-all" && task != "write" && task != "filter")) {
    std::fputs(
        "Usage: weft-pcl read < FILE.pcd > FILE.ply\n       weft-pcl write < FILE.ply > FILE.pcd\n"
        "       weft-pcl filter < SCAN > SCAN-WITHOUT-OUTLIERS.ply\n",
        stderr);
    return weft::kExitBadInput;
  }
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (argc > 2 && getppid() != std::atoi(argv[2])) return weft::kExitFailed;
  // PCL talks on standard output, too.
  const int out = dup(STDOUT_FILENO);
  if (out < 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0) return weft::kExitFailed;
  try {
    const absl::StatusOr<std::string> result = Convert(task);
    if (result.ok()) return weft::WriteAll(out, *result) == 0 ? weft::kExitDone : weft::kExitFailed;
    std::fprintf(stderr, "%s\n", std::string(result.status().message()).c_str());
    return weft::kExitBadInput;
  } catch (const std::bad_alloc&) {
    std::fputs("its header announces more points than the file can hold, or the machine's memory is full\n",
               stderr);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  }
  return weft::kExitBadInput;
}
