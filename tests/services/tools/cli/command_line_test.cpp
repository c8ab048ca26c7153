#include "services/tools/cli/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(CommandLineParts, TakeOneOfSeveralNames) {
  const CLI::Validator one = OneOf({"fast", "exact"});
  std::string value = "fast";
  EXPECT_EQ(one(value), "");
  value = "Fast";
  EXPECT_THAT(one(value), HasSubstr("\"Fast\" is none of fast, exact"));
  EXPECT_EQ(one.get_description(), "{fast,exact}");
}

TEST(CommandLineParts, TakeFiniteNumbersAlone) {
  CLI::App app;
  double speed = 0;
  app.add_option("--speed", speed);
  app.parse("--speed 3.5");
  EXPECT_TRUE(CheckFinite(app).ok());
  for (const char* text : {"inf", "-inf", "nan"}) {
    app.clear();
    app.parse("--speed=" + std::string(text));
    const absl::Status status = CheckFinite(app);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr("--speed")) << text;
  }
}

TEST(CommandLineParts, ShowExamplesBelowTheOptions) {
  CLI::App app("Weft", "weft");
  AddCommand(app, "take", "Looks at takes.", "  weft take info T");
  EXPECT_THAT(app.get_subcommand("take")->help(), HasSubstr("Examples:\n  weft take info T"));
}

}  // namespace
}  // namespace weft
