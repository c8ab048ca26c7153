#include "services/server/callers/turn_gate.h"

#include <gmock/gmock.h>

#include <atomic>
#include <future>
#include <latch>
#include <optional>
#include <thread>

namespace weft {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;

TEST(TurnGate, LetsSoManyInAtOnce) {
  TurnGate gate(2, 2);
  std::atomic<int> inside = 0, most = 0;
  std::vector<std::jthread> threads;
  for (int i = 0; i < 20; ++i) {
    threads.emplace_back([&, i] {
      const TurnGate::Pass pass = gate.Enter("user " + std::to_string(i % 3));
      most = std::max<int>(most, ++inside);
      std::this_thread::sleep_for(milliseconds(2));
      --inside;
    });
  }
  threads.clear();
  EXPECT_EQ(inside, 0);
  EXPECT_EQ(most, 2);
}

// Five slow calls of one caller leave a place for another.
TEST(TurnGate, OneCallerDoesNotTakeAllPlaces) {
  TurnGate gate(2, 1);
  std::promise<void> over;
  const std::shared_future<void> end = over.get_future().share();
  std::vector<std::jthread> slow;
  std::atomic<int> inside = 0;
  for (int i = 0; i < 5; ++i) {
    slow.emplace_back([&] {
      const TurnGate::Pass pass = gate.Enter("user mallory");
      ++inside;
      end.wait();
    });
  }
  while (inside == 0) std::this_thread::yield();
  for (int i = 0; i < 3; ++i) const TurnGate::Pass pass = gate.Enter("user anna");
  EXPECT_EQ(inside, 1);
  over.set_value();
  slow.clear();
  EXPECT_EQ(inside, 5);
}

// Tokens of one name are one account.
TEST(TurnGate, ManyTokensAreOneCaller) {
  TurnGate gate(2, 1);
  std::optional<std::jthread> second;
  std::atomic<bool> entered = false;
  {
    const TurnGate::Pass first = gate.Enter("token 0a1b2c3d4e5f (mallory)");
    second.emplace([&] {
      const TurnGate::Pass pass = gate.Enter("token 1a1b2c3d4e5f (mallory)");
      entered = true;
    });
    std::this_thread::sleep_for(milliseconds(50));
    EXPECT_FALSE(entered);
  }
  second.reset();
  EXPECT_TRUE(entered);
}

TEST(TurnGate, WhoHasHadLeastIsNext) {
  TurnGate gate(1, 1);
  std::vector<std::string> order;
  std::vector<std::jthread> threads;
  const auto wait = [&](const std::string& caller) {
    threads.emplace_back([&gate, &order, caller] {
      const TurnGate::Pass pass = gate.Enter(caller);
      order.push_back(caller);
    });
    std::this_thread::sleep_for(milliseconds(50));
  };
  {
    const TurnGate::Pass busy = gate.Enter("user mallory");
    wait("user mallory");
    wait("user mallory");
    wait("user anna");
  }
  threads.clear();
  EXPECT_THAT(order, ElementsAre("user anna", "user mallory", "user mallory"));
}

}  // namespace
}  // namespace weft
