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
