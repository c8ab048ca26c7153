// Owns a file descriptor.
#pragma once

#include <unistd.h>

namespace weft {

class UniqueFd {
 public:
  UniqueFd() = default;
  explicit UniqueFd(int fd) : fd_(fd) {}
  UniqueFd(UniqueFd&& other) noexcept : fd_(other.Release()) {}
  UniqueFd& operator=(UniqueFd&& other) noexcept {
    if (this != &other) {
      Close();
      fd_ = other.Release();
    }
    return *this;
  }
  ~UniqueFd() { Close(); }

  int get() const { return fd_; }
  bool open() const { return fd_ >= 0; }
  int Release() {
    const int fd = fd_;
    fd_ = -1;
    return fd;
  }
  // What close() answers; 0 where none is open.
  int Close() {
    const int fd = Release();
    return fd >= 0 ? close(fd) : 0;
  }

 private:
  int fd_ = -1;
};

}  // namespace weft
