// `weft-video [--parent PID] FILE PROGRAM ARGUMENT...`: becomes ffmpeg or ffprobe, which from then on reads
// FILE and nothing else. Started by programs of Weft (video_program.h): decoders of videos were not made for
// hostile files.
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "services/ground/confinement/confinement.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/process_limits.h"

namespace {

constexpr int64_t kMemory_mib = 4096;               // 8K video in 10 bits with two threads takes a fifth
constexpr rlim_t kMostWritten = rlim_t{512} << 20;  // of each file that is open already: times and complaints

absl::Status Confine(const std::string& file) {
  // A limit of the user's that is lower stays.
  rlimit written = {kMostWritten, kMostWritten};
  rlimit given = {};
  if (getrlimit(RLIMIT_FSIZE, &given) == 0) {
    written.rlim_max = std::min(written.rlim_max, given.rlim_max);
    written.rlim_cur = std::min(written.rlim_max, given.rlim_cur);
  }
  if (setrlimit(RLIMIT_FSIZE, &written) != 0)
    return absl::UnavailableError(absl::StrCat("no limit of file sizes: ", std::strerror(errno)));
  absl::Status status = weft::LimitMemory(kMemory_mib);
  weft::Confinement confinement;
  confinement.readable = {file};
  confinement.may_run_programs = true;
  status.Update(weft::ConfineProcess(confinement));
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--version") {
    std::printf("weft-video " WEFT_VERSION "\n");
    return weft::kExitDone;
  }
  int at = 1;
  int parent = 0;
  if (argc > 3 && std::string_view(argv[1]) == "--parent") {
    parent = std::atoi(argv[2]);
    at = 3;
  }
  const std::string_view program = argc > at + 1 ? argv[at + 1] : "";
  if (program != "ffmpeg" && program != "ffprobe") {
    std::fputs("Usage: weft-video [--parent PID] FILE ffmpeg|ffprobe ARGUMENT...\n", stderr);
    return weft::kExitBadInput;
  }
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (parent != 0 && getppid() != parent) return weft::kExitFailed;
  if (const absl::Status confined = Confine(argv[at]); !confined.ok()) {
    weft::PrintError(confined);
    return weft::kExitFailed;
  }
  execvp(argv[at + 1], argv + at + 1);
  std::fprintf(stderr, "the program %s does not start: %s; install the package ffmpeg\n", argv[at + 1],
               std::strerror(errno));
  return weft::kExitFailed;
}
