// What holds for every command of `weft`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "services/formats/files/board_file.h"
#include "services/formats/files/rig_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/weft_process.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// The names under "Subcommands:" of a help text.
std::vector<std::string> SubcommandsIn(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream lines(help.substr(std::min(help.find("Subcommands:\n"), help.size())));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && line.starts_with("  ")) {
    if (line.size() > 2 && line[2] != ' ') names.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return names;
}

// Every command below and including this one.
void CheckHelp(std::vector<std::string> command, int& checked) {
  command.push_back("--help");
  const WeftRun run = RunWeft(command);
  command.pop_back();
  const std::string name = command.empty() ? "weft" : command.back();
  EXPECT_EQ(run.status, 0) << name << ": " << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("Usage: "), HasSubstr("--help"))) << name;
  const std::vector<std::string> below = SubcommandsIn(run.out);
  if (below.empty()) {
    EXPECT_THAT(run.out, HasSubstr("Examples:\n  weft ")) << name;
  }
  ++checked;
  for (const std::string& child : below) {
    command.push_back(child);
    CheckHelp(command, checked);
    command.pop_back();
  }
}

TEST(WeftCommand, EveryCommandExplainsItselfWithAnExample) {
  int checked = 0;
  CheckHelp({}, checked);
  EXPECT_GE(checked, 10);
}

