// The folder of a take while it grows: frames appear complete, and a take that was stopped goes on.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace weft {

// Holds the folder for itself while it lives; what is unfinished then goes away. Movable.
class TakeFolder {
 public:
  // Makes the folder, or takes up one that was begun with the same recipe: a line that says all that the take
  // follows from, kept in <out>/recipe.txt. AlreadyExists when <out> holds anything else, or a take of
  // another recipe; Unavailable while another process writes to it.
  static absl::StatusOr<TakeFolder> Open(const std::string& out, const std::string& recipe);
  TakeFolder(TakeFolder&& other) noexcept;
  TakeFolder& operator=(TakeFolder&&) = delete;
  ~TakeFolder();

  const std::string& path() const { return path_; }
  static std::string NameOf(int frame);  // 0000, 0001 ...

  bool HasFrame(int frame) const;
  // Where the finished frame's truth stands: <out>/truth/<frame>.
  std::string TruthOf(int frame) const;

  // New folders for a frame's pictures and truth until KeepFrame puts both in place.
  struct Draft {
    std::string pictures, truth;
  };
  absl::StatusOr<Draft> BeginFrame(int frame) const;
  absl::Status KeepFrame(int frame) const;

  // <out>/truth/pictures.csv is the last to appear; of a take without pictures <out>/truth/frames.bin.
  std::string PicturesCsv() const;
  std::string FramesFile() const;
  bool IsComplete() const;

 private:
  TakeFolder(std::string path, int lock) : path_(std::move(path)), lock_(lock) {}
  std::string Unfinished() const;

  std::string path_;
  int lock_ = -1;
};

}  // namespace weft
