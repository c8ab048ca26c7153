#include "services/ground/confinement/allowed_calls.h"

#include <fcntl.h>
#include <linux/sched.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <set>
#include <vector>

#include "absl/strings/str_cat.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define WEFT_SANITIZED 1
#else
#define WEFT_SANITIZED 0
#endif

namespace weft {
namespace {

// Of files that Landlock lets it open, and of descriptors that it has. truncate() is left out: Landlock knows
// it from Linux 6.2 on. So are links, which nobody makes, and what changes a file's mode, owner, times or
// attributes, which Landlock never looks at.
constexpr int kBytes[] = {
    SCMP_SYS(read),      SCMP_SYS(write),           SCMP_SYS(readv),     SCMP_SYS(writev),
    SCMP_SYS(pread64),   SCMP_SYS(pwrite64),        SCMP_SYS(preadv),    SCMP_SYS(pwritev),
    SCMP_SYS(preadv2),   SCMP_SYS(pwritev2),        SCMP_SYS(fsync),     SCMP_SYS(fdatasync),
    SCMP_SYS(ftruncate), SCMP_SYS(fallocate),       SCMP_SYS(fadvise64), SCMP_SYS(readahead),
    SCMP_SYS(sendfile),  SCMP_SYS(copy_file_range), SCMP_SYS(getdents64)};
constexpr int kDescriptors[] = {SCMP_SYS(lseek), SCMP_SYS(close), SCMP_SYS(dup),
                                SCMP_SYS(dup2),  SCMP_SYS(dup3),  SCMP_SYS(close_range),
                                SCMP_SYS(flock), SCMP_SYS(pipe),  SCMP_SYS(pipe2)};
constexpr int kNames[] = {SCMP_SYS(getcwd), SCMP_SYS(rename),   SCMP_SYS(renameat), SCMP_SYS(renameat2),
                          SCMP_SYS(unlink), SCMP_SYS(unlinkat), SCMP_SYS(rmdir)};

// Metadata of any path, which neither Landlock nor a filter can tell apart. It is shown, not changed.
constexpr int kMetadata[] = {SCMP_SYS(stat),       SCMP_SYS(fstat),     SCMP_SYS(lstat),
                             SCMP_SYS(newfstatat), SCMP_SYS(statx),     SCMP_SYS(fstatfs),
                             SCMP_SYS(access),     SCMP_SYS(faccessat), SCMP_SYS(faccessat2),
                             SCMP_SYS(readlink),   SCMP_SYS(readlinkat)};

constexpr int kMemory[] = {SCMP_SYS(brk),     SCMP_SYS(mmap),    SCMP_SYS(munmap), SCMP_SYS(mremap),
                           SCMP_SYS(madvise), SCMP_SYS(mincore), SCMP_SYS(msync),  SCMP_SYS(mprotect)};

constexpr int kThreads[] = {SCMP_SYS(futex),          SCMP_SYS(futex_waitv),       SCMP_SYS(set_robust_list),
                            SCMP_SYS(rseq),           SCMP_SYS(set_tid_address),   SCMP_SYS(membarrier),
                            SCMP_SYS(sched_yield),    SCMP_SYS(sched_getaffinity), SCMP_SYS(getcpu),
                            SCMP_SYS(exit),           SCMP_SYS(exit_group),        SCMP_SYS(arch_prctl),
                            SCMP_SYS(restart_syscall)};

// Of this process: whom signals reach is asked below.
constexpr int kSignals[] = {SCMP_SYS(rt_sigaction),  SCMP_SYS(rt_sigprocmask),  SCMP_SYS(rt_sigreturn),
                            SCMP_SYS(rt_sigpending), SCMP_SYS(rt_sigtimedwait), SCMP_SYS(rt_sigsuspend),
                            SCMP_SYS(sigaltstack),   SCMP_SYS(signalfd4),       SCMP_SYS(pause)};

constexpr int kTime[] = {SCMP_SYS(clock_gettime),  SCMP_SYS(clock_getres),    SCMP_SYS(gettimeofday),
                         SCMP_SYS(time),           SCMP_SYS(times),           SCMP_SYS(getrusage),
                         SCMP_SYS(nanosleep),      SCMP_SYS(clock_nanosleep), SCMP_SYS(alarm),
                         SCMP_SYS(setitimer),      SCMP_SYS(getitimer),       SCMP_SYS(timer_create),
                         SCMP_SYS(timer_settime),  SCMP_SYS(timer_gettime),   SCMP_SYS(timer_getoverrun),
                         SCMP_SYS(timer_delete),   SCMP_SYS(timerfd_create),  SCMP_SYS(timerfd_settime),
                         SCMP_SYS(timerfd_gettime)};

constexpr int kWaiting[] = {SCMP_SYS(poll),         SCMP_SYS(ppoll),        SCMP_SYS(select),
                            SCMP_SYS(pselect6),     SCMP_SYS(epoll_create), SCMP_SYS(epoll_create1),
                            SCMP_SYS(epoll_ctl),    SCMP_SYS(epoll_wait),   SCMP_SYS(epoll_pwait),
                            SCMP_SYS(epoll_pwait2), SCMP_SYS(eventfd),      SCMP_SYS(eventfd2)};

constexpr int kOwnNames[] = {SCMP_SYS(getpid),    SCMP_SYS(gettid),    SCMP_SYS(getppid),   SCMP_SYS(getpgrp),
                             SCMP_SYS(getuid),    SCMP_SYS(geteuid),   SCMP_SYS(getgid),    SCMP_SYS(getegid),
                             SCMP_SYS(getresuid), SCMP_SYS(getresgid), SCMP_SYS(getgroups), SCMP_SYS(uname),
                             SCMP_SYS(sysinfo),   SCMP_SYS(getrandom), SCMP_SYS(getrlimit), SCMP_SYS(capget)};

// Programs that are started, what they are told by, and how they confine themselves further. ffmpeg's
// libraries complain, where nothing is wrong, if they may not lock a page; its limit (RLIMIT_MEMLOCK) is the
// user's.
constexpr int kPrograms[] = {SCMP_SYS(fork),     SCMP_SYS(mlock),        SCMP_SYS(munlock),
                             SCMP_SYS(vfork),    SCMP_SYS(execve),       SCMP_SYS(wait4),
                             SCMP_SYS(waitid),   SCMP_SYS(memfd_create), SCMP_SYS(recvfrom),
                             SCMP_SYS(shutdown), SCMP_SYS(setrlimit)};
constexpr int kFurtherConfinement[] = {SCMP_SYS(capset), SCMP_SYS(seccomp), SCMP_SYS(landlock_create_ruleset),
                                       SCMP_SYS(landlock_add_rule), SCMP_SYS(landlock_restrict_self)};

#if WEFT_SANITIZED
// The search for leaks stops all threads from a process of its own.
constexpr int kSanitizers[] = {
    SCMP_SYS(ptrace),           SCMP_SYS(clone),       SCMP_SYS(wait4),      SCMP_SYS(prctl),
    SCMP_SYS(process_vm_readv), SCMP_SYS(personality), SCMP_SYS(sigaltstack)};
#endif

// clone3 is the first that the C library replaces by an older call only when told that it is lacking.
constexpr int kFirstLacked = SCMP_SYS(clone3);
// Later than Debian 12's headers; their numbers are those of all machines.
constexpr int kFchmodat2 = 452, kSetxattrat = 463, kRemovexattrat = 466, kFileSetattr = 469;

// What a recorder has no need of, though it needs too much for a list of what it may: first attributes of
// files.
constexpr int kAttributes[] = {SCMP_SYS(chmod),        SCMP_SYS(fchmod),      SCMP_SYS(fchmodat),
                               SCMP_SYS(chown),        SCMP_SYS(fchown),      SCMP_SYS(lchown),
                               SCMP_SYS(fchownat),     SCMP_SYS(setxattr),    SCMP_SYS(lsetxattr),
                               SCMP_SYS(fsetxattr),    SCMP_SYS(removexattr), SCMP_SYS(lremovexattr),
                               SCMP_SYS(fremovexattr), SCMP_SYS(utime),       SCMP_SYS(utimes),
                               SCMP_SYS(utimensat),    SCMP_SYS(futimesat),   SCMP_SYS(truncate)};
constexpr int kLaterAttributes[] = {kFchmodat2, kSetxattrat, kRemovexattrat, kFileSetattr};
// Files and processes past their names and owners, and other ways into the kernel.
constexpr int kOnOthers[] = {SCMP_SYS(name_to_handle_at),
                             SCMP_SYS(open_by_handle_at),
                             SCMP_SYS(process_vm_readv),
                             SCMP_SYS(process_vm_writev),
                             SCMP_SYS(process_madvise),
                             SCMP_SYS(pidfd_getfd),
                             SCMP_SYS(kcmp)};
constexpr int kByOtherWays[] = {
    SCMP_SYS(userfaultfd),    SCMP_SYS(perf_event_open), SCMP_SYS(bpf),
    SCMP_SYS(io_uring_setup), SCMP_SYS(io_uring_enter),  SCMP_SYS(io_uring_register),
    SCMP_SYS(add_key),        SCMP_SYS(keyctl),          SCMP_SYS(request_key)};
constexpr int kMounts[] = {
    SCMP_SYS(mount),  SCMP_SYS(umount2),  SCMP_SYS(move_mount), SCMP_SYS(open_tree), SCMP_SYS(mount_setattr),
    SCMP_SYS(fsopen), SCMP_SYS(fsconfig), SCMP_SYS(fsmount),    SCMP_SYS(fspick),    SCMP_SYS(pivot_root),
    SCMP_SYS(chroot), SCMP_SYS(setns),    SCMP_SYS(unshare)};
constexpr int kMachine[] = {
    SCMP_SYS(kexec_load),    SCMP_SYS(kexec_file_load), SCMP_SYS(init_module),   SCMP_SYS(finit_module),
    SCMP_SYS(delete_module), SCMP_SYS(reboot),          SCMP_SYS(swapon),        SCMP_SYS(swapoff),
    SCMP_SYS(acct),          SCMP_SYS(quotactl),        SCMP_SYS(quotactl_fd),   SCMP_SYS(syslog),
    SCMP_SYS(settimeofday),  SCMP_SYS(clock_settime),   SCMP_SYS(clock_adjtime), SCMP_SYS(adjtimex),
    SCMP_SYS(iopl),          SCMP_SYS(ioperm)};

constexpr uint64_t kSocketType = 0xf;
constexpr uint64_t kLow = 0xffffffff;  // of an int; the kernel ignores what stands above it
constexpr uint64_t kSetIdBits = 07000;
constexpr uint64_t kSpaces = CLONE_NEWUSER | CLONE_NEWNS | CLONE_NEWNET | CLONE_NEWPID | CLONE_NEWIPC |
                             CLONE_NEWUTS | CLONE_NEWCGROUP | CLONE_PARENT | CLONE_PTRACE;

scmp_arg_cmp IntIs(unsigned argument, int64_t value) {
  return SCMP_CMP(argument, SCMP_CMP_MASKED_EQ, kLow, static_cast<uint64_t>(value) & kLow);
}

class Filter {
 public:
  explicit Filter(uint32_t otherwise) : context_(seccomp_init(otherwise), &seccomp_release) {
    if (!context_) error_ = -ENOMEM;
    // Privileges are given up by whoever confines the process, also for its files.
    if (context_) Note(seccomp_attr_set(context_.get(), SCMP_FLTATR_CTL_NNP, 1));
  }

