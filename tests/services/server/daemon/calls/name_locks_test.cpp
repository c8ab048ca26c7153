#include "services/server/daemon/calls/name_locks.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <thread>

namespace weft {
namespace {

TEST(NameLocks, OfTheEmptyNameIsNone) {
  NameLocks locks;
  EXPECT_EQ(locks.Lock(""), nullptr);
  EXPECT_EQ(locks.Lock(""), nullptr);
}

TEST(NameLocks, AreForOneNameEach) {
  NameLocks locks;
  const auto a = locks.Lock("a");
  EXPECT_NE(a, nullptr);
  EXPECT_NE(locks.Lock("b"), nullptr);
}

TEST(NameLocks, KeepOthersOutAsLongAsTheyLive) {
  NameLocks locks;
  auto held = locks.Lock("a");
  std::atomic<bool> released = false;
  auto other = std::async(std::launch::async, [&] {
    const auto mine = locks.Lock("a");
    return released.load();
  });
  EXPECT_EQ(other.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  released = true;
  held.reset();
  EXPECT_TRUE(other.get());
}

TEST(NameLocks, AreTakenAgainAfterTheirEnd) {
  NameLocks locks;
  EXPECT_NE(locks.Lock("a"), nullptr);
  EXPECT_NE(locks.Lock("a"), nullptr);
}

}  // namespace
}  // namespace weft