TEST(WeftCommand, BadArgumentsEndWithStatus2AndPointToTheHelp) {
  EXPECT_THAT(RunWeft({}).err, HasSubstr("a command is missing"));
  EXPECT_EQ(RunWeft({}).status, 2);
  const WeftRun unknown = RunWeft({"weave"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_THAT(unknown.err,
              AllOf(StartsWith("weft: error: "), HasSubstr("\"weave\""), HasSubstr("weft --help")));
  const WeftRun option = RunWeft({"rig", "import", "--krt", "KRT", "--width", "3"});
  EXPECT_EQ(option.status, 2);
  EXPECT_THAT(option.err, HasSubstr("weft rig import --help"));
  const WeftRun twice = RunWeft({"garment", "check", "a.obj", "--unit", "m", "--unit", "cm", "--"});
  EXPECT_EQ(twice.status, 2);
  EXPECT_THAT(twice.err,
              StartsWith("weft: error: --unit is given 2 times; give it once\nRun `weft garment check"));
  const WeftRun unused = RunWeft({"garment", "import", "a.obj", "--world-up", "z", "--out", "x"});
  EXPECT_EQ(unused.status, 2);
  EXPECT_THAT(unused.err, StartsWith("weft: error: --world-up requires --up\n"));
  EXPECT_EQ(RunWeft({"rig"}).status, 2);
  EXPECT_EQ(RunWeft({"decode", "a.png"}).status, 2);
  EXPECT_EQ(RunWeft({"pattern", "generate", "--rows", "many", "--cols", "9", "--out", "x"}).status, 2);
}

TEST(WeftCommand, TheHelpOfDecodingNamesEachColumn) {
  EXPECT_THAT(RunWeft({"decode", "--help"}).out, HasSubstr("board_col,kind,confidence,sigma_px."));
}

TEST(WeftCommand, VersionIsPrinted) {
  const WeftRun run = RunWeft({"--version"});
  EXPECT_EQ(run.status, 0);
  EXPECT_THAT(run.out, StartsWith("weft "));
}

TEST(WeftRigImport, MakesARigAndNamesTheLineOfABrokenOne) {
  const TempFolder folder;
  const std::string krt =
      "400002\n4000 0 1185\n0 4001 2049\n0 0 1\n-0.1 0.2 0 0 0\n1 0 0 10\n0 1 0 20\n0 0 1 3000\n";
  WriteBytes(folder / "KRT", krt);
  const auto import = [&] {
    return RunWeft({"rig", "import", "--krt", folder / "KRT", "--width-px", "2668", "--height-px", "4096",
                    "--out", folder / "rig.json"});
  };
  const WeftRun run = import();
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("1 cameras, 2668x4096 px"));
  ASSERT_TRUE(ReadRig(folder / "rig.json").ok());
  const std::string before = ReadBytes(folder / "rig.json");
  WriteBytes(folder / "KRT", krt.substr(0, krt.size() / 2));
  const WeftRun broken = import();
  EXPECT_EQ(broken.status, 2);
  EXPECT_THAT(broken.err, HasSubstr(folder / "KRT"));
  EXPECT_EQ(ReadBytes(folder / "rig.json"), before);
}

TEST(WeftRigImport, ReadsBehindAByteOrderMarkAndSaysWhatItChanged) {
  const TempFolder folder;
  WriteBytes(folder / "KRT",
             "\xEF\xBB\xBF"
             "400002\r\n4000 0 1185\r\n0 4001 2049\r\n0 0 1\r\n-0.1 0.2 0 0 0\r\n"
             "1 0 0 10\r\n0 1 0 20\r\n0 0 1 3000\r\n");
  const WeftRun krt = RunWeft({"rig", "import", "--krt", folder / "KRT", "--width-px", "2668", "--height-px",
                               "4096", "--out", folder / "rig.json"});
  ASSERT_EQ(krt.status, 0) << krt.err;
  EXPECT_EQ(ReadRig(folder / "rig.json")->cameras[0].id, "400002");
  WriteBytes(folder / "cam.yml",
             "image_width: 1280\nimage_height: 1024\ncamera_name: 0021\ndistortion_model: equidistant\n"
             "K: [700, 0, 640, 0, 700, 512, 0, 0, 1]\nD: [0.08, -0.02, 0.006, -0.001]\n");
  const WeftRun fisheye =
      RunWeft({"rig", "import", "--opencv", folder / "cam.yml", "--out", folder / "rig.json"});
  ASSERT_EQ(fisheye.status, 0) << fisheye.err;
  EXPECT_THAT(fisheye.err, HasSubstr("camera 0021: its fisheye lens is held to"));
  EXPECT_EQ(ReadRig(folder / "rig.json")->cameras[0].id, "0021");
}

TEST(WeftRigImport, LengthsInMetresAreRefusedOrMultiplied) {
  const TempFolder folder;
  std::string krt;
  for (const char* camera : {"a", "b"})
    krt += std::string(camera) + "\n4000 0 300\n0 4000 300\n0 0 1\n0 0 0 0 0\n1 0 0 " +
           (camera[0] == 'a' ? "0" : "1.5") + "\n0 1 0 0\n0 0 1 3\n";
  WriteBytes(folder / "KRT", krt);
  const auto import = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"rig", "import",      "--krt", folder / "KRT", "--width-px",
                                      "600", "--height-px", "600",   "--out",        folder / "rig.json"};
    words.insert(words.end(), more.begin(), more.end());
    return RunWeft(words);
  };
  const WeftRun refused = import({});
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("within 1.5 mm"), HasSubstr("--mm-per-unit")));
  EXPECT_FALSE(std::filesystem::exists(folder / "rig.json"));
  ASSERT_EQ(import({"--mm-per-unit", "1000"}).status, 0);
  EXPECT_EQ(ReadRig(folder / "rig.json")->cameras[1].translation_mm, Eigen::Vector3d(1500, 0, 3000));
  EXPECT_EQ(import({"--mm-per-unit", "1"}).status, 0);
}

