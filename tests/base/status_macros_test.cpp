#include "base/status_macros.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace weft {
namespace {

absl::StatusOr<int> Half(int number) {
  if (number % 2 != 0) return absl::InvalidArgumentError("odd");
  return number / 2;
}

absl::StatusOr<std::string> Quarter(int number, int* steps) {
  WEFT_ASSIGN_OR_RETURN(int left, Half(number));
  ++*steps;
  WEFT_ASSIGN_OR_RETURN(left, Half(left));
  ++*steps;
  return std::to_string(left);
}

absl::Status IsEven(int number) { return Half(number).status(); }

absl::StatusOr<std::unique_ptr<int>> EvenPair(int first, int second) {
  if (first != 0) WEFT_RETURN_IF_ERROR(IsEven(first));
  WEFT_RETURN_IF_ERROR(IsEven(second));
  return std::make_unique<int>(first + second);
}

TEST(StatusMacros, AssignWhatThereIs) {
  int steps = 0;
  EXPECT_EQ(*Quarter(12, &steps), "3");
  EXPECT_EQ(steps, 2);
}

TEST(StatusMacros, ReturnTheFirstErrorAndDoNoMore) {
  int steps = 0;
  EXPECT_EQ(Quarter(6, &steps).status(), absl::InvalidArgumentError("odd"));
  EXPECT_EQ(steps, 1);
  EXPECT_EQ(EvenPair(1, 2).status(), absl::InvalidArgumentError("odd"));
  EXPECT_EQ(EvenPair(2, 1).status(), absl::InvalidArgumentError("odd"));
}

TEST(StatusMacros, MoveWhatCannotBeCopied) {
  const auto sum = [](int first) -> absl::StatusOr<int> {
    WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<int> pair, EvenPair(first, 4));
    return *pair;
  };
  EXPECT_EQ(*sum(2), 6);
  EXPECT_EQ(*sum(0), 4);
  EXPECT_FALSE(sum(3).ok());
}

}  // namespace
}  // namespace weft
