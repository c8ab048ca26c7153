#include "services/tools/cli/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace weft {
namespace {

std::string ShortDuration(double seconds) {
  const auto s = static_cast<int64_t>(seconds + 0.5);
  if (s >= 3600) return absl::StrFormat("%d:%02d:%02d", s / 3600, s / 60 % 60, s % 60);
  return absl::StrFormat("%d:%02d", s / 60, s % 60);
}

bool as_lines = false;  // set once, before any progress

int TerminalWidth() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return 80;
}

}  // namespace

std::string ProgressLine(const std::string& label, uint64_t done, uint64_t total, double elapsed_s, int width,
                         ProgressUnit unit) {
  done = std::min(done, total);
  std::string tail = unit == ProgressUnit::kCount
                         ? absl::StrCat("  ", done, "/", total)
                         : absl::StrFormat("  %3d %%", total == 0 ? 100 : 100 * done / total);
  if (done > 0 && done < total) {
    const double left_s = elapsed_s / static_cast<double>(done) * static_cast<double>(total - done);
    absl::StrAppend(&tail, "  ", ShortDuration(left_s), " left");
  } else if (done == total) {
    absl::StrAppend(&tail, "  ", ShortDuration(elapsed_s));
  }
  const int space = width - static_cast<int>(label.size() + tail.size()) - 4;
  const int bar = std::min(space, 40);
  std::string line = label;
  if (bar >= 5) {
    const auto full = total == 0 ? bar : static_cast<int>(static_cast<double>(done) / total * bar);
    absl::StrAppend(&line, "  [", std::string(full, '#'), std::string(bar - full, '.'), "]");
  }
  line += tail;
  return line.substr(0, static_cast<size_t>(std::max(width, 0)));
}

void PrintProgressAsLines() { as_lines = true; }

bool ProgressVisible(bool quiet) { return !quiet && (as_lines || isatty(STDERR_FILENO) != 0); }

Progress::Progress(std::string label, uint64_t total, bool visible, ProgressUnit unit)
    : label_(std::move(label)), visible_(visible), unit_(unit), total_(total) {
  const MutexLock lock(mutex_);
  Draw(true);
}

Progress::~Progress() {
  const MutexLock lock(mutex_);
  Wipe();
}

void Progress::Advance(uint64_t steps) {
  const MutexLock lock(mutex_);
  done_ += steps;
  Draw(false);
}

void Progress::Set(uint64_t done, uint64_t total) {
  const MutexLock lock(mutex_);
  done_ = done;
  total_ = total;
  Draw(false);
}

void Progress::PrintLine(const std::string& text) {
  const MutexLock lock(mutex_);
  Wipe();
  std::fprintf(stderr, "%s\n", text.c_str());
  Draw(true);
}

void StageBars::Set(const std::string& stage, uint64_t done, uint64_t total, ProgressUnit unit) {
  const MutexLock lock(mutex_);
  if (!bar_ || stage != stage_) {
    bar_.reset();
    bar_.emplace(stage, total, visible_, unit);
    stage_ = stage;
  }
  bar_->Set(done, total);
}

void StageBars::SetShare(const std::string& stage, double share) {
  constexpr uint64_t kSteps = 1000;
  Set(stage, static_cast<uint64_t>(share * kSteps), kSteps, ProgressUnit::kPercent);
}

void StageBars::PrintLine(const std::string& text) {
  const MutexLock lock(mutex_);
  if (bar_) bar_->PrintLine(text);
}

void Progress::Draw(bool force) {
  if (!visible_) return;
  const auto now = std::chrono::steady_clock::now();
  if (!force && now - drawn_ < std::chrono::milliseconds(100)) return;
  drawn_ = now;
  if (as_lines) {
    std::fprintf(stderr, "weft: progress: %s: %llu of %llu\n", label_.c_str(),
                 static_cast<unsigned long long>(done_), static_cast<unsigned long long>(total_));
    return;
  }
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  std::fprintf(stderr, "\r\033[K%s",
               ProgressLine(label_, done_, total_, elapsed_s, TerminalWidth() - 1, unit_).c_str());
  std::fflush(stderr);
}

void Progress::Wipe() {
  if (visible_ && !as_lines) std::fprintf(stderr, "\r\033[K");
}

}  // namespace weft
