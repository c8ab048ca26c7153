#include "services/formats/files/file_facts.h"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(FileFacts, CountsAllFilesBelowAFolder) {
  const TempFolder folder;
  WriteBytes(folder / "a/b/c", "12345");
  WriteBytes(folder / "d", "678");
  std::filesystem::create_symlink(folder / "d", folder / "link to nowhere");
  EXPECT_EQ(BytesBelow(folder / "a"), 5u);
  EXPECT_GE(BytesBelow(folder.path()), 8u);
  EXPECT_EQ(BytesBelow(folder / "none"), 0u);
}

TEST(FileFacts, BearsAFolderThatIsRemovedMeanwhile) {
  const TempFolder folder;
  std::atomic<bool> stop = false;
  std::thread changer([&] {
    for (int i = 0; !stop; ++i) {
      WriteBytes(folder / ("a/" + std::to_string(i % 3) + "/b/c"), "1");
      std::filesystem::remove_all(folder / "a");
    }
  });
  for (int i = 0; i < 2000; ++i) EXPECT_LE(BytesBelow(folder / "a"), 3u);
  stop = true;
  changer.join();
}

TEST(FileFacts, TimesAreInNanoseconds) { EXPECT_EQ(UnixTime_ns({2, 3}), 2'000'000'003); }

}  // namespace
}  // namespace weft
