// Options that a command has from the description of its kind.
#include "services/tools/cli/kind_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// What `weft rig calibrate` and `weft template build` have, as places.
struct Places {
  std::string dump, target, rig, scale = "tags";
  std::vector<std::string> sources;
  int every = 1;
  double gamma = 1, blur_px = 2;
  bool on_floor = false;
  PipelineFlags pipeline;
};

class KindOptionsTest : public testing::Test {
 protected:
  KindOptionsTest() {
    command_.option_defaults()->always_capture_default();
    KindOptions add(command_, "rig calibrate");
    add("dump", places_.dump);
    add("target", places_.target);
    add("rig", places_.rig);
    add("every", places_.every);
    add("scale", places_.scale);
    add("gamma", places_.gamma);
    add("max-blur-px", places_.blur_px);
    add("world-floor", places_.on_floor);
  }

  // Empty: it was taken.
  std::string Refusal(const std::string& arguments) {
    try {
      command_.parse("film --target target.json " + arguments, false);
    } catch (const CLI::ParseError& error) {
      return error.what();
    }
    return "";
  }

  CLI::App command_{"", "calibrate"};
  Places places_;
};

TEST_F(KindOptionsTest, GoWhereTheCommandWantsThem) {
  EXPECT_EQ(Refusal("--rig rig.json --every 3 --scale bar --gamma 2.2 --world-floor"), "");
  EXPECT_EQ(places_.dump, "film");
  EXPECT_EQ(places_.target, "target.json");
  EXPECT_EQ(places_.rig, "rig.json");
  EXPECT_EQ(places_.every, 3);
  EXPECT_EQ(places_.scale, "bar");
  EXPECT_EQ(places_.gamma, 2.2);
  EXPECT_TRUE(places_.on_floor);
}

TEST_F(KindOptionsTest, HaveTheRangesAndChoicesOfTheDescription) {
  EXPECT_THAT(Refusal("--every 0"), HasSubstr("--every: Value 0 not in range"));
  EXPECT_THAT(Refusal("--gamma 5"), HasSubstr("--gamma: Value 5 not in range"));
  EXPECT_THAT(Refusal("--max-blur-px 0"), HasSubstr("--max-blur-px"));
  EXPECT_THAT(Refusal("--scale bars"), HasSubstr("is none of tags, bar; did you mean bar?"));
  EXPECT_EQ(Refusal("--every 10000 --gamma 4 --max-blur-px 1e6"), "");
}

TEST_F(KindOptionsTest, HaveTheWordsOfTheDescription) {
  const std::string help = command_.help();
  for (const char* words :
       {"--rig FILE", "--every N", "--max-blur-px PX", "--gamma N", "Look at one frame in so many"})
    EXPECT_THAT(help, HasSubstr(words));
  EXPECT_TRUE(command_.get_option("--target")->get_required());
  EXPECT_FALSE(command_.get_option("--rig")->get_required());
}

TEST_F(KindOptionsTest, BecomeARequest) {
  std::string besides;
  command_.add_option("--out", besides);
  EXPECT_EQ(Refusal("--every 3 --world-floor --out rig.json"), "");
  std::vector<const CLI::Option*> others;
  const v1::WorkSpec work = WorkOf(*FindKindInfo("rig calibrate"), command_, &others);
  std::vector<std::string> given;
  for (const auto* list : {&work.inputs(), &work.options()})
    for (const v1::NamedValue& one : *list) given.push_back(one.name() + "=" + one.value());
  EXPECT_THAT(given, ElementsAre("dump=film", "target=target.json", "every=3", "world-floor="));
  ASSERT_EQ(others.size(), 1u);
  EXPECT_EQ(others[0]->get_name(), "--out");
}

TEST(KindOptions, StandForOptionsOfThePipeline) {
  CLI::App command;
  PipelineFlags flags;
  std::vector<std::string> sources;
  KindOptions add(command, "template build");
  add("sources", sources);
  add("openings", flags, "template_build.openings");
  add("corners", flags, "template_build.corners");
  command.parse("a.ply b.ply --openings 4 --corners", false);
  EXPECT_THAT(sources, ElementsAre("a.ply", "b.ply"));
  EXPECT_THAT(flags.shorthands, ElementsAre("template_build.openings=4", "template_build.corners=true"));
  EXPECT_EQ(command.get_option("--openings")->get_default_str(), "-1");
  EXPECT_THROW(command.parse("a.ply --openings 1000", false), CLI::ValidationError);
}

TEST_F(KindOptionsTest, ASingleInputIsGivenOnce) {
  EXPECT_THAT(Refusal("--target other.json"), HasSubstr("--target"));
  EXPECT_THAT(Refusal("other-film"), HasSubstr("other-film"));
  EXPECT_THAT(Refusal("--every 10001"), HasSubstr("--every: Value 10001 not in range"));
  EXPECT_THAT(Refusal("--every 1.5"), HasSubstr("--every"));
}

}  // namespace
}  // namespace weft
