#include "services/formats/synthetic/take_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <utility>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

TEST(TakeFolder, RefusesATakeOfAnotherRecipeAndNamesBoth) {
  const TempFolder folder;
  ASSERT_TRUE(TakeFolder::Open(folder / "take", "seed 1").ok());
  EXPECT_TRUE(TakeFolder::Open(folder / "take", "seed 1").ok());
  const auto other = TakeFolder::Open(folder / "take", "seed 2");
  EXPECT_EQ(other.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_NE(other.status().message().find("seed 1"), std::string::npos) << other.status();
  EXPECT_NE(other.status().message().find("seed 2"), std::string::npos) << other.status();
}

TEST(TakeFolder, OneProcessWritesAtATime) {
  const TempFolder folder;
  const auto first = TakeFolder::Open(folder / "take", "seed 1");
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(TakeFolder::Open(folder / "take", "seed 1").status().code(), absl::StatusCode::kUnavailable);
}

TEST(TakeFolder, AFrameIsThereOnceItIsKept) {
  const TempFolder folder;
  const auto take = TakeFolder::Open(folder / "take", "seed 1");
  ASSERT_TRUE(take.ok()) << take.status();
  const auto draft = take->BeginFrame(7);
  ASSERT_TRUE(draft.ok()) << draft.status();
  WriteBytes(draft->pictures + "/c1.png", "picture");
  WriteBytes(draft->truth + "/mesh.ply", "mesh");
  EXPECT_FALSE(take->HasFrame(7));
  EXPECT_FALSE(fs::exists(folder / "take/0007"));
  ASSERT_TRUE(take->KeepFrame(7).ok());
  EXPECT_TRUE(take->HasFrame(7));
  EXPECT_FALSE(take->HasFrame(8));
  EXPECT_EQ(ReadBytes(folder / "take/0007/c1.png"), "picture");
  EXPECT_EQ(ReadBytes(folder / "take/truth/0007/mesh.ply"), "mesh");
  EXPECT_EQ(take->TruthOf(7), folder / "take/truth/0007");
}

TEST(TakeFolder, NamesFramesByFourDigitsOrMore) {
  EXPECT_EQ(TakeFolder::NameOf(0), "0000");
  EXPECT_EQ(TakeFolder::NameOf(42), "0042");
  EXPECT_EQ(TakeFolder::NameOf(12345), "12345");
}

// As after a kill: the next one begins the frame anew.
TEST(TakeFolder, WhatIsUnfinishedGoesAwayWithItsHolder) {
  const TempFolder folder;
  {
    auto take = TakeFolder::Open(folder / "take/", "seed 1");
    ASSERT_TRUE(take.ok()) << take.status();
    WriteBytes(take->BeginFrame(0)->pictures + "/c1.png", "picture");
    const TakeFolder moved = *std::move(take);
    EXPECT_TRUE(fs::exists(folder / "take/.unfinished"));
  }
  EXPECT_FALSE(fs::exists(folder / "take/.unfinished"));
  WriteBytes(folder / "take/.unfinished/0000/pictures/c1.png", "of a process that was killed");
  const auto again = TakeFolder::Open(folder / "take", "seed 1");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_FALSE(fs::exists(folder / "take/.unfinished"));
}

TEST(TakeFolder, IsCompleteWithTheListOfItsPicturesOrWithItsCloth) {
  const TempFolder folder;
  const auto take = TakeFolder::Open(folder / "take", "seed 1");
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_FALSE(take->IsComplete());
  WriteBytes(take->FramesFile(), "frames");
  EXPECT_TRUE(take->IsComplete());
  fs::remove(take->FramesFile());
  WriteBytes(take->PicturesCsv(), "frame,camera");
  EXPECT_TRUE(take->IsComplete());
}

}  // namespace
}  // namespace weft
