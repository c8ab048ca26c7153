// Runs `weft` as a user does.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "tests/capture/temp_folder.h"

namespace weft {

struct WeftRun {
  int status = -1;  // the exit status
  std::string out;
  std::string err;
};

// Every argument arrives as it is, spaces included.
inline WeftRun RunWeft(const std::vector<std::string>& arguments) {
  const TempFolder folder;
  std::string command = "\"" WEFT_BINARY "\"";
  for (const std::string& argument : arguments) command += " '" + argument + "'";
  command += " > '" + (folder / "out") + "' 2> '" + (folder / "err") + "' < /dev/null";
  const int result = std::system(command.c_str());
  EXPECT_TRUE(WIFEXITED(result)) << command;
  return {WEXITSTATUS(result), ReadBytes(folder / "out"), ReadBytes(folder / "err")};
}

}  // namespace weft