TEST(WeftPattern, GeneratesABoardThatPassesItsCheck) {
  const TempFolder folder;
  const WeftRun made = RunWeft(
      {"pattern", "generate", "--rows", "20", "--cols", "30", "--cell-mm", "2.5", "--out", folder / "b"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("20 rows, 30 columns, cells of 2.5 mm"));
  const WeftRun check = RunWeft({"pattern", "check", folder / "b/board.json"});
  EXPECT_EQ(check.status, 0) << check.err;
  EXPECT_THAT(check.out, HasSubstr("every 3x3 window is unique"));
}

TEST(WeftPattern, GenerateTellsAScriptWhatItWrote) {
  const TempFolder folder;
  const WeftRun made =
      RunWeft({"pattern", "generate", "--rows", "20", "--cols", "30", "--out", folder / "b", "--json"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(made.out, ReadBytes(folder / "b/board.json"));
  EXPECT_THAT(made.out, HasSubstr("\"rows\": 20"));
}

TEST(WeftPattern, BoardsOfGarmentsFilmedTogetherAreMadeApartCheckedAndJoined) {
  const TempFolder folder;
  const auto generate = [&](const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> words = {"pattern", "generate", "--rows", "90",    "--cols",
                                      "100",     "--seed",   "7",      "--out", folder / name};
    words.insert(words.end(), more.begin(), more.end());
    return RunWeft(words);
  };
  ASSERT_EQ(generate("shirt", {}).status, 0);
  ASSERT_EQ(generate("skirt", {"--apart-from", folder / "shirt"}).status, 0);
  const WeftRun check = RunWeft({"pattern", "check", folder / "shirt", folder / "skirt"});
  EXPECT_EQ(check.status, 0) << check.err;
  EXPECT_THAT(check.out, HasSubstr("may be filmed together"));
  const WeftRun join =
      RunWeft({"pattern", "join", folder / "shirt", folder / "skirt", "--out", folder / "both"});
  ASSERT_EQ(join.status, 0) << join.err;
  EXPECT_THAT(join.out, HasSubstr("rows 94 to 183"));
  const auto joint = ReadBoard(folder / "both");
  ASSERT_TRUE(joint.ok()) << joint.status();
  ASSERT_EQ(joint->parts.size(), 2);
  EXPECT_EQ(joint->parts[1].first_row, 94);

  Board clashing = *ReadBoard(folder / "skirt");
  const Board shirt = *ReadBoard(folder / "shirt");
  for (int i = 0; i < 9; ++i) clashing.cells[100 * (i / 3) + 50 + i % 3] = shirt.at(i / 3, i % 3);
  clashing.id = "other";
  ASSERT_TRUE(WriteBoard(folder / "other", clashing).ok());
  const WeftRun refused = RunWeft({"pattern", "check", folder / "shirt", folder / "other"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.out, HasSubstr("row 0, column 0 of " + (folder / "shirt") +
                                     " reads as the one at row 0, column 50 of " + (folder / "other")));
  EXPECT_THAT(refused.err, HasSubstr("--apart-from"));
  EXPECT_EQ(RunWeft({"pattern", "join", folder / "shirt", folder / "other", "--out", folder / "no"}).status,
            2);
  EXPECT_FALSE(std::filesystem::exists(folder / "no"));
}

TEST(WeftPattern, ClashingBoardIsBadInput) {
  Board board = *GenerateBoard(12, 12, 2.7, 1);
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) board.cells[(row + 6) * 12 + col + 6] = board.at(row, col);
  }
  const TempFolder folder;
  ASSERT_TRUE(WriteBoard(folder / "b", board).ok());
  const WeftRun check = RunWeft({"pattern", "check", folder / "b/board.png"});
  EXPECT_EQ(check.status, 2);
  EXPECT_THAT(check.out, HasSubstr("row 6, column 6"));
  EXPECT_THAT(check.err, HasSubstr("their cells are ambiguous"));
  EXPECT_THAT(RunWeft({"pattern", "check", folder / "b", "--json"}).out, HasSubstr("\"unique\": false"));
}

TEST(WeftCommand, UnreadableInputIsNamedOnce) {
  const WeftRun run = RunWeft({"pattern", "check", "no such board.png"});
  EXPECT_EQ(run.status, 2);
  EXPECT_EQ(run.err, "weft: error: no such board.png: no such file\n");
  EXPECT_EQ(run.out, "");
}

}  // namespace
}  // namespace weft
