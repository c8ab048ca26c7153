#include "services/formats/files/board_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "capture/image/image_file.h"
#include "pattern/board/joint_board.h"
#include "pattern/board/panel_mask.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(BoardFile, ReadsBackFromJsonFolderAndImage) {
  const TempFolder folder;
  Board board = *GenerateBoard(7, 9, 2.7, 3);
  board.id = "small";
  ASSERT_TRUE(WriteBoard(folder / "board", board, "by hand").ok());
  for (const char* path : {"board", "board/board.json", "board/board.png"}) {
    const auto back = ReadBoard(folder / path);
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(back->ContentHash(), board.ContentHash()) << path;
  }
  EXPECT_EQ(ReadBoard(folder / "board")->cell_mm, 2.7);
  EXPECT_EQ(ReadBoard(folder / "board")->id, "small");
  EXPECT_EQ(ReadBoard(folder / "none.png").status().code(), absl::StatusCode::kNotFound);
}

TEST(BoardFile, NamesTheFieldThatDoesNotFitTheImage) {
  const TempFolder folder;
  ASSERT_TRUE(WriteBoard(folder / "board", *GenerateBoard(7, 9, 2.7, 3)).ok());
  const std::string json = ReadBytes(folder / "board/board.json");
  const auto error = [&](const std::string& part, const std::string& text) {
    std::string changed = json;
    const size_t at = changed.find(part);
    EXPECT_NE(at, std::string::npos) << json;
    WriteBytes(folder / "board/board.json", changed.replace(at, part.size(), text));
    const auto board = ReadBoard(folder / "board");
    EXPECT_THAT(board.status().message(), HasSubstr("board.json"));
    return std::string(board.status().message());
  };
  EXPECT_THAT(error("\"rows\": 7", "\"rows\": 8"),
              AllOf(HasSubstr("rows says 8"), HasSubstr("do not belong together")));
  EXPECT_THAT(error("\"hash\": \"", "\"hash\": \"f"), HasSubstr("hash says f"));
  EXPECT_THAT(error("\"rows\"", "\"pitch\": 1, \"rows\""),
              AllOf(HasSubstr("pitch"), HasSubstr("unknown field")));
  EXPECT_THAT(error("\"board.png\"", "\"/etc/board.png\""), HasSubstr("the field image"));
}

TEST(BoardFile, JointBoardsKeepTheirPartsAndCheckThem) {
  const TempFolder folder;
  const Board a = *GenerateBoard(7, 9, 2.7, 3), b = *GenerateBoard(8, 6, 4, 5);
  const Board joint = *JoinBoards({a, b});
  ASSERT_TRUE(WriteBoard(folder / "board", joint).ok());
  const auto back = ReadBoard(folder / "board");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->parts, joint.parts);
  EXPECT_EQ(back->panels, joint.panels);
  std::string json = ReadBytes(folder / "board/board.json");
  const std::string hash = "\"hash\": \"" + b.ContentHash();
  WriteBytes(folder / "board/board.json", json.replace(json.find(hash), hash.size(), "\"hash\": \"0123"));
  EXPECT_THAT(ReadBoard(folder / "board").status().message(), HasSubstr("parts[1].hash says"));
  WriteBytes(folder / "board/board.json",
             json.replace(json.find("\"first_row\": 11"), 15, "\"first_row\": 99"));
  EXPECT_THAT(ReadBoard(folder / "board").status().message(), HasSubstr("parts[1]: rows 99"));
}

TEST(BoardFile, ImagesThatAreNoBoardAreNamed) {
  const TempFolder folder;
  ASSERT_TRUE(WriteBoard(folder / "board", *GenerateBoard(7, 9, 2.7, 3)).ok());
  std::string json = ReadBytes(folder / "board/board.json");
  WriteBytes(folder / "board/board.json", json.replace(json.find("\"cols\": 9"), 9, "\"cols\": 8"));
  EXPECT_THAT(ReadBoard(folder / "board").status().message(),
              AllOf(HasSubstr("cols says 8"), HasSubstr("has 9")));
  const std::vector<uint8_t> panels(7 * 9, 1);
  ASSERT_TRUE(WriteImageFile(folder / "panels.png", PanelsToMask(panels, 7, 9)).ok());
  const absl::Status grey = ReadBoard(folder / "panels.png").status();
  EXPECT_TRUE(absl::IsInvalidArgument(grey));
  EXPECT_THAT(std::string(grey.message()), ::testing::StartsWith(folder / "panels.png"));
  EXPECT_EQ(*ReadPanelMask(folder / "panels.png", 7, 9), panels);
  EXPECT_THAT(std::string(ReadPanelMask(folder / "panels.png", 7, 8).status().message()),
              HasSubstr("7 rows and 9 columns of pixels, the board has 7x8 cells"));
  EXPECT_FALSE(ReadPanelMask(folder / "panels.png", 6, 9).ok());
  // Too large to be looked at.
  WriteBytes(folder / "large.png", "");
  std::filesystem::resize_file(folder / "large.png", (uintmax_t{256} << 20) + 1);
  const absl::Status large = ReadBoard(folder / "large.png").status();
  EXPECT_TRUE(absl::IsInvalidArgument(large));
  EXPECT_THAT(std::string(large.message()),
              HasSubstr("has 268435457 bytes, more than the 268435456 that the image of a board may have"));
}

// All of board.json, but for the hash.
TEST(BoardFile, EveryFieldIsWrittenAndReadBack) {
  const TempFolder folder;
  Board board = *GenerateBoard(7, 9, 2.5, 3);
  board.square_fraction = 0.75;
  board.id = "small";
  board.panels.assign(7 * 9, 1);
  ASSERT_TRUE(WriteBoard(folder / "board", board, "by hand").ok());
  const std::string json = ReadBytes(folder / "board/board.json");
  for (const char* field :
       {"\"id\": \"small\"", "\"provenance\": \"by hand\"", "\"rows\": 7", "\"cols\": 9", "\"cell_mm\": 2.5",
        "\"square_fraction\": 0.75", "\"image\": \"board.png\"", "\"panels\": \"panels.png\""})
    EXPECT_THAT(json, HasSubstr(field));
  const auto back = ReadBoard(folder / "board");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->square_fraction, 0.75);
  EXPECT_EQ(back->cell_mm, 2.5);
  EXPECT_EQ(back->panels, board.panels);
  EXPECT_EQ(back->cells, board.cells);
}

}  // namespace
}  // namespace weft
