// Where pages of lists end.
#include "services/server/rpc/page.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "weft/v1/operations.pb.h"

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

TEST(PageTest, PagesGoOnBehindTheLastPlaceAlsoWhereItIsGone) {
  std::map<std::string, std::string, std::greater<>> newest_first;
  for (const int64_t age : {9, 10, 11}) newest_first[PlaceByAge(age, "id")] = std::to_string(age);
  const auto show = [](const std::string& path) {
    v1::OperationFile file;
    file.set_path(path);
    return file;
  };
  v1::ListOperationFilesResponse response;
  const std::string token = AddPage(newest_first, 2, "", show, response.mutable_files());
  ASSERT_EQ(response.files_size(), 2);
  EXPECT_EQ(response.files(0).path(), "11");
  EXPECT_EQ(response.files(1).path(), "10");
  EXPECT_EQ(token, PlaceByAge(10, "id"));
  newest_first.erase(token);
  EXPECT_EQ(AddPage(newest_first, 2, token, show, response.mutable_files()), "");
  ASSERT_EQ(response.files_size(), 3);
  EXPECT_EQ(response.files(2).path(), "9");
}

}  // namespace
}  // namespace weft
