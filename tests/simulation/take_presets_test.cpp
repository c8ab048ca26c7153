#include "simulation/take_presets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace weft {
namespace {

TEST(SyntheticPreset, UnknownNamesAreAnsweredWithTheKnownOnes) {
  const auto preset = SyntheticPreset("huge", 1);
  EXPECT_EQ(preset.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(preset.status().message().find("tiny, quickstart"), std::string::npos);
}

// One preset wants its rig from the user.
TEST(SyntheticPreset, EachThatIsListedIsThereAndValid) {
  std::set<std::string> names;
  for (const TakePreset& listed : TakePresets()) {
    EXPECT_TRUE(names.insert(listed.name).second) << listed.name;
    EXPECT_FALSE(listed.about.empty()) << listed.name;
    const auto options = SyntheticPreset(listed.name, 3);
    ASSERT_TRUE(options.ok()) << options.status();
    const absl::Status status = options->Validate();
    if (listed.name == "tshirt-rig") {
      EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("--rig"));
    } else {
      EXPECT_TRUE(status.ok()) << listed.name << ": " << status;
    }
    EXPECT_EQ(options->name, "synthetic-" + listed.name + "-3");
  }
}

TEST(SyntheticPreset, EachPartHasASeedThatFollowsFromTheOne) {
  const auto one = SyntheticPreset("tiny", 1), again = SyntheticPreset("tiny", 1),
             two = SyntheticPreset("tiny", 2);
  ASSERT_TRUE(one.ok() && again.ok() && two.ok());
  const auto seeds = [](const SyntheticTakeOptions& options) {
    return std::vector<uint64_t>{
        options.seed,           options.performance.seed, options.rig.seed,
        options.look.inks.seed, options.look.fabric.seed, options.camera.sensor.seed};
  };
  EXPECT_EQ(seeds(*one), seeds(*again));
  const std::vector<uint64_t> a = seeds(*one), b = seeds(*two);
  for (size_t i = 0; i < a.size(); ++i) EXPECT_NE(a[i], b[i]) << i;
  EXPECT_EQ(std::set<uint64_t>(a.begin(), a.end()).size(), a.size());
}

}  // namespace
}  // namespace weft
