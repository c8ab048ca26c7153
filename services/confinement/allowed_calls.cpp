#include "services/confinement/denied_calls.h"

#include <linux/sched.h>
#include <seccomp.h>

#include <cerrno>
#include <cstring>
#include <initializer_list>
#include <memory>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

// Other processes, the kernel, its devices, and io_uring, which makes calls past every filter.
constexpr int kNever[] = {SCMP_SYS(process_vm_readv),
                          SCMP_SYS(process_vm_writev),
                          SCMP_SYS(process_madvise),
                          SCMP_SYS(pidfd_getfd),
                          SCMP_SYS(kcmp),
                          SCMP_SYS(userfaultfd),
                          SCMP_SYS(perf_event_open),
                          SCMP_SYS(bpf),
                          SCMP_SYS(io_uring_setup),
                          SCMP_SYS(io_uring_enter),
                          SCMP_SYS(io_uring_register),
                          SCMP_SYS(add_key),
                          SCMP_SYS(keyctl),
                          SCMP_SYS(request_key),
                          SCMP_SYS(mount),
                          SCMP_SYS(umount2),
                          SCMP_SYS(move_mount),
                          SCMP_SYS(open_tree),
                          SCMP_SYS(mount_setattr),
                          SCMP_SYS(fsopen),
                          SCMP_SYS(fsconfig),
                          SCMP_SYS(fsmount),
                          SCMP_SYS(fspick),
                          SCMP_SYS(pivot_root),
                          SCMP_SYS(chroot),
                          SCMP_SYS(setns),
                          SCMP_SYS(unshare),
                          SCMP_SYS(open_by_handle_at),
                          SCMP_SYS(kexec_load),
                          SCMP_SYS(kexec_file_load),
                          SCMP_SYS(init_module),
                          SCMP_SYS(finit_module),
                          SCMP_SYS(delete_module),
                          SCMP_SYS(reboot),
                          SCMP_SYS(swapon),
                          SCMP_SYS(swapoff),
                          SCMP_SYS(acct),
                          SCMP_SYS(quotactl),
                          SCMP_SYS(syslog),
                          SCMP_SYS(settimeofday),
                          SCMP_SYS(clock_settime),
                          SCMP_SYS(clock_adjtime),
                          SCMP_SYS(adjtimex),
                          SCMP_SYS(iopl),
                          SCMP_SYS(ioperm)};

class Filter {
 public:
  Filter() : context_(seccomp_init(SCMP_ACT_ALLOW), &seccomp_release) {
    if (!context_) error_ = -ENOMEM;
    // Privileges are given up by whoever confines the process, also for its files.
    if (context_) Note(seccomp_attr_set(context_.get(), SCMP_FLTATR_CTL_NNP, 1));
  }

  void Deny(int call, int answer = EPERM) {
    // A call that this machine does not have needs no rule.
    if (error_ == 0 && call >= 0) Note(seccomp_rule_add(context_.get(), SCMP_ACT_ERRNO(answer), call, 0));
  }
  void DenyFlag(int call, uint64_t flag) {
    if (error_ == 0) {
      Note(seccomp_rule_add(context_.get(), SCMP_ACT_ERRNO(EPERM), call, 1,
                            SCMP_A0(SCMP_CMP_MASKED_EQ, flag, flag)));
    }
  }
  // 0, or a negative errno.
  int Load() {
    if (error_ == 0) Note(seccomp_load(context_.get()));
    return error_;
  }

 private:
  void Note(int error) {
    if (error_ == 0) error_ = error;
  }

  std::unique_ptr<void, void (*)(scmp_filter_ctx)> context_;
  int error_ = 0;
};

}  // namespace

absl::Status DenyCalls(const CallNeeds& limits) {
  Filter filter;
  for (const int call : kNever) filter.Deny(call);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  filter.Deny(SCMP_SYS(ptrace));
#endif
  // Its flags lie in memory, where a filter cannot look: glibc then uses clone.
  filter.Deny(SCMP_SYS(clone3), ENOSYS);
  for (const uint64_t space : {CLONE_NEWUSER, CLONE_NEWNS, CLONE_NEWNET, CLONE_NEWPID, CLONE_NEWIPC,
                               CLONE_NEWUTS, CLONE_NEWCGROUP}) {
    filter.DenyFlag(SCMP_SYS(clone), space);
  }
  if (!limits.may_run_programs) {
    for (const int call : {SCMP_SYS(execve), SCMP_SYS(execveat)}) filter.Deny(call);
  }
  if (!limits.may_use_sockets) {
    // Also of AF_UNIX: the daemon's own socket takes its user for the operator.
    for (const int call : {SCMP_SYS(socket), SCMP_SYS(connect), SCMP_SYS(bind), SCMP_SYS(listen)})
      filter.Deny(call);
  }
  if (const int error = filter.Load(); error != 0) {
    return absl::UnavailableError(
        absl::StrCat("seccomp, which confines this process: ", std::strerror(-error)));
  }
  return absl::OkStatus();
}

}  // namespace weft
