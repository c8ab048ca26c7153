#include "services/server/catalogue/sqlite.h"

#include <gtest/gtest.h>

#include <filesystem>
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

TEST_F(SqliteTest, IsOneProcesssAndSaysSo) {
  const std::string path = folder_ / "data.sqlite";
  EXPECT_EQ(Database::Open(path).status(),
            absl::FailedPreconditionError(
                path + ": in use by another weftd; stop that one, or give another --state folder"));
  EXPECT_EQ(
      Database::Open(folder_.path()).status(),
      absl::PermissionDeniedError(folder_.path() + ": cannot be opened for writing (unable to open database "
                                                   "file); check the folder's permissions"));
  EXPECT_EQ(database_->path(), path);
  EXPECT_TRUE(database_->CheckIntegrity().ok());
}

TEST_F(SqliteTest, ParametersThatAreNoneAreErrors) {
  auto insert = database_->Prepare("INSERT INTO things VALUES (?, ?)");
  ASSERT_TRUE(insert.ok());
  EXPECT_EQ(insert->Bind(3, int64_t{7}).Run(),
            absl::InternalError(folder_ / "data.sqlite" +
                                ": a parameter cannot be bound to INSERT INTO things VALUES (?, ?)"));
  EXPECT_EQ(insert->BindText(3, "x").Step().status().code(), absl::StatusCode::kInternal);
  insert->Reset();
  EXPECT_EQ(insert->BindBytes(3, "x").Step().status().code(), absl::StatusCode::kInternal);
  insert->Reset();
  EXPECT_EQ(Count(), 0);
  EXPECT_TRUE(insert->Bind(1, int64_t{7}).BindBytes(2, std::string("a\0b", 3)).Run().ok());
  EXPECT_TRUE(insert->Run().ok());  // nothing is left of the first ones
  EXPECT_EQ(*database_->ReadNumber("SELECT COUNT(*) FROM things WHERE number IS NULL AND name IS NULL"), 1);
  EXPECT_EQ(*database_->ReadNumber("SELECT length(name) FROM things WHERE number = 7"), 3);
  EXPECT_EQ(*database_->ReadNumber("SELECT number FROM things WHERE number = 8"), 0);
  ASSERT_TRUE(database_->Execute("DELETE FROM things").ok());
  EXPECT_EQ(database_->ChangedRows(), 2);
  EXPECT_EQ(database_->Prepare("SELECT * FROM nothing").status().code(), absl::StatusCode::kInternal);
  EXPECT_EQ(database_->ReadNumber("no SQL").status().code(), absl::StatusCode::kInternal);
}

TEST(SqliteFiles, AreRemovedWithWhatStandsBeside) {
  const TempFolder folder;
  for (const char* name : {"a", "a-wal", "a-shm", "a-journal", "a.lock"}) WriteBytes(folder / name, "x");
  RemoveDatabase(folder / "a");
  std::string left;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
    left += entry.path().filename().string() + " ";
  EXPECT_EQ(left, "a.lock ");
}

TEST(SqliteFiles, ThatAreDamagedSayWhere) {
  const TempFolder folder;
  WriteBytes(folder / "text", std::string(8192, 'x'));
  EXPECT_EQ(
      Database::Open(folder / "text").status(),
      absl::DataLossError(folder / "text" +
                          ": damaged (file is not a database); start weftd again: it keeps this file aside, "
                          "makes a new one from the records of the jobs, and loses no results"));
}

}  // namespace
}  // namespace weft
