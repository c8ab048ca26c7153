// Which part of a take the options --frames and --shift choose.
#include "services/tools/cli/take_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

TEST(ParseTakeRange, TakesTheWholeTakeUnlessAsked) {
  const absl::StatusOr<TakeViewOptions> view = ParseTakeRange({});
  ASSERT_TRUE(view.ok());
  EXPECT_EQ(view->first_set, 0u);
  EXPECT_EQ(view->last_set, UINT64_MAX);
  EXPECT_TRUE(view->shift_ns.empty());
}

TEST(ParseTakeRange, EndsBeforeTheSecondNumber) {
  struct {
    const char* text;
    uint64_t first, last;
  } const cases[] = {
      {"10:20", 10, 19}, {":20", 0, 19}, {"10:", 10, UINT64_MAX - 1}, {"7:8", 7, 7}, {"12", 12, 12}};
  for (const auto& [text, first, last] : cases) {
    const absl::StatusOr<TakeViewOptions> view = ParseTakeRange({text, {}});
    ASSERT_TRUE(view.ok()) << view.status();
    EXPECT_EQ(view->first_set, first) << text;
    EXPECT_EQ(view->last_set, last) << text;
  }
}

TEST(ParseTakeRange, RefusesWhatIsNoRange) {
  for (const char* text : {"20:10", "10:10", ":0", "-1:5", "a:b", "1:2:3", "1.5:3"}) {
    const absl::StatusOr<TakeViewOptions> view = ParseTakeRange({text, {}});
    EXPECT_EQ(view.status().code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(view.status().message(), HasSubstr(std::string("--frames ") + text));
  }
}

TEST(ParseTakeRange, ReadsShiftsInMilliseconds) {
  const absl::StatusOr<TakeViewOptions> view = ParseTakeRange({"", {"left=2.5", "right=-0.000001"}});
  ASSERT_TRUE(view.ok()) << view.status();
  EXPECT_THAT(view->shift_ns, ElementsAre(Pair("left", 2'500'000), Pair("right", -1)));
}

TEST(ParseTakeRange, RefusesWhatIsNoShift) {
  for (const char* text : {"left", "left=", "left=soon", "left=nan", "left=inf", "=3", "left=1e13"}) {
    const absl::StatusOr<TakeViewOptions> view = ParseTakeRange({"", {text}});
    EXPECT_EQ(view.status().code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(view.status().message(), HasSubstr(std::string("--shift ") + text));
  }
}

// The second one would silently win.
TEST(ParseTakeRange, RefusesTwoShiftsOfOneCamera) {
  const absl::StatusOr<TakeViewOptions> view = ParseTakeRange({"", {"left=1", "left=2"}});
  EXPECT_EQ(view.status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
