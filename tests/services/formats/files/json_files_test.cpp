// JSON files, among them rig.json and board.json.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "pattern/board/joint_board.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/rig_file.h"
#include "tests/capture/temp_folder.h"
#include "weft/v1/report.pb.h"
#include "weft/v1/rig.pb.h"
#include "weft/v1/session.pb.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const char kRig[] =
    R"({"cameras": [{"id": "a", "width_px": 100, "height_px": 80, "fx_px": 120.5, "fy_px": 121,
 "cx_px": 50, "cy_px": 40, "distortion": [0.1, 0, 0, 0, 0], "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1],
 "translation_mm": [0, 0.1, 1000]}]})";

std::string RigError(const std::string& part, const std::string& text) {
  std::string json = kRig;
  json.replace(json.find(part), part.size(), text);
  const auto rig = ParseRig(json, "studio/rig.json");
  EXPECT_EQ(rig.status().code(), absl::StatusCode::kInvalidArgument) << json;
  EXPECT_THAT(rig.status().message(), HasSubstr("studio/rig.json"));
  return std::string(rig.status().message());
}

TEST(JsonFile, ReadsOldAndNewNamesOfAFieldAndWritesTheNewOne) {
  for (const char* text : {R"({"second_look_found": 7})", R"({"second_pass_found": 7})"}) {
    v1::ViewReport view;
    ASSERT_TRUE(ParseJson(text, "report.json", view).ok()) << text;
    EXPECT_EQ(view.second_pass_found(), 7);
    EXPECT_THAT(*ToJson(view), AllOf(HasSubstr("\"second_pass_found\": 7"), Not(HasSubstr("second_look"))));
  }
  v1::RegistrationOptions options;
  ASSERT_TRUE(ParseJson(R"({"single_look": true})", "job.json", options).ok());
  EXPECT_TRUE(options.single_pass());
  v1::SessionCamera camera;
  ASSERT_TRUE(ParseJson(R"({"own_pace": true})", "session.json", camera).ok());
  EXPECT_TRUE(camera.unsynchronized());
}

TEST(JsonFile, QuotesLittleAndNothingThatSteersATerminal) {
  v1::ViewReport view;
  const std::string hostile = "\x1b[2J" + std::string(5000, 'A');
  for (const std::string& text :
       {"{\"second_pass_found\": \"" + hostile + "\"}", "{\"" + hostile + "\": 1}", hostile}) {
    const absl::Status status = ParseJson(text, "report.json", view);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_LT(status.message().size(), 600u) << status;
    EXPECT_EQ(status.message().find('\x1b'), std::string::npos) << status;
  }
}

TEST(RigFile, CamerasAloneAreARigAndReadBackWithTheSameHash) {
  auto rig = ParseRig(kRig, "rig.json");
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->cameras[0].fx_px, 120.5);
  EXPECT_EQ(rig->cameras[0].translation_mm, Eigen::Vector3d(0, 0.1, 1000));
  const TempFolder folder;
  rig->id = "studio";
  ASSERT_TRUE(WriteRig(folder / "rig.json", *rig, "by hand").ok());
  const auto back = ReadRig(folder / "rig.json");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->id, "studio");
  EXPECT_EQ(back->ContentHash(), rig->ContentHash());
}

TEST(RigFile, NamesTheCameraAndTheField) {
  EXPECT_THAT(RigError("\"fx_px\"", "\"focal\""), AllOf(HasSubstr("focal"), HasSubstr("unknown field")));
  EXPECT_THAT(RigError("\"fx_px\": 120.5,", ""), AllOf(HasSubstr("id a"), HasSubstr("fx_px is missing")));
  EXPECT_THAT(RigError("[0.1, 0, 0, 0, 0]", "[0.1]"),
              AllOf(HasSubstr("distortion has 1 numbers"), HasSubstr("5 to 8")));
  EXPECT_THAT(RigError("\"fx_px\": 120.5", "\"fx_px\": \"wide\""), HasSubstr("wide"));
  EXPECT_THAT(RigError("{\"cameras\"", "{\"hash\": \"0000000000000000\", \"cameras\""),
              HasSubstr("the field hash says 0000000000000000"));
  EXPECT_THAT(RigError("]}]}", "]}]"), Not(HasSubstr("\n")));
}

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

TEST(JsonFile, SaysWhichValuesAFieldTakes) {
  v1::Session session;
  const absl::Status status =
      ParseJson(R"({"trigger": {"kind": "software"}, "cameras": []})", "session.json", session);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(
      std::string(status.message()),
      ::testing::HasSubstr("it is one of SESSION_TRIGGER_KIND_FREE_RUN, SESSION_TRIGGER_KIND_SOFTWARE"));
}

// A parser would take gigabytes for each of these.
TEST(JsonLimits, AreLookedAtBeforeAnythingIsParsed) {
  v1::Rig rig;
  const auto refused = [&](const std::string& text, const JsonLimits& limits = kInputJson) {
    return ParseJson(text, "rig.json", rig, limits).message();
  };
  const auto repeated = [](const std::string& text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
  };
  EXPECT_THAT(std::string(refused("{\"cameras\":" + std::string(1 << 20, '['))),
              HasSubstr("deeper than that"));
  EXPECT_THAT(std::string(refused("{\"cameras\":[" + repeated("{},", 1'200'000) + "{}]}")),
              HasSubstr("1000000 at most"));
  EXPECT_THAT(std::string(refused("{\"cameras\":[" + repeated("1,", 1'200'000) + "1]}")),
              HasSubstr("1000000 at most"));
  EXPECT_THAT(std::string(refused(std::string((64 << 20) + 1, ' '))), HasSubstr("67108864 at most"));
}

TEST(JsonLimits, CountNothingInTexts) {
  const JsonLimits limits = {.bytes = 1000, .values = 4, .depth = 2};
  EXPECT_TRUE(CheckJsonLimits(R"({"a": "[[[[{{{{,,,,\"[[[", "b": [1, 2]})", "x", limits).ok());
  EXPECT_TRUE(CheckJsonLimits(R"({"a": "\\", "b": [1]})", "x", limits).ok());
  EXPECT_FALSE(CheckJsonLimits(R"({"a": [[1]]})", "x", limits).ok());
  EXPECT_FALSE(CheckJsonLimits(R"([1, 2, 3, 4, 5])", "x", limits).ok());
  EXPECT_TRUE(CheckJsonLimits(R"(]]]}}} "without an end)", "x", limits).ok());
}

}  // namespace
}  // namespace weft
