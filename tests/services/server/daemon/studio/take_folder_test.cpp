#include "services/server/daemon/studio/take_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(TakeFolders, AreListedNewestFirst) {
  const TempFolder folder;
  for (const char* name : {"20260101-a", "20260301-a", "20260201-a", ".trash", "a take", "x.tmp"})
    std::filesystem::create_directories(folder / name);
  EXPECT_THAT(TakesIn(folder.path()), ElementsAre("20260301-a", "20260201-a", "20260101-a"));
  EXPECT_THAT(TakesIn(folder / "missing"), IsEmpty());
}

TEST(TakeFolders, SayWhatIsKeptOfTheTake) {
  const TempFolder folder;
  EXPECT_FALSE(ReadKeeping(folder.path()).pinned());
  WriteBytes(KeepingFile(folder.path()), "{\"slate\": \"12A\", \"deleted_because\": \"client\"}");
  EXPECT_EQ(ReadKeeping(folder.path()).slate(), "12A");
  EXPECT_FALSE(ReadKeeping(folder.path()).pinned());
}

// What may be pinned is not deleted.
TEST(TakeFolders, CountAsPinnedWhereNobodyCanTell) {
  const TempFolder folder;
  WriteBytes(KeepingFile(folder.path()), "{\"pinned\": tr");
  EXPECT_TRUE(ReadKeeping(folder.path()).pinned());
}

TEST(TakeFolders, ExistAsFoldersAlone) {
  const TempFolder folder;
  WriteBytes(folder / "file", "");
  EXPECT_TRUE(TakeExists(folder.path()));
  EXPECT_FALSE(TakeExists(folder / "file"));
  EXPECT_FALSE(TakeExists(folder / "missing"));
}

}  // namespace
}  // namespace weft
