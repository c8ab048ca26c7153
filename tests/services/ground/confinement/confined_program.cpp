// Confines itself to FOLDER/in and FOLDER/out, tries what confined processes may and may not do, and prints a
// line for each: a name and 0 or errno. `confined_program worker|writing FOLDER [USER]`.
#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>

#include "services/ground/confinement/confinement.h"
#include "services/ground/confinement/worker_user.h"

namespace {

void Try(const char* name, long result) { std::printf("%s %d\n", name, result < 0 ? errno : 0); }

int OpenFor(const std::string& path, int flags) { return open(path.c_str(), flags | O_CLOEXEC, 0600); }

void TryFiles(const std::string& folder) {
  Try("read_input", OpenFor(folder + "/in/board.json", O_RDONLY));
  Try("read_beside", OpenFor(folder + "/in/board.png", O_RDONLY));
  Try("read_link_to_allowed", OpenFor(folder + "/in/dump/allowed", O_RDONLY));
  Try("read_link_out", OpenFor(folder + "/in/dump/way_out", O_RDONLY));
  Try("read_passwd", OpenFor("/etc/passwd", O_RDONLY));
  Try("read_elsewhere", OpenFor(folder + "/elsewhere/file", O_RDONLY));
  Try("write_input", OpenFor(folder + "/in/board.json", O_WRONLY));
  Try("truncate_input", truncate((folder + "/in/board.json").c_str(), 0));
  Try("write_out", OpenFor(folder + "/out/file", O_WRONLY | O_CREAT));
  Try("rename_in_out", rename((folder + "/out/file").c_str(), (folder + "/out/other").c_str()));
  Try("remove_in_out", unlink((folder + "/out/other").c_str()));
  Try("make_elsewhere", OpenFor(folder + "/elsewhere/new", O_WRONLY | O_CREAT));
  Try("remove_elsewhere", unlink((folder + "/elsewhere/file").c_str()));
  Try("make_link", symlink("/etc/passwd", (folder + "/out/link").c_str()));
  Try("change_mode", chmod((folder + "/elsewhere/file").c_str(), 0666));
  Try("null_device", OpenFor("/dev/null", O_RDWR));
}

void TryCalls(pid_t other) {
  const int tcp = socket(AF_INET, SOCK_STREAM, 0);
  Try("tcp_socket", tcp);
  Try("local_socket", socket(AF_UNIX, SOCK_STREAM, 0));
  int pair[2];
  Try("socket_pair", socketpair(AF_UNIX, SOCK_STREAM, 0, pair));
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  Try("ptrace", ptrace(PTRACE_ATTACH, other, nullptr, nullptr));
#endif
  Try("signal", kill(other, SIGTERM));
  Try("mount", mount("none", "/tmp", "tmpfs", 0, nullptr));
  Try("unshare", unshare(CLONE_NEWUSER));
  Try("bpf", syscall(SYS_bpf, 0, nullptr, 0));
  Try("keyctl", syscall(SYS_keyctl, 0, -3, 0));
  Try("io_uring", syscall(SYS_io_uring_setup, 1, nullptr));
  Try("userfaultfd", syscall(SYS_userfaultfd, 0));
  std::fflush(stdout);
  const char* const words[] = {"/bin/true", nullptr};
  Try("run_program", execve(words[0], const_cast<char**>(words), nullptr));
  rlimit core = {};
  getrlimit(RLIMIT_CORE, &core);
  std::printf("core_limit %d\n", static_cast<int>(core.rlim_max));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const std::string what = argv[1], folder = argv[2];
  const pid_t self = getpid(), other = fork();
  if (other == 0) {
    // PR_SET_PDEATHSIG would be a signal of a process that may send none.
    while (getppid() == self) usleep(10'000);
    _exit(0);
  }
  if (argc > 3) {
    if (const absl::Status status = weft::BecomeWorkerUser(argv[3]); !status.ok()) {
      std::printf("%s\n", std::string(status.message()).c_str());
      return 1;
    }
    std::printf("user %d\n", getuid() == 0 ? 0 : 1);
  }
  weft::Confinement files;
  files.readable = {folder + "/in/board.json", folder + "/in/dump"};
  files.writable = {folder + "/out"};
  files.links.allowed = {folder + "/allowed"};
  const absl::Status status =
      what == "writing" ? weft::ConfineWriting(files.writable) : weft::ConfineProcess(files);
  if (!status.ok()) {
    std::printf("%s\n", std::string(status.message()).c_str());
    return 1;
  }
  TryFiles(folder);
  // A thread that is started later is confined, too.
  std::thread([] { Try("thread_reads_passwd", open("/etc/passwd", O_RDONLY | O_CLOEXEC)); }).join();
  TryCalls(other);
  std::fflush(stdout);
  return 0;
}
