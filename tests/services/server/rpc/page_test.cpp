// Where pages of lists end.
#include "services/server/rpc/page.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(PageTest, EndsAfterSoManyEntries) {
  Page page(2);
  EXPECT_TRUE(page.Add(10));
  EXPECT_TRUE(page.Add(10));
  EXPECT_FALSE(page.Add(10));
}

TEST(PageTest, EndsBeforeItIsTooLargeForAMessage) {
  Page page(0);
  size_t bytes = 0;
  while (page.Add(1000)) bytes += 1000;
  EXPECT_LT(bytes, size_t{4} << 20);
  EXPECT_GT(bytes, size_t{2} << 20);
}

TEST(PageTest, HasOneEntryHoweverLarge) {
  Page page(0);
  EXPECT_TRUE(page.Add(size_t{10} << 20));
  EXPECT_FALSE(page.Add(0));
}

}  // namespace
}  // namespace weft
