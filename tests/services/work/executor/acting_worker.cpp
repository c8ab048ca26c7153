// Stands in for weft-worker where a test needs a worker that misbehaves: each frame's name says what to do.
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "absl/strings/match.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/worker/worker_event.h"
#include "services/work/worker/worker_usage.h"

namespace {

using weft::v1::WorkerEvent;

void Print(const WorkerEvent& event) {
  std::printf("%s\n", weft::WorkerEventLine(event).c_str());
  std::fflush(stdout);
}

// As every worker that ends by itself.
[[noreturn]] void End(int exit_status) {
  Print(weft::EndedEvent(exit_status, weft::UsageMeter().Now()));
  exit(exit_status);
}

[[noreturn]] void HangForever() {
  for (;;) pause();
}

// Appends a line to <out>/log, so that a test can see what was computed and how often.
void Log(const weft::v1::Task& task, const std::string& frame) {
  std::ofstream(task.spec().out() + "/log", std::ios::app) << frame << "\n";
}

// As a worker that hangs in the kernel while its daemon is killed, and writes afterwards.
void OutliveTheDaemonOnce(const weft::v1::Task& task) {
  const std::string mark = task.spec().out() + "/outlived";
  if (access(mark.c_str(), F_OK) == 0) return;
  std::ofstream(mark) << "\n";
  prctl(PR_SET_PDEATHSIG, 0);
  for (const pid_t daemon = getppid(); getppid() == daemon;) usleep(10'000);
  usleep(1'000'000);
  Log(task, "late");
  exit(0);
}

// "bad_until_mended" can be registered once the test has put a file "mended" into the folder of results.
bool CanBeRegistered(const weft::v1::Task& task, const std::string& frame) {
  if (frame == "bad_until_mended") return access((task.spec().out() + "/mended").c_str(), F_OK) == 0;
  return !absl::StartsWith(frame, "bad");
}

void Act(const weft::v1::Task& task, const std::string& frame) {
  if (absl::StartsWith(frame, "crash")) {
    std::fprintf(stderr, "cannot bear %s\n", frame.c_str());
    abort();
  }
  if (absl::StartsWith(frame, "exit")) exit(7);
  if (absl::StartsWith(frame, "leave")) exit(0);
  if (absl::StartsWith(frame, "hang")) HangForever();
  if (absl::StartsWith(frame, "stubborn")) {
    signal(SIGTERM, SIG_IGN);
    WorkerEvent event;
    event.mutable_advanced()->set_frame(frame);
    Print(event);
    HangForever();
  }
  if (absl::StartsWith(frame, "garbage")) {
    std::printf("\xff\xfe not JSON\n{\"finished\": 3}\n{}\n%s\n", std::string(3 << 20, 'x').c_str());
    std::fflush(stdout);
  }
  if (absl::EndsWith(frame, "bridged")) {
    weft::v1::FrameReport report;
    report.set_format_version(weft::kReportFormat);
    report.mutable_temporal()->set_bridged(true);
    const std::string folder = task.spec().out() + "/" + frame;
    if (!weft::CreateFolders(folder).ok() || !weft::WriteJsonFile(folder + "/report.json", report).ok())
      exit(1);
  }
  if (absl::StartsWith(frame, "slow")) usleep(300'000);
  if (absl::StartsWith(frame, "outlive")) OutliveTheDaemonOnce(task);
  // Each of them until the test has put a file "threads" into the folder of results.
  if (absl::EndsWith(frame, "lacks_threads") && access((task.spec().out() + "/threads").c_str(), F_OK) != 0) {
    if (absl::StartsWith(frame, "libgomp")) {
      std::fprintf(stderr, "libgomp: Thread creation failed: Resource temporarily unavailable\n");
      exit(1);
    }
    if (absl::StartsWith(frame, "throws")) {
      std::fprintf(stderr, "terminate called after throwing an instance of 'std::system_error'\n");
      std::fprintf(stderr, "  what():  Resource temporarily unavailable\n");
      abort();
    }
    WorkerEvent event;
    event.mutable_error()->set_code("RESOURCE_EXHAUSTED");
    event.mutable_error()->set_message("weft-pcl: cannot be started (Resource temporarily unavailable)");
    event.mutable_error()->set_reason(weft::v1::ERROR_REASON_NO_FREE_THREAD);
    Print(event);
    End(1);
  }
  if (absl::StartsWith(frame, "error")) {
    WorkerEvent event;
    event.mutable_error()->set_code("RESOURCE_EXHAUSTED");
    event.mutable_error()->set_message(task.spec().out() + ": disk full");
    Print(event);
    End(1);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bool to_file = argc > 3 && argv[2] == std::string("--events");
  if (!to_file) prctl(PR_SET_PDEATHSIG, SIGKILL);
  weft::v1::Task task;
  if (argc < 2 || !weft::ReadJsonFile(argv[1], task).ok()) return 2;
  if (to_file && freopen(argv[3], "a", stdout) == nullptr) return 2;
  if (to_file) Print(weft::BeganEvent());
  for (const std::string& frame : task.frames()) {
    WorkerEvent event;
    event.mutable_started()->set_frame(frame);
    Print(event);
    if (!task.spec().out().empty()) Log(task, frame);
    Act(task, frame);
    event.mutable_finished()->set_frame(frame);
    event.mutable_finished()->set_coverage(0.5);
    event.mutable_finished()->set_state(CanBeRegistered(task, frame) ? weft::v1::FRAME_STATE_DONE
                                                                     : weft::v1::FRAME_STATE_FAILED);
    event.mutable_finished()->set_coverage(0.5);
    Print(event);
  }
  End(0);
}
