// The commands of README.md under "Your own recording".
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>

#include "services/formats/files/board_file.h"
#include "services/formats/files/mesh_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/weft_process.h"

namespace weft {
namespace {

// The `weft` lines of the first code block below the heading.
std::vector<std::string> CommandsBelow(const std::string& heading) {
  const std::string text = ReadBytes(WEFT_SOURCE_DIR "/README.md");
  const size_t begin = text.find("```\n", text.find("## " + heading + "\n"));
  std::istringstream block(text.substr(begin + 4, text.find("```", begin + 4) - begin - 4));
  std::vector<std::string> commands;
  for (std::string line; std::getline(block, line);) {
    if (line.starts_with("weft ")) commands.push_back(line);
  }
  return commands;
}

// Files of the names that README.md uses.
void MakeInputs(const TempFolder& folder) {
  WriteBytes(folder / "KRT",
             "400002\n4000 0 1185\n0 4001 2049\n0 0 1\n0 0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 3000\n");
  ASSERT_TRUE(WriteBoard(folder.path(), *GenerateBoard(6, 6, 2.7, 1)).ok());
  const TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  ASSERT_TRUE(WriteMesh(folder / "shirt.ply", mesh).ok());
  WriteBytes(folder / "vertex_to_cell.txt", "0 0\n0 1\n-1 -1\n");
}

TEST(Readme, CommandsOfYourOwnRecordingRun) {
  const TempFolder folder;
  MakeInputs(folder);
  int run = 0;
  for (const std::string& command : CommandsBelow("Your own recording")) {
    if (command.starts_with("weft register ")) continue;  // needs a take; the system tests register one
    const std::string line =
        "cd '" + folder.path() + "' && \"" WEFT_BINARY "\"" + command.substr(4) + " > /dev/null";
    EXPECT_EQ(std::system(line.c_str()), 0) << command;
    ++run;
  }
  EXPECT_GE(run, 2);
  EXPECT_TRUE(std::filesystem::exists(folder / "rig.json"));
  EXPECT_TRUE(std::filesystem::exists(folder / "shirt/template.json"));
}

}  // namespace
}  // namespace weft
