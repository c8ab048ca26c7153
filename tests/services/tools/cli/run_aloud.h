// A command of `weft` in the test's own process, as somebody sees it who did not ask for --quiet; and what a
// daemon answers it, written as text.
#pragma once

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "services/formats/files/json_file.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {

struct AloudRun {
  absl::Status status;
  std::string out, err;

  std::string message() const { return std::string(status.message()); }
};

inline AloudRun RunAloud(AddCommandFunction add, std::vector<std::string> words) {
  CLI::App app("Weft", "weft");
  CommandLine line;
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
  const std::string err = ::testing::internal::GetCapturedStderr();
  return {status, ::testing::internal::GetCapturedStdout(), err};
}

template <typename Message>
Message FromText(const std::string& text) {
  Message message;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &message)) << text;
  return message;
}

// The JSON that a command printed.
template <typename Message>
Message FromJson(const std::string& json) {
  Message message;
  EXPECT_TRUE(ParseJson(json, "what was printed", message).ok()) << json;
  return message;
}

// On one line.
inline std::string TextOf(const google::protobuf::Message& message) {
  std::string text;
  google::protobuf::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  EXPECT_TRUE(printer.PrintToString(message, &text));
  if (!text.empty()) text.pop_back();  // a space
  return text;
}

}  // namespace weft
