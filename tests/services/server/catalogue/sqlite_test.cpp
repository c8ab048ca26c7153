#include "services/server/catalogue/sqlite.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

class SqliteTest : public ::testing::Test {
 protected:
  SqliteTest() {
    auto opened = Database::Open(folder_ / "data.sqlite");
    EXPECT_TRUE(opened.ok()) << opened.status();
    database_ = *std::move(opened);
    EXPECT_TRUE(database_->Execute("CREATE TABLE things (number INTEGER, name TEXT)").ok());
  }
  int64_t Count() { return *database_->ReadNumber("SELECT COUNT(*) FROM things"); }

  TempFolder folder_;
  std::unique_ptr<Database> database_;
};

TEST_F(SqliteTest, StatementsRunAgain) {
  auto insert = database_->Prepare("INSERT INTO things VALUES (?, ?)");
  ASSERT_TRUE(insert.ok()) << insert.status();
  EXPECT_TRUE(insert->Bind(1, int64_t{7}).BindText(2, "it's").Run().ok());
  EXPECT_TRUE(insert->Bind(1, int64_t{8}).BindText(2, std::string("a\0b", 3)).Run().ok());
  auto select = database_->Prepare("SELECT number, name FROM things ORDER BY number");
  ASSERT_TRUE(select.ok());
  ASSERT_TRUE(*select->Step());
  EXPECT_EQ(select->Int(0), 7);
  EXPECT_EQ(select->Bytes(1), "it's");
  ASSERT_TRUE(*select->Step());
  EXPECT_EQ(select->Bytes(1), std::string("a\0b", 3));
  EXPECT_FALSE(*select->Step());
}

TEST_F(SqliteTest, TransactionsWithoutCommitChangeNothing) {
  {
    Transaction transaction(*database_);
    ASSERT_TRUE(transaction.Begin().ok());
    ASSERT_TRUE(database_->Execute("INSERT INTO things VALUES (1, 'a')").ok());
  }
  EXPECT_EQ(Count(), 0);
  {
    Transaction transaction(*database_);
    ASSERT_TRUE(transaction.Begin().ok());
    ASSERT_TRUE(database_->Execute("INSERT INTO things VALUES (1, 'a')").ok());
    ASSERT_TRUE(transaction.Commit().ok());
  }
  EXPECT_EQ(Count(), 1);
}

TEST_F(SqliteTest, NamesTheFileOfAnError) {
  const absl::Status status = database_->Execute("no SQL");
  EXPECT_FALSE(status.ok());
  EXPECT_NE(std::string(status.message()).find(folder_ / "data.sqlite"), std::string::npos) << status;
}

TEST(SqliteFiles, ThatAreNoDatabaseAreDamaged) {
  const TempFolder folder;
  WriteBytes(folder / "text", std::string(8192, 'x'));
  EXPECT_EQ(Database::Open(folder / "text").status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace weft
