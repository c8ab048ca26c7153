// A child process with pipes from its standard output and error.
#pragma once

#include <signal.h>
#include <sys/types.h>

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"
#include "services/work/executor/process_record.h"

namespace weft {

// The lines of a stream that arrives in pieces. A line longer than kMaxLineBytes is cut.
class LineSplitter {
 public:
  static constexpr size_t kMaxLineBytes = size_t{1} << 20;

  // The lines that `bytes` completes, without their ends.
  std::vector<std::string> Add(std::string_view bytes);
  // What stands after the last line end; empties it.
  std::string TakeRest();

 private:
  std::string rest_;
  bool cutting_ = false;  // drops bytes up to the next line end
};

struct ChildSettings {
  std::string folder;         // where it starts; empty: in ours
  std::string input;          // a file that it reads as its standard input; empty: nothing
  std::string record_folder;  // its record lies there until it is reaped (process_record.h); empty: none
  // Of a program that reads the files of others: it gets no secrets of our environment (child_environment.h).
  bool hides_secrets = false;
};

// The process runs in a process group of its own, sees no other descriptor of this one but the pipes, and
// reads no standard input but ChildSettings.input. Destroyed: the group is killed and the process reaped.
class ChildProcess {
 public:
  // `arguments` after the program's path. The parent that PR_SET_PDEATHSIG watches is the calling thread.
  // NotFound, PermissionDenied or ResourceExhausted; the message names the program. Errors of ProcessRecord.
  static absl::StatusOr<ChildProcess> Spawn(const std::string& program,
                                            const std::vector<std::string>& arguments,
                                            const ChildSettings& child_settings = {});
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess();

  pid_t pid() const { return pid_; }
  // Descriptors to poll, both non-blocking; -1 once at their end.
  int out_fd() const { return out_.get(); }
  int err_fd() const { return err_.get(); }
  // Readable when the process has ended.
  int exit_fd() const { return exit_.get(); }

  // What can be read now without waiting; closes the descriptor at its end.
  std::string ReadOut() { return ReadAvailable(out_); }
  std::string ReadErr() { return ReadAvailable(err_); }

  // To the process and what it started.
  void Signal(int signal) const;
  // Call once exit_fd is readable. Ends what the process left running, and returns the status of waitpid.
  int Reap();

 private:
  ChildProcess() = default;
  static std::string ReadAvailable(UniqueFd& fd);

  pid_t pid_ = -1;
  UniqueFd out_, err_, exit_;
  ProcessRecord record_;
};

}  // namespace weft