  template <size_t n>
  void Allow(const int (&calls)[n]) {
    for (const int call : calls) AllowIf(call, {});
  }
  // Where all conditions hold.
  void AllowIf(int call, const std::vector<scmp_arg_cmp>& conditions) {
    allowed_.insert(call);
    Add(SCMP_ACT_ALLOW, call, conditions);
  }
  // Where the argument is one of these.
  void AllowOneOf(int call, unsigned argument, std::initializer_list<int64_t> values) {
    for (const int64_t value : values) AllowIf(call, {IntIs(argument, value)});
  }
  template <size_t n>
  void Deny(const int (&calls)[n]) {
    for (const int call : calls) Add(SCMP_ACT_ERRNO(EPERM), call, {});
  }
  // Not done, and answered with 0.
  void Ignore(int call) { Add(SCMP_ACT_ERRNO(0), call, {}); }
  // Those from this one on that are not allowed are answered as an older kernel would.
  void LackFrom(int first) {
    constexpr int kNumbers = 256;  // about ten come a year
    for (int call = first; call < first + kNumbers; ++call) {
      if (!allowed_.contains(call)) Add(SCMP_ACT_ERRNO(ENOSYS), call, {});
    }
  }
  absl::Status Load() {
    if (error_ == 0) Note(seccomp_load(context_.get()));
    if (error_ == 0) return absl::OkStatus();
    return absl::UnavailableError(
        absl::StrCat("seccomp, which confines this process: ", std::strerror(-error_)));
  }

