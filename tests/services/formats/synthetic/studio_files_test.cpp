#include "services/formats/synthetic/studio_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/files/board_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/simulation/tiny_take.h"

namespace weft {
namespace {

TEST(StudioFiles, AreThoseOfTheTakeAndSayWhereTheyComeFrom) {
  const TempFolder folder;
  const SyntheticTake take = Tiny(5, 1, 3);
  ASSERT_TRUE(WriteStudio(take, folder / "studio").ok());
  EXPECT_EQ(ReadRig(folder / "studio/rig.json")->ContentHash(), take.rig().ContentHash());
  EXPECT_EQ(ReadBoard(folder / "studio/board.json")->ContentHash(), take.board().ContentHash());
  EXPECT_EQ(ReadTemplate(folder / "studio/template")->ContentHash(), take.garment().ContentHash());
  for (const char* file : {"rig.json", "board.json", "template/template.json"})
    EXPECT_THAT(ReadBytes(folder / ("studio/" + std::string(file))),
                ::testing::HasSubstr("made by weft simulate, synthetic-tiny-5"))
        << file;
}

// What `weft template build --panels` reads.
TEST(StudioFiles, PanelsAreTheCellsOfTheGarment) {
  const TempFolder folder;
  const SyntheticTake take = Tiny(5, 1, 1);
  ASSERT_TRUE(WriteStudio(take, folder.path()).ok());
  const Board& board = take.board();
  const auto panels = ReadPanelMask(folder / "panels.png", board.rows, board.cols);
  ASSERT_TRUE(panels.ok()) << panels.status();
  std::vector<bool> expected(board.cells.size());
  for (const VertexNode& cell : take.garment().node_of_vertex)
    if (cell.IsCell()) expected[static_cast<size_t>(cell.row * board.cols + cell.col)] = true;
  for (size_t i = 0; i < expected.size(); ++i) EXPECT_EQ((*panels)[i] > 0, expected[i]) << i;
}

TEST(StudioFiles, AFolderThatCannotBeMadeIsAnError) {
  const TempFolder folder;
  WriteBytes(folder / "file", "x");
  EXPECT_FALSE(WriteStudio(Tiny(5, 1, 1), folder / "file/studio").ok());
}

}  // namespace
}  // namespace weft
