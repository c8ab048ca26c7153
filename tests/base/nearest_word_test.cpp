#include "base/nearest_word.h"

#include <gtest/gtest.h>

#include <vector>

namespace weft {
namespace {

TEST(EditDistance, CountsLettersAndExchangesOfNeighbours) {
  EXPECT_EQ(EditDistance("", "abc"), 3u);
  EXPECT_EQ(EditDistance("best", "best"), 0u);
  EXPECT_EQ(EditDistance("bset", "best"), 1u);
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3u);
  EXPECT_EQ(EditDistance("ca", "abc"), 3u);  // an exchange and what stands between would be 2
}

TEST(NearestWord, KnowsSlipsAndBeginnings) {
  const std::vector<std::string> names = {"register", "rig", "session", "quickstart", "y", "z"};
  EXPECT_EQ(NearestWord("regsiter", names), "register");
  EXPECT_EQ(NearestWord("sesion", names), "session");
  EXPECT_EQ(NearestWord("quick", names), "quickstart");
  EXPECT_EQ(NearestWord("rg", names), "rig");
  EXPECT_EQ(NearestWord("banana", names), "");
  EXPECT_EQ(NearestWord("", std::vector<std::string>{"abc"}), "");
  EXPECT_EQ(DidYouMean("rigs", names), "; did you mean rig?");
  EXPECT_EQ(DidYouMean("banana", names), "");
}

}  // namespace
}  // namespace weft
