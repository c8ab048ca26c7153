#include "services/formats/files/json_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "weft/v1/report.pb.h"
#include "weft/v1/rig.pb.h"
#include "weft/v1/session.pb.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

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
