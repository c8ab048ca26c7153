#include "services/studio/video/at_once.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

namespace weft {
namespace {

TEST(ForEachAtOnce, DoesEachOnce) {
  for (const size_t threads : {1, 3, 50}) {
    std::vector<std::atomic<int>> done(20);
    EXPECT_TRUE(ForEachAtOnce(done.size(), threads, [&](size_t i) {
                  ++done[i];
                  return absl::OkStatus();
                }).ok());
    for (const auto& times : done) EXPECT_EQ(times.load(), 1);
  }
}

TEST(ForEachAtOnce, LeavesTheRestUndoneAfterAnError) {
  std::vector<size_t> done;
  const absl::Status status = ForEachAtOnce(100, 1, [&](size_t i) {
    done.push_back(i);
    return i == 2 ? absl::DataLossError("third") : absl::OkStatus();
  });
  EXPECT_EQ(status.message(), "third");
  EXPECT_EQ(done, (std::vector<size_t>{0, 1, 2}));
}

TEST(ForEachAtOnce, OfNothingIsDone) {
  EXPECT_TRUE(ForEachAtOnce(0, 4, [](size_t) { return absl::InternalError("asked"); }).ok());
}

}  // namespace
}  // namespace weft
