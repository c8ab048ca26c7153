// A terminal in the place of standard streams, for what a command does where somebody looks.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace weft {

class TestTerminal {
 public:
  // Stands for these streams until it goes.
  explicit TestTerminal(const std::vector<int>& streams) : outer_(posix_openpt(O_RDWR | O_NOCTTY)) {
    EXPECT_TRUE(outer_ >= 0 && grantpt(outer_) == 0 && unlockpt(outer_) == 0);
    const int inner = open(ptsname(outer_), O_RDWR | O_NOCTTY);
    EXPECT_GE(inner, 0);
    std::fflush(nullptr);
    for (const int stream : streams) {
      kept_.emplace_back(stream, dup(stream));
      dup2(inner, stream);
    }
    close(inner);
  }
  ~TestTerminal() {
    std::fflush(nullptr);
    for (const auto& [stream, before] : kept_) {
      dup2(before, stream);
      close(before);
    }
    close(outer_);
  }
  TestTerminal(const TestTerminal&) = delete;
  TestTerminal& operator=(const TestTerminal&) = delete;

  void Type(const std::string& line) const {
    EXPECT_EQ(write(outer_, line.data(), line.size()), static_cast<ssize_t>(line.size()));
  }
  // What was printed so far, with the terminal's ends of lines.
  std::string Shown() const {
    std::fflush(nullptr);
    std::string shown;
    for (pollfd ready = {outer_, POLLIN, 0}; poll(&ready, 1, 50) == 1 && (ready.revents & POLLIN) != 0;) {
      char bytes[4096];
      const ssize_t count = read(outer_, bytes, sizeof bytes);
      if (count <= 0) break;
      shown.append(bytes, static_cast<size_t>(count));
    }
    return shown;
  }

 private:
  const int outer_;
  std::vector<std::pair<int, int>> kept_;
};

}  // namespace weft
