#include "services/server/daemon/program/config_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class ConfigFileTest : public ::testing::Test {
 protected:
  ConfigFileTest() {
    app_.option_defaults()->always_capture_default();
    app_.add_option("--workers", workers_, "Worker processes")->check(CLI::Range(1, 64));
    app_.add_option("--listen", listen_, "Where it listens");
    app_.add_option("--log-level", log_level_, "How much it logs");
  }
  absl::Status Apply(const std::string& text) {
    WriteBytes(path_, text);
    return ApplyConfigFile(path_, app_);
  }

  TempFolder folder_;
  const std::string path_ = folder_ / "weftd.txtpb";
  CLI::App app_{"weftd"};
  int workers_ = 4;
  std::vector<std::string> listen_;
  std::string log_level_ = "info";
};

TEST_F(ConfigFileTest, GivesOptionsOfItsFieldsNames) {
  ASSERT_TRUE(Apply("workers: 7\nlisten: \"unix:/a\"\nlisten: \"unix:/b\"\nlog_level: \"debug\"\n").ok());
  EXPECT_EQ(workers_, 7);
  EXPECT_EQ(listen_, (std::vector<std::string>{"unix:/a", "unix:/b"}));
  EXPECT_EQ(log_level_, "debug");
}

TEST_F(ConfigFileTest, YieldsToArguments) {
  app_.parse("--workers 2");
  ASSERT_TRUE(Apply("workers: 7\nlog_level: \"debug\"\n").ok());
  EXPECT_EQ(workers_, 2);
  EXPECT_EQ(log_level_, "debug");
}

TEST_F(ConfigFileTest, NamesLineAndFieldOfAMistake) {
  const absl::Status unknown = Apply("workers: 7\nwrokers: 3\n");
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("weftd.txtpb:2: wrokers: no such option; "));
  const absl::Status range = Apply("\n\nworkers: 65\n");
  EXPECT_EQ(range.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(range.message()), HasSubstr("weftd.txtpb:3: workers: "));
  EXPECT_EQ(Apply("workers: \"many\"\n").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ApplyConfigFile(folder_ / "missing", app_).code(), absl::StatusCode::kNotFound);
}

TEST_F(ConfigFileTest, HasAMebibyteAtTheMost) {
  std::string text = "workers: 7\n#";
  text.resize(1 << 20, 'x');
  EXPECT_TRUE(Apply(text).ok());
  EXPECT_EQ(workers_, 7);
  EXPECT_FALSE(Apply(text + "x").ok());
}

TEST_F(ConfigFileTest, IsWrittenWithDefaultsAsComments) {
  app_.parse("--workers 2 --listen unix:/a");
  const std::string text = ConfigFileText(app_);
  EXPECT_THAT(text, HasSubstr("\n# Worker processes\nworkers: 2\n"));
  EXPECT_THAT(text, HasSubstr("\nlisten: \"unix:/a\"\n"));
  EXPECT_THAT(text, HasSubstr("\n# log_level: \"info\"\n"));
  EXPECT_THAT(text, Not(HasSubstr("help")));
}

TEST_F(ConfigFileTest, TellsTheValuesInForce) {
  app_.parse("--listen unix:/a --listen unix:/b");
  const auto settings = SettingsOf(app_);
  EXPECT_EQ(settings.at("workers"), "4");
  EXPECT_EQ(settings.at("listen"), "unix:/a\nunix:/b");
  EXPECT_EQ(settings.at("log_level"), "info");
  EXPECT_FALSE(settings.contains("help"));
}

}  // namespace
}  // namespace weft
