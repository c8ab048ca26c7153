#include "services/formats/verdict/grey_levels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/verdict/limits.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

v1::Verdict Of(const std::vector<PrintContrast>& pictures) {
  v1::Verdict verdict;
  AddGreyLevelsCheck(verdict, pictures);
  return verdict;
}

TEST(GreyLevelsCheck, TheDarkestCameraCounts) {
  EXPECT_EQ(Of({{"a", 150}, {"b", kDecodeGreyLevels.good}}).grade(), v1::GRADE_GOOD);
  const v1::Verdict one = Of({{"a", 150}, {"b", 20}, {"c", 160}});
  EXPECT_EQ(one.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(one.reason(),
              AllOf(HasSubstr("b is dark"), HasSubstr("spans 20 grey levels"), Not(HasSubstr("more"))));
  EXPECT_EQ(one.remedy(), std::string(kDecodeGreyLevels.remedy));
  const v1::Verdict two = Of({{"a", 20}, {"b", 3}, {"c", 160}});
  EXPECT_EQ(two.grade(), v1::GRADE_BAD);
  EXPECT_THAT(two.reason(), AllOf(HasSubstr("b is dark"), HasSubstr("1 more")));
}

TEST(GreyLevelsCheck, PicturesWithoutPrintSayNothing) {
  EXPECT_EQ(Of({{"a", 0}}).checks_size(), 0);
  EXPECT_EQ(Of({{"a", 0}, {"b", 100}}).grade(), v1::GRADE_GOOD);
}

}  // namespace
}  // namespace weft
