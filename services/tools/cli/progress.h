// Progress bars of long commands.
#pragma once

#include <tbb/task_arena.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "base/mutex.h"

namespace weft {

// Format of the done part: "12/24" or "50 %".
enum class ProgressUnit { kCount, kPercent };

// One line such as "decode  [#####.....]  12/24  0:05 left", at most `width` characters. `elapsed_s` since
// the start; no remaining time before the first step is done.
std::string ProgressLine(const std::string& label, uint64_t done, uint64_t total, double elapsed_s, int width,
                         ProgressUnit unit = ProgressUnit::kCount);

// True when progress should be drawn: stderr is a terminal, or a program watches, and the command is not
// quiet.
bool ProgressVisible(bool quiet);

// From now on progress is lines for a program that watches: "weft: progress: decode: 12 of 24".
void PrintProgressAsLines();

// Draws itself on stderr, at most ten times a second, and wipes itself when it goes out of scope. Draws
// nothing when `visible` is false. Thread safety: any thread may call any function.
class Progress {
 public:
  Progress(std::string label, uint64_t total, bool visible, ProgressUnit unit = ProgressUnit::kCount);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void Advance(uint64_t steps = 1);
  void Set(uint64_t done, uint64_t total);
  // Prints a line above the bar, also when the bar is invisible.
  void PrintLine(const std::string& text);

 private:
  void Draw(bool force) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Wipe() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::string label_;
  const bool visible_;
  const ProgressUnit unit_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  Mutex mutex_;
  uint64_t done_ ABSL_GUARDED_BY(mutex_) = 0;
  uint64_t total_ ABSL_GUARDED_BY(mutex_) = 0;
  std::chrono::steady_clock::time_point drawn_ ABSL_GUARDED_BY(mutex_);
};

// A bar for each stage of a command: that of a stage appears with its first step, and goes when the next
// stage begins. Thread safety: any thread may call any function.
class StageBars {
 public:
  explicit StageBars(bool quiet) : visible_(ProgressVisible(quiet)) {}

  void Set(const std::string& stage, uint64_t done, uint64_t total, ProgressUnit unit = ProgressUnit::kCount);
  // Of a stage that knows no steps.
  void SetShare(const std::string& stage, double share);
  // Above the bar.
  void PrintLine(const std::string& text);

 private:
  const bool visible_;
  Mutex mutex_;
  std::string stage_ ABSL_GUARDED_BY(mutex_);
  std::optional<Progress> bar_ ABSL_GUARDED_BY(mutex_);
};

// What `work` returns, which runs with so many threads, 0 for all cores, under a bar. It is given what tells
// the bar of the steps done and of all.
template <typename Work>
auto WithBar(const std::string& label, bool quiet, int threads, Work work) {
  Progress progress(label, 1, ProgressVisible(quiet));
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  return arena.execute(
      [&] { return work([&progress](size_t done, size_t all) { progress.Set(done, all); }); });
}

// The same of work that has stages.
template <typename Work>
auto WithStageBars(bool quiet, int threads, Work work) {
  StageBars bars(quiet);
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  return arena.execute([&] { return work(bars); });
}

// The same of work that tells the share that is done.
template <typename Work>
auto WithShareBar(const std::string& label, bool quiet, int threads, Work work) {
  return WithStageBars(quiet, threads, [&](StageBars& bars) {
    return work([&](double share) { bars.SetShare(label, share); });
  });
}

}  // namespace weft
