// SQLite on a disk whose writes and flushes fail, and whose power is cut: SQLite's default VFS as long as it
// lives.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace weft {

// Counts the operations that change a file: writes, flushes, truncations, removals. Only the files of one
// database are on this disk. What was not flushed may get lost, torn or reordered when the power is cut; what
// was written before a flush that failed as well (a kernel forgets it). Thread safety: none.
class CrashVfs {
 public:
  explicit CrashVfs(std::string database_path);
  ~CrashVfs();
  CrashVfs(const CrashVfs&) = delete;
  CrashVfs& operator=(const CrashVfs&) = delete;

  // Operations so far.
  int64_t operations() const { return operations_; }
  // Fails `count` operations, beginning with the n-th (from 1) since the last Forget, with SQLITE_FULL for
  // writes.
  void FailFrom(int64_t n, int64_t count);
  // Beginning with the n-th, the power is off: nothing reaches the disk.
  void CutPowerAt(int64_t n) { power_off_at_ = n; }
  bool power_is_off() const { return operations_ >= power_off_at_; }

  // Leaves the files as a power cut now might, and turns the power on again. All connections must be closed.
  void Crash(uint32_t seed);
  // Counts from 0, no faults, and all that is written is safe.
  void Forget();

  // For the VFS's functions.
  enum class Kind { kWrite, kSync, kTruncate, kDelete };
  struct Change {
    Kind kind = Kind::kWrite;
    int64_t offset = 0;  // or size
    std::string bytes;
  };
  bool IsOurs(const std::string& path) const;
  // The code with which the operation fails, 0 for none. A write that fails has reached the disk in part.
  int Begin(const std::string& path, Change change);
  void Opened(const std::string& path);

 private:
  // What of a file is safe, and what was done since.
  struct OnDisk {
    bool exists = false;
    std::string bytes;
    std::vector<Change> pending;
    // Removed, and the folder not flushed since: it may come back.
    std::optional<std::string> removed;
  };

  void Record(const std::string& path, Change change);
  void Settle(OnDisk& file);

  const std::string database_path_;
  std::map<std::string, OnDisk> files_;
  int64_t operations_ = 0;
  int64_t fail_from_ = 0, fail_until_ = 0;
  int64_t power_off_at_ = INT64_MAX;
  std::mt19937 random_{1};
};

}  // namespace weft
