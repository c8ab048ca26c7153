// A program that was started, and what it says into files in memory and sockets.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <string>
#include <vector>

#include "services/ground/process/unique_fd.h"

namespace weft {

// Destroyed before Wait: the program is killed. Thread safety: none.
class SpawnedProgram {
 public:
  SpawnedProgram() = default;
  SpawnedProgram(SpawnedProgram&& other) noexcept;
  SpawnedProgram& operator=(SpawnedProgram&&) = delete;
  ~SpawnedProgram() { Kill(); }

  // `words` are the program, which is looked for in PATH where it has no slash, and its arguments.
  // `descriptors` are its 0, 1, 2 and so on, -1 for /dev/null; it has no others. `has_own_group`: Ctrl-C is
  // for us alone. 0, or errno.
  int Start(const std::vector<std::string>& words, const std::vector<int>& descriptors,
            bool has_own_group = false);
  // Waits for its end, and returns the status of waitpid.
  int Wait();
  // As waitpid with WNOHANG: 0 while it runs, negative where nothing is known of its end.
  int Poll(int* status);
  void Kill();

 private:
  pid_t pid_ = -1;
};

// A descriptor above those that Start places, which may otherwise cover each other. Closed: errno says why.
UniqueFd MemoryFile(const char* name);
size_t SizeOf(const UniqueFd& file);
// What was written to it.
std::string ContentOf(const UniqueFd& file);

// Two ends of a socket: other than with a pipe, writing to a program that has ended is an error and no
// signal. 0, or errno.
int MakeSocketPair(UniqueFd& ours, UniqueFd& theirs);
// As much as is asked for. 0; EPIPE: it ends before; ETIMEDOUT: nothing came for so long, where it is not -1.
int ReceiveAll(const UniqueFd& socket, void* bytes, size_t size, int timeout_ms = -1);

}  // namespace weft
