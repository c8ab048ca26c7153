#include "services/formats/files/target_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// A board of two by three tags, and a bar.
CalibrationTarget BoardAndBar() {
  return {
      "studio", {{"A", "tag36h11", 2, 3, 28, 7, {5, 4, 3, 2, 1, 0}}}, {{"bar", "tag36h11", 500, 501, 260.5}}};
}

TEST(TargetFile, IsReadAsItWasWritten) {
  const TempFolder folder;
  ASSERT_TRUE(WriteTarget(folder / "target.json", BoardAndBar()).ok());
  const auto target = ReadTarget(folder / "target.json");
  ASSERT_TRUE(target.ok()) << target.status();
  EXPECT_TRUE(*target == BoardAndBar());
}

TEST(TargetFile, NamesTheFileAndTheFaultyField) {
  const TempFolder folder;
  EXPECT_TRUE(absl::IsNotFound(ReadTarget(folder / "none.json").status()));
  CalibrationTarget wrong = BoardAndBar();
  wrong.boards[0].tag_mm = 0;
  EXPECT_TRUE(absl::IsInvalidArgument(WriteTarget(folder / "wrong.json", wrong)));
  EXPECT_FALSE(std::filesystem::exists(folder / "wrong.json"));
  WriteBytes(folder / "wrong.json", R"({"boards": [{"id": "A", "family": "tag36h11", "rows": 1, "cols": 1,
      "gap_mm": 7, "tag_ids": [0]}]})");
  const absl::Status status = ReadTarget(folder / "wrong.json").status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr(folder / "wrong.json: "));
  EXPECT_THAT(std::string(status.message()), HasSubstr("tag_mm"));
}

}  // namespace
}  // namespace weft
