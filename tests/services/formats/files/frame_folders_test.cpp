#include "services/formats/files/frame_folders.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(FrameFolders, AreThoseWithTheFileInTheOrderOfTheirNumbers) {
  const TempFolder folder;
  for (const char* path : {"10/report.json", "9/report.json", "11/mesh.ply", "report.json",
                           "template/report.json", "template/template.json"})
    WriteBytes(folder / path, "{}");
  const auto names = ListFrameFolders(folder.path(), FrameFile::kReport);
  ASSERT_TRUE(names.ok()) << names.status();
  EXPECT_THAT(*names, ::testing::ElementsAre("9", "10"));
}

TEST(FrameFolders, AFolderThatIsNotThereIsNamed) {
  const TempFolder folder;
  const absl::Status status = ListFrameFolders(folder / "gone", FrameFile::kReport).status();
  EXPECT_TRUE(absl::IsNotFound(status));
  EXPECT_THAT(std::string(status.message()), ::testing::StartsWith(folder / "gone"));
}

}  // namespace
}  // namespace weft
