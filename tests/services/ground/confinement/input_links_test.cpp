#include "services/ground/confinement/input_links.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class InputLinksTest : public ::testing::Test {
 protected:
  InputLinksTest() {
    for (const char* name : {"dump/0000", "dump/0001", "images/deep", "secret", "images/state"})
      fs::create_directories(folder_ / name);
    WriteBytes(folder_ / "dump/0000/a.png", "x");
    WriteBytes(folder_ / "images/b.png", "x");
    WriteBytes(folder_ / "images/state/access.json", "x");
    WriteBytes(folder_ / "secret/file", "x");
  }

  void Link(const std::string& to, const std::string& at) { fs::create_symlink(folder_ / to, folder_ / at); }
  LinksFound Find(const std::string& input = "dump") {
    return FindLinks({folder_ / input},
                     {.allowed = {folder_ / "images"}, .closed = folder_ / "images/state"});
  }

  TempFolder folder_;
};

TEST_F(InputLinksTest, ListsWhatLinksLeadToWithinTheAllowedFolders) {
  EXPECT_THAT(Find().others, IsEmpty());
  Link("images/b.png", "dump/0000/b.png");
  Link("images/b.png", "dump/0001/b.png");
  Link("dump/0000/a.png", "dump/0001/a.png");
  Link("nowhere", "dump/0001/c.png");
  const LinksFound found = Find();
  EXPECT_THAT(found.others, ElementsAre(folder_ / "images/b.png"));
  EXPECT_EQ(found.way_out, "");
  EXPECT_EQ(found.special, "");
}

TEST_F(InputLinksTest, FindsWaysOutAlsoThroughAllowedFolders) {
  Link("secret/file", "images/deep/way");
  Link("images/deep", "dump/0002");
  EXPECT_EQ(Find().way_out, folder_ / "images/deep/way");
  fs::remove(folder_ / "dump/0002");
  Link("secret", "dump/0001/out");
  EXPECT_EQ(Find().way_out, folder_ / "dump/0001/out");
}

TEST_F(InputLinksTest, TheClosedFolderIsAWayOut) {
  Link("images/state/access.json", "dump/0000/b.png");
  EXPECT_EQ(Find().way_out, folder_ / "dump/0000/b.png");
  fs::remove(folder_ / "dump/0000/b.png");
  Link("images", "dump/around");
  EXPECT_EQ(Find().way_out, folder_ / "dump/around");
}

TEST_F(InputLinksTest, NamesFifos) {
  ASSERT_EQ(mkfifo((folder_ / "dump/0001/a.png").c_str(), 0600), 0);
  EXPECT_EQ(Find().special, folder_ / "dump/0001/a.png");
  EXPECT_EQ(Find("dump/0001/a.png").special, folder_ / "dump/0001/a.png");
}

TEST_F(InputLinksTest, FilesBesideAJsonFileBelongToItAndAreNotJudged) {
  WriteBytes(folder_ / "dump/board.json", "{}");
  WriteBytes(folder_ / "dump/board.png", "x");
  Link("secret/file", "dump/other.png");
  ASSERT_EQ(mkfifo((folder_ / "dump/fifo").c_str(), 0600), 0);
  const LinksFound found = Find("dump/board.json");
  EXPECT_THAT(found.others, ElementsAre(folder_ / "dump/board.json", folder_ / "dump/board.png"));
  EXPECT_EQ(found.way_out, "");
  EXPECT_EQ(found.special, "");
}

TEST_F(InputLinksTest, OpensPathsWithoutLinksOnly) {
  EXPECT_TRUE(OpenWithoutLinks(folder_ / "dump/0000/a.png").ok());
  EXPECT_TRUE(OpenWithoutLinks("/").ok());
  EXPECT_EQ(OpenWithoutLinks(folder_ / "dump/none").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(OpenWithoutLinks("dump").status().code(), absl::StatusCode::kInvalidArgument);
  Link("dump", "link");
  for (const char* path : {"link", "link/0000/a.png"}) {
    const absl::Status status = OpenWithoutLinks(folder_ / path).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << path;
    EXPECT_THAT(std::string(status.message()), HasSubstr(folder_ / "link: was exchanged"));
  }
}

}  // namespace
}  // namespace weft
