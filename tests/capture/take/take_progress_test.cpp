#include "capture/take/take_progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/take/take_files.h"
#include "capture/take/take_writer.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

RawFrameSet WithoutFrames(uint64_t number) {
  RawFrameSet set;
  set.number = number;
  set.missing = {{"cam1", "no light"}};
  return set;
}

TEST(TakeProgress, GrowsWithTheTakeUntilItIsClosed) {
  const TempFolder temp;
  const std::string folder = temp / "take";
  EXPECT_EQ(ReadTakeProgress(folder).status().code(), absl::StatusCode::kNotFound);
  const auto writer = TakeWriter::Create(folder, {"cam1"}, {});
  ASSERT_TRUE(writer.ok()) << writer.status();
  EXPECT_TRUE(ReadTakeProgress(folder)->sets.empty());

  std::vector<LedgerEntry> entries = EntriesOfRecorded(WithoutFrames(3), 1000);
  entries.push_back({LedgerEvent::kDropped, 4, 6, 0, 0, "", "queue full"});
  ASSERT_TRUE((*writer)->Append(0, WithoutFrames(3)).ok());
  ASSERT_TRUE((*writer)->Append(0, WithoutFrames(7)).ok());
  ASSERT_TRUE((*writer)->Commit(3, entries).ok());
  absl::StatusOr<TakeProgress> progress = ReadTakeProgress(folder);
  ASSERT_TRUE(progress.ok()) << progress.status();
  ASSERT_EQ(progress->sets.size(), 1u) << "set 7 is not acknowledged";
  EXPECT_EQ(progress->sets[0].number, 3u);
  EXPECT_EQ(progress->sets[0].host_time_ns, 1000);
  EXPECT_FALSE(progress->closed);

  ASSERT_TRUE((*writer)->Commit(7, EntriesOfRecorded(WithoutFrames(7), 2000)).ok());
  ASSERT_TRUE((*writer)->Close(7, {}, {}).ok());
  progress = ReadTakeProgress(folder);
  ASSERT_TRUE(progress.ok()) << progress.status();
  ASSERT_EQ(progress->sets.size(), 2u);
  EXPECT_EQ(progress->sets[1].number, 7u);
  EXPECT_TRUE(progress->closed);
}

TEST(LedgerReader, ReadsEveryLineOnce) {
  const TempFolder temp;
  const std::string folder = temp / "take";
  LedgerReader reader(folder);
  EXPECT_EQ(reader.ReadNew().status().code(), absl::StatusCode::kNotFound);
  const auto writer = TakeWriter::Create(folder, {"cam1"}, {});
  ASSERT_TRUE(writer.ok()) << writer.status();
  EXPECT_TRUE(reader.ReadNew()->entries.empty());
  std::vector<LedgerEntry> all;
  for (const uint64_t number : {3, 4}) {
    const std::vector<LedgerEntry> entries = EntriesOfRecorded(WithoutFrames(number), 1000);
    all.insert(all.end(), entries.begin(), entries.end());
    ASSERT_TRUE((*writer)->Commit(std::nullopt, entries).ok());
    EXPECT_EQ(reader.ReadNew()->entries, entries);
    EXPECT_TRUE(reader.ReadNew()->entries.empty());
  }
  // A line that is being written is left for the next time.
  std::string ledger = ReadBytes(LedgerFile(folder));
  WriteBytes(LedgerFile(folder), ledger + "note,");
  EXPECT_TRUE(reader.ReadNew()->entries.empty());

  // Lines that are written anew, also where the file is longer than before: all are read again.
  const size_t last = ledger.rfind('\n', ledger.size() - 2) + 1;
  WriteBytes(LedgerFile(folder), ledger.substr(0, last));
  EXPECT_EQ(reader.ReadNew()->entries.size(), all.size() - 1);
  EXPECT_TRUE(reader.ReadNew()->entries.empty());
  uint64_t checksum = ParseLedger(ledger.substr(0, last))->checksum;
  const LedgerEntry other = {LedgerEvent::kNote, 0, 0, 0, 1, "", "the disk was full for some time"};
  WriteBytes(LedgerFile(folder), ledger);
  EXPECT_EQ(reader.ReadNew()->entries.size(), 1u);
  ledger = ledger.substr(0, last) + ToCsvLine(other, checksum);
  ledger += ToCsvLine(other, checksum);
  WriteBytes(LedgerFile(folder), ledger);
  const absl::StatusOr<LedgerReader::News> news = reader.ReadNew();
  EXPECT_TRUE(news->from_start);
  ASSERT_EQ(news->entries.size(), all.size() + 1);
  EXPECT_EQ(news->entries.back(), other);
}

TEST(TakeProgress, LeavesALineThatIsBeingWrittenForTheNextTime) {
  const TempFolder temp;
  const std::string folder = temp / "take";
  {
    const auto writer = TakeWriter::Create(folder, {"cam1"}, {});
    ASSERT_TRUE(writer.ok()) << writer.status();
    for (const uint64_t number : {0, 1})
      ASSERT_TRUE((*writer)->Commit(std::nullopt, EntriesOfRecorded(WithoutFrames(number), 1)).ok());
  }
  const std::string ledger = ReadBytes(LedgerFile(folder));
  const size_t last_line = ledger.rfind('\n', ledger.size() - 2) + 1;
  for (size_t size = last_line; size < ledger.size(); ++size) {
    WriteBytes(LedgerFile(folder), ledger.substr(0, size));
    const absl::StatusOr<TakeProgress> progress = ReadTakeProgress(folder);
    ASSERT_TRUE(progress.ok()) << progress.status();
    EXPECT_EQ(progress->sets.size(), ledger.find("missing", last_line) == std::string::npos ? 1u : 2u)
        << size;
  }
}

}  // namespace
}  // namespace weft
