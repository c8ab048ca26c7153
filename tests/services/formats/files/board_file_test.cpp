#include "services/formats/files/board_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "pattern/board/joint_board.h"
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

}  // namespace
}  // namespace weft
