// A command of `weft` in the test's own process: what it prints, and the status that it ends with.
#pragma once

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "services/tools/cli/command_line.h"

namespace weft {

struct CommandRun {
  absl::Status status;
  std::string out, err;

  std::string message() const { return std::string(status.message()); }
};

using AddCommandFunction = void (*)(CLI::App& app, CommandLine& line);

// Words that cannot be parsed are InvalidArgument, with what the parser says. `is_quiet`: as with --quiet.
inline CommandRun RunCommand(AddCommandFunction add, std::vector<std::string> words, bool is_quiet = true) {
  CLI::App app("Weft", "weft");
  CommandLine line;
  line.quiet = is_quiet;
  add(app, line);
  std::reverse(words.begin(), words.end());  // as CLI11 takes them
  try {
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return {absl::InvalidArgumentError(error.what()), "", ""};
  }
  if (!line.run) return {absl::InternalError("no command was named"), "", ""};
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  const absl::Status status = line.run();
  return {status, ::testing::internal::GetCapturedStdout(), ::testing::internal::GetCapturedStderr()};
}

// To what the command of these words would be confined.
inline std::optional<ConfinedFiles> ConfinementOfCommand(AddCommandFunction add,
                                                         std::vector<std::string> words) {
  CLI::App app("Weft", "weft");
  CommandLine line;
  add(app, line);
  std::reverse(words.begin(), words.end());
  app.parse(std::move(words));
  return line.confined;
}

}  // namespace weft
