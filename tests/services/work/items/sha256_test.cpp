#include "services/work/items/sha256.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

// FIPS 180-4, examples of one block and of none.
constexpr char kHashOfAbc[] = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr char kHashOfNothing[] = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

TEST(Sha256, PiecesMakeTheHashOfTheWhole) {
  EXPECT_EQ(Sha256().Add("a").Add("").Add("bc").Hex(), kHashOfAbc);
  EXPECT_EQ(Sha256().Hex(), kHashOfNothing);
}

TEST(Sha256, FilesTellOfTheBytesRead) {
  const TempFolder folder;
  WriteBytes(folder / "file", "abc");
  size_t bytes = 0;
  const auto hash = Sha256OfFile(folder / "file", [&](size_t more) { bytes += more; });
  ASSERT_TRUE(hash.ok()) << hash.status();
  EXPECT_EQ(*hash, kHashOfAbc);
  EXPECT_EQ(bytes, 3u);
}

TEST(Sha256, LinksAreNotFollowed) {
  const TempFolder folder;
  WriteBytes(folder / "file", "abc");
  std::filesystem::create_symlink(folder / "file", folder / "link");
  EXPECT_THAT(std::string(Sha256OfFile(folder / "link").status().message()), ::testing::HasSubstr("link"));
  EXPECT_FALSE(Sha256OfFile(folder / "link").ok());
  EXPECT_FALSE(Sha256OfFile(folder / "none").ok());
}

TEST(Sha256, FilesOfMoreThanOnePieceAreHashedWhole) {
  const TempFolder folder;
  WriteBytes(folder / "file", std::string(3'000'000, 'a'));
  size_t bytes = 0;
  // By sha256sum.
  EXPECT_EQ(*Sha256OfFile(folder / "file", [&](size_t more) { bytes += more; }),
            "2a152c894398719c0570f83fac34ac03a0f6e8e474b995c2403aa5434f7b9dd4");
  EXPECT_EQ(bytes, 3'000'000u);
  EXPECT_FALSE(Sha256OfFile(folder.path()).ok()) << "a folder";
}

}  // namespace
}  // namespace weft
