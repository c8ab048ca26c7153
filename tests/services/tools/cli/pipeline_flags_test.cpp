#include "services/tools/cli/pipeline_flags.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(PipelineFlags, ApplyFilesThenSettingsThenTheCommandsOwn) {
  const TempFolder folder;
  WriteBytes(folder / "a.txtpb", "decode { levels: 1 }\n");
  WriteBytes(folder / "b.txtpb", "decode { levels: 2 }\n");
  PipelineFlags flags;
  flags.configs = {folder / "b.txtpb", folder / "a.txtpb"};
  EXPECT_EQ(ChangesOf(flags, {"decode"})->decode().levels(), 1);
  flags.settings = {"decode.levels=2"};
  EXPECT_EQ(ChangesOf(flags, {"decode"})->decode().levels(), 2);
  flags.shorthands = {"decode.levels=3"};
  EXPECT_EQ(ChangesOf(flags, {"decode"})->decode().levels(), 3);
}

TEST(PipelineFlags, KnowTheDefaultsOfOptions) {
  EXPECT_EQ(DefaultOfOption("template_build.openings"), "-1");
  EXPECT_EQ(DefaultOfOption("no_such_option"), "");
}

TEST(PipelineFlags, TakeSettingsOfTheCommandsStagesAlone) {
  PipelineFlags flags;
  flags.settings = {"decode.levels=2"};
  EXPECT_EQ(ChangesOf(flags, {"alignment"}).status().code(), absl::StatusCode::kInvalidArgument);
  flags.settings = {"decode.no_such_option=2"};
  const absl::Status unknown = ChangesOf(flags, {"decode"}).status();
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("no_such_option"));
  flags.settings.clear();
  flags.configs = {"/no such folder/a.txtpb"};
  EXPECT_EQ(ChangesOf(flags, {"decode"}).status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
