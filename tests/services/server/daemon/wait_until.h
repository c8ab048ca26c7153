// Patience with threads of the code under test.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace weft {

// Whether it becomes so within half a minute.
inline bool WaitUntil(const std::function<bool()>& is_so) {
  for (int look = 0; look < 3000; ++look) {
    if (is_so()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return is_so();
}

}  // namespace weft