 private:
  void Add(uint32_t action, int call, const std::vector<scmp_arg_cmp>& conditions) {
    // A call that this machine does not have needs no rule.
    if (error_ != 0 || call < 0) return;
    Note(seccomp_rule_add_array(context_.get(), action, call, static_cast<unsigned>(conditions.size()),
                                conditions.data()));
  }
  void Note(int error) {
    if (error_ == 0) error_ = error;
  }

  std::unique_ptr<void, void (*)(scmp_filter_ctx)> context_;
  std::set<int> allowed_;
  int error_ = 0;  // negative errno
};

// Opened and made, but never with the bits that lend a file's user to whoever runs it. The C library gives a
// mode of 0 where none is needed.
void AllowOpening(Filter& filter) {
  const auto plain = [](unsigned mode) { return SCMP_CMP(mode, SCMP_CMP_MASKED_EQ, kSetIdBits, 0); };
  filter.AllowIf(SCMP_SYS(open), {plain(2)});
  filter.AllowIf(SCMP_SYS(openat), {plain(3)});
  filter.AllowIf(SCMP_SYS(mkdir), {plain(1)});
  filter.AllowIf(SCMP_SYS(mkdirat), {plain(2)});
}

// A descriptor's own state. Left out are those that send signals to others (F_SETOWN), hold up their opens
// (F_SETLEASE), type into terminals (TIOCSTI), and change attributes of files (FS_IOC_SETFLAGS).
void AllowDescriptorState(Filter& filter) {
  filter.AllowOneOf(SCMP_SYS(fcntl), 1,
                    {F_DUPFD, F_DUPFD_CLOEXEC, F_GETFD, F_SETFD, F_GETFL, F_SETFL, F_GETPIPE_SZ});
  filter.AllowOneOf(SCMP_SYS(ioctl), 1, {TCGETS, TIOCGWINSZ, FIONREAD, FIONBIO, FIOCLEX, FIONCLEX});
}

// Limits and turns of this process; 0 is who calls.
void AllowOwnLimits(Filter& filter, bool may_run_programs) {
  filter.AllowIf(SCMP_SYS(getpriority), {IntIs(0, PRIO_PROCESS), IntIs(1, 0)});
  filter.AllowIf(SCMP_SYS(setpriority), {IntIs(0, PRIO_PROCESS), IntIs(1, 0)});
  filter.AllowIf(SCMP_SYS(sched_setaffinity), {IntIs(0, 0)});
  filter.AllowOneOf(SCMP_SYS(prctl), 0,
                    {PR_SET_NAME, PR_GET_NAME, PR_GET_SECCOMP, PR_GET_DUMPABLE, PR_GET_NO_NEW_PRIVS,
                     PR_CAPBSET_READ, PR_SET_VMA});
  // Limits are read, or lowered for programs.
  const scmp_arg_cmp reads = SCMP_A2(SCMP_CMP_EQ, 0);
  if (may_run_programs) {
    filter.AllowIf(SCMP_SYS(prlimit64), {IntIs(0, 0)});
  } else {
    filter.AllowIf(SCMP_SYS(prlimit64), {IntIs(0, 0), reads});
  }
}

// Threads and signals within this process.
void AllowOneProcess(Filter& filter) {
  filter.AllowIf(SCMP_SYS(clone), {SCMP_A0(SCMP_CMP_MASKED_EQ, kSpaces | CLONE_THREAD, CLONE_THREAD)});
  for (const int call : {SCMP_SYS(kill), SCMP_SYS(tgkill)}) filter.AllowIf(call, {IntIs(0, getpid())});
}

// Also processes that it starts. Which numbers they will have is not known, so Landlock is what guards the
// others; those that are known best are denied here, too.
void AllowPrograms(Filter& filter) {
  filter.Allow(kPrograms);
  filter.Allow(kFurtherConfinement);
  filter.AllowIf(SCMP_SYS(clone), {SCMP_A0(SCMP_CMP_MASKED_EQ, kSpaces, 0)});
  // They stay in its group, so whoever ends that ends all of them.
  filter.Ignore(SCMP_SYS(setpgid));
  filter.AllowIf(SCMP_SYS(prctl), {IntIs(0, PR_SET_PDEATHSIG), SCMP_A1(SCMP_CMP_EQ, SIGKILL)});
  filter.AllowOneOf(SCMP_SYS(prctl), 0, {PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP});
  // Neither one process that it is not, nor all of a group or of the machine.
  const scmp_arg_cmp one = SCMP_A0(SCMP_CMP_MASKED_EQ, uint64_t{1} << 31, 0);
  for (const int call : {SCMP_SYS(kill), SCMP_SYS(tgkill)}) filter.AllowIf(call, {one});
  // Of pairs, which have no name. A datagram could be sent to any socket of the machine.
  filter.AllowIf(SCMP_SYS(socketpair),
                 {IntIs(0, AF_UNIX), SCMP_A1(SCMP_CMP_MASKED_EQ, kSocketType, SOCK_STREAM)});
  filter.AllowIf(SCMP_SYS(sendto), {SCMP_A4(SCMP_CMP_EQ, 0)});
}

}  // namespace

absl::Status AllowCallsOf(const CallNeeds& needs) {
  Filter filter(SCMP_ACT_ERRNO(EPERM));
  filter.Allow(kBytes);
  filter.Allow(kDescriptors);
  filter.Allow(kNames);
  filter.Allow(kMetadata);
  filter.Allow(kMemory);
  filter.Allow(kThreads);
  filter.Allow(kSignals);
  filter.Allow(kTime);
  filter.Allow(kWaiting);
  filter.Allow(kOwnNames);
  AllowOpening(filter);
  AllowDescriptorState(filter);
  AllowOwnLimits(filter, needs.may_run_programs);
  if (needs.may_run_programs) {
    AllowPrograms(filter);
  } else {
    AllowOneProcess(filter);
  }
#if WEFT_SANITIZED
  filter.Allow(kSanitizers);
#endif
  filter.LackFrom(kFirstLacked);
  return filter.Load();
}

absl::Status DenyCallsOnOthers() {
  Filter filter(SCMP_ACT_ALLOW);
  filter.Deny(kAttributes);
  filter.Deny(kLaterAttributes);
  filter.Deny(kOnOthers);
  filter.Deny(kByOtherWays);
  filter.Deny(kMounts);
  filter.Deny(kMachine);
  return filter.Load();
}

}  // namespace weft
