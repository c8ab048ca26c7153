// Whether the inputs of a job are still what they were, by a look at their folders.
#pragma once

#include <sys/stat.h>

#include <ctime>
#include <string>
#include <vector>

namespace weft {

// Folders and files with their identity, size and times. Immutable.
class InputStamps {
 public:
  // Looks at the inputs that `spec` names by canonical paths. For images, at their folders alone: who adds,
  // removes or exchanges one changes its folder, and what it holds is read by workers.
  // `now_s`: by the clock of the file system.
  static InputStamps Take(const v1::RegistrationSpec& spec, time_t now_s);

  // Whether a change would be noticed. Not so where links lead elsewhere, and for what was written in the
  // last seconds: another change could carry the same time.
  bool conclusive() const { return conclusive_; }
  // Whether everything is as it was. A call of lstat per folder and file.
  bool StillHold() const;
  size_t count() const { return stamps_.size(); }

 private:
  explicit InputStamps(time_t now_s) : now_s_(now_s) {}

  struct Stamp {
    std::string path;
    struct stat info;
  };

  void Add(const std::string& path);
  void AddFolder(const std::string& folder, bool with_files, int depth);
  void AddFilesBeside(const std::string& json);

  const time_t now_s_;
  std::vector<Stamp> stamps_;
  bool conclusive_ = true;
};

}  // namespace weft
