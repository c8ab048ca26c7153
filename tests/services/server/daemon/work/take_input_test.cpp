#include "services/server/daemon/work/take_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/server/rpc/error_detail.h"

namespace weft {
namespace {

TEST(TakeInput, OfANameIsTheTakesFolder) {
  EXPECT_EQ(*TakeOfName("/state/takes", "take:20260101-120000-1"), "/state/takes/20260101-120000-1/take");
}

TEST(TakeInput, OfAPathIsThePath) {
  for (const char* path : {"/data/take", "library:jump", "", "a take:b"})
    EXPECT_EQ(*TakeOfName("/state/takes", path), path);
}

// A name must not lead out of the folder of takes.
TEST(TakeInput, RefusesWhatIsNoId) {
  for (const char* name : {"take:", "take:..", "take:../secret", "take:a/b", "take:a b"}) {
    const absl::Status status = TakeOfName("/state/takes", name).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << name;
    ASSERT_TRUE(DetailOf(status)) << name;
    EXPECT_EQ(DetailOf(status)->field(), "take_id");
  }
}

}  // namespace
}  // namespace weft
