// confined_calls KIND FOLDER: makes every system call from within a confined process, each in one of its own,
// and then attempts that a call's arguments decide on. Prints a line for each: a name and 0, errno, or -1
// where the call ended the process or did not return. KIND: worker, operation or reader.
#include <fcntl.h>
#include <linux/fs.h>
#include <linux/futex.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "services/ground/confinement/confinement.h"

namespace {

std::string kind, folder;

// Confined in this process as the kind is.
bool RunAsKind(const std::function<void()>& work) {
  weft::Confinement files;
  files.readable = {folder + "/in"};
  files.writable = {folder + "/out"};
  files.may_run_programs = kind == "operation";
  if (!weft::ConfineProcess(files).ok()) return false;
  work();
  return true;
}

// What `attempt` gives in a confined process of its own: 0, errno, or -1.
int Outcome(const std::function<long()>& attempt) {
  int ends[2];
  if (pipe(ends) != 0) std::abort();
  const pid_t child = fork();
  if (child == 0) {
    const int told = ends[1];
    const bool confined = RunAsKind([&] {
      alarm(2);
      errno = 0;
      const int outcome = attempt() < 0 ? errno : 0;
      [[maybe_unused]] const ssize_t written = write(told, &outcome, sizeof outcome);
      _exit(0);
    });
    _exit(confined ? 0 : 1);
  }
  close(ends[1]);
  int outcome = 0;
  if (read(ends[0], &outcome, sizeof outcome) != sizeof outcome) outcome = -1;
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return outcome;
}

void Say(const std::string& name, int outcome) { std::printf("%s %d\n", name.c_str(), outcome); }

// Arguments that no call does anything with.
long Call(long number) {
  static int word = 0;
  if (number == SYS_futex) return syscall(number, &word, FUTEX_WAKE_PRIVATE, 1);
  if (number == SYS_vfork) {
    const pid_t child = vfork();
    if (child == 0) _exit(0);
    return child;
  }
  return syscall(number, -1L, -1L, -1L, -1L, -1L, -1L);
}

std::string NameOf(int number) {
  char* const known = seccomp_syscall_resolve_num_arch(SCMP_ARCH_NATIVE, number);
  const std::string name = known != nullptr ? known : "call_" + std::to_string(number);
  std::free(known);
  return name;
}

std::vector<std::pair<const char*, std::function<long()>>> FileAttempts() {
  static const std::string in = folder + "/in/file", out = folder + "/out/file",
                           other = folder + "/elsewhere";
  const auto opened = [](int flags) { return open(in.c_str(), flags | O_CLOEXEC); };
  return {
      {"open.read", [opened] { return opened(O_RDONLY); }},
      {"open.make", [] { return open(out.c_str(), O_WRONLY | O_CREAT, 0644); }},
      {"open.make_setuid", [] { return open(out.c_str(), O_WRONLY | O_CREAT, 04755); }},
      {"openat.make_setgid", [] { return openat(AT_FDCWD, out.c_str(), O_WRONLY | O_CREAT, 02755); }},
      {"openat.make_nameless_setuid",
       [] { return openat(AT_FDCWD, (folder + "/out").c_str(), O_TMPFILE | O_RDWR, 04755); }},
      {"mkdir.plain", [] { return mkdir((folder + "/out/a").c_str(), 0777); }},
      {"mkdir.setgid", [] { return mkdir((folder + "/out/b").c_str(), 02777); }},
      {"chmod.input", [] { return chmod(in.c_str(), 0666); }},
      {"chmod.other", [] { return chmod(other.c_str(), 0666); }},
      {"fchmod.input", [opened] { return fchmod(opened(O_RDONLY), 0666); }},
      {"fchown.input", [opened] { return fchown(opened(O_RDONLY), 65534, 65534); }},
      {"utimensat.other", [] { return utimensat(AT_FDCWD, other.c_str(), nullptr, 0); }},
      {"ioctl.attributes",
       [opened] {
         int flags = 0;
         return ioctl(opened(O_RDONLY), FS_IOC_SETFLAGS, &flags);
       }},
      {"ioctl.type_into_terminal", [] { return ioctl(0, TIOCSTI, "x"); }},
      {"ioctl.pending",
       [opened] {
         int pending = 0;
         return ioctl(opened(O_RDONLY), FIONREAD, &pending);
       }},
      {"fcntl.flags", [opened] { return fcntl(opened(O_RDONLY), F_GETFL); }},
      {"fcntl.owner", [opened] { return fcntl(opened(O_RDONLY), F_SETOWN, getppid()); }},
      {"fcntl.lease", [opened] { return fcntl(opened(O_RDONLY), F_SETLEASE, F_RDLCK); }},
      {"fcntl.notify", [] { return fcntl(open((folder + "/in").c_str(), O_RDONLY), F_NOTIFY, DN_MODIFY); }}};
}

std::vector<std::pair<const char*, std::function<long()>>> ProcessAttempts(pid_t other) {
  static rlimit limit = {};
  return {{"prlimit.read_own", [] { return prlimit(0, RLIMIT_NOFILE, nullptr, &limit); }},
          {"prlimit.set_own",
           [] {
             getrlimit(RLIMIT_NOFILE, &limit);
             return prlimit(0, RLIMIT_NOFILE, &limit, nullptr);
           }},
          {"prlimit.read_other", [other] { return prlimit(other, RLIMIT_NOFILE, nullptr, &limit); }},
          {"prlimit.set_other", [other] { return prlimit(other, RLIMIT_NOFILE, &limit, nullptr); }},
          {"prlimit.raise_core",
           [] {
             limit = {RLIM_INFINITY, RLIM_INFINITY};
             return prlimit(0, RLIMIT_CORE, &limit, nullptr);
           }},
          {"setpriority.own", [] { return setpriority(PRIO_PROCESS, 0, 19); }},
          {"setpriority.other", [other] { return setpriority(PRIO_PROCESS, static_cast<id_t>(other), 19); }},
          {"setpriority.group", [] { return setpriority(PRIO_PGRP, 0, 19); }},
          {"setpriority.user", [] { return setpriority(PRIO_USER, 0, 19); }},
          {"affinity.own",
           [] {
             cpu_set_t cores;
             sched_getaffinity(0, sizeof cores, &cores);
             return sched_setaffinity(0, sizeof cores, &cores);
           }},
          {"affinity.other",
           [other] {
             cpu_set_t cores;
             sched_getaffinity(0, sizeof cores, &cores);
             return sched_setaffinity(other, sizeof cores, &cores);
           }},
          {"kill.own", [] { return kill(getpid(), 0); }},
          {"kill.other", [other] { return kill(other, 0); }},
          {"kill.all", [] { return kill(-1, 0); }},
          {"tgkill.other", [other] { return syscall(SYS_tgkill, other, other, 0); }},
          {"prctl.name", [] { return prctl(PR_SET_NAME, "x"); }},
          {"prctl.outlive", [] { return prctl(PR_SET_PDEATHSIG, 0); }},
          {"prctl.die_with", [] { return prctl(PR_SET_PDEATHSIG, SIGKILL); }},
          {"prctl.be_traced", [] { return prctl(0x59616d61 /* PR_SET_PTRACER */, -1L); }},
          {"process.fork", [] {
             const pid_t child = fork();
             if (child == 0) _exit(0);
             return child;
           }}};
}

std::vector<std::pair<const char*, std::function<long()>>> SocketAttempts() {
  static int pair[2];
  return {{"socketpair.stream", [] { return socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair); }},
          {"socketpair.datagram", [] { return socketpair(AF_UNIX, SOCK_DGRAM, 0, pair); }},
          {"sendto.pair",
           [] {
             if (socketpair(AF_UNIX, SOCK_STREAM, 0, pair) != 0) return ssize_t{-1};
             return send(pair[0], "x", 1, MSG_NOSIGNAL);
           }},
          {"sendto.named", [] {
             sockaddr_un name = {.sun_family = AF_UNIX, .sun_path = "/dev/log"};
             return sendto(1, "x", 1, 0, reinterpret_cast<sockaddr*>(&name), sizeof name);
           }}};
}

// 0 where the process is still in the group in which it began.
long LeaveGroup() {
  const pid_t group = getpgrp();
  setpgid(0, 0);
  errno = EEXIST;
  return getpgrp() == group ? 0 : -1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  kind = argv[1];
  folder = argv[2];
  const pid_t self = getpid(), other = fork();
  if (other == 0) {
    while (getppid() == self) usleep(10'000);
    _exit(0);
  }
  // Room for the calls of later kernels.
  constexpr int kNumbers = 512;
  for (int number = 0; number < kNumbers; ++number)
    Say(NameOf(number), Outcome([number] { return Call(number); }));
  for (const auto& attempts : {FileAttempts(), ProcessAttempts(other), SocketAttempts()}) {
    for (const auto& [name, attempt] : attempts) Say(name, Outcome(attempt));
  }
  Say("setpgid.leave", Outcome(LeaveGroup));
  std::fflush(stdout);
  kill(other, SIGKILL);
  return 0;
}
