#include "nets/tensor.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace weft {
namespace {

const std::vector<NamedShape>& TwoInputs() {
  static const std::vector<NamedShape> inputs = {{"b", {3}}, {"a", {1, 8, kAnySize}}};
  return inputs;
}

std::string RefusalOfInputs(const std::map<std::string, TensorShape>& given) {
  return std::string(CheckInputs(TwoInputs(), given).message());
}

TEST(Tensor, ItsShapeIsThatOfItsSides) {
  EXPECT_EQ((Tensor{2, 3, 4, {}}.shape()), (TensorShape{2, 3, 4}));
  EXPECT_FALSE((TensorShape{2, 3, 4}) == (TensorShape{2, 4, 3}));
}

TEST(Tensor, ShapesAreDescribedInOrder) {
  EXPECT_EQ(Describe(TensorShape{27, kAnySize, 5}), "27 x any x 5");
  EXPECT_EQ(Describe(TwoInputs()), "\"b\" of 3 x any x any, \"a\" of 1 x 8 x any");
}

TEST(CheckInputs, TakesShapesThatFit) {
  EXPECT_EQ(RefusalOfInputs({{"a", {1, 8, 2}}, {"b", {3, 1, 1}}}), "");
  EXPECT_EQ(RefusalOfInputs({{"a", {1, 8, 9}}, {"b", {3, 7, 5}}}), "");
}

TEST(CheckInputs, SaysWhatIsExpected) {
  EXPECT_EQ(RefusalOfInputs({{"b", {3, 7, 5}}}), "takes \"a\" of 1 x 8 x any, which is missing");
  EXPECT_EQ(RefusalOfInputs({{"a", {1, 8, 2}}, {"b", {3, 1, 1}}, {"c", {3, 1, 1}}}),
            "has no input \"c\"; it takes \"b\" of 3 x any x any, \"a\" of 1 x 8 x any");
  EXPECT_EQ(RefusalOfInputs({{"a", {1, 9, 2}}, {"b", {3, 1, 1}}}),
            "takes \"a\" of 1 x 8 x any, and this one is of 1 x 9 x 2");
  EXPECT_EQ(RefusalOfInputs({{"a", {1, 8, 2}}, {"b", {2, 1, 1}}}),
            "takes \"b\" of 3 x any x any, and this one is of 2 x 1 x 1");
}

}  // namespace
}  // namespace weft
