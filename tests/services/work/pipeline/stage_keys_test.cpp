#include "services/work/pipeline/stage_keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <stop_token>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "services/work/pipeline/algorithm_versions.h"
#include "services/work/pipeline/frame_cloud.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class StageKeysTest : public ::testing::Test {
 protected:
  StageKeysTest() {
    inputs_.set_board("b");
    inputs_.set_rig("r");
    inputs_.set_garment("g");
  }
  // Where keys after this change part from those before; "-" where they do not.
  std::string FirstStageAfter(const std::function<void(v1::InputHashes&, v1::RegistrationOptions&)>& change) {
    v1::InputHashes inputs = inputs_;
    v1::RegistrationOptions options = options_;
    change(inputs, options);
    const auto first = FirstDifference(KeysOf(inputs_, options_), KeysOf(inputs, options));
    return first ? StageName(first->first) : "-";
  }
  std::string FirstStageOf(const std::function<void(v1::RegistrationOptions&)>& change) {
    return FirstStageAfter([&](v1::InputHashes&, v1::RegistrationOptions& options) { change(options); });
  }

  v1::InputHashes inputs_;
  v1::RegistrationOptions options_;
};

TEST_F(StageKeysTest, AgreeForEqualSettings) {
  EXPECT_EQ(FirstStageOf([](auto&) {}), "-");
  EXPECT_EQ(FirstStageOf([](auto& options) { options.set_preset("best"); }), "-") << "the default";
  EXPECT_EQ(FirstStageOf([](auto& options) { options.set_write_observations(true); }), "-")
      << "changes which files there are, not what is in them";
}

TEST_F(StageKeysTest, PartAtTheFirstStageThatReadsTheInput) {
  EXPECT_EQ(FirstStageAfter([](auto& inputs, auto&) { inputs.set_board("c"); }), "decode");
  EXPECT_EQ(FirstStageAfter([](auto& inputs, auto&) { inputs.set_rig("c"); }), "triangulate");
  EXPECT_EQ(FirstStageAfter([](auto& inputs, auto&) { inputs.set_garment("c"); }), "second_pass");
  options_.set_single_pass(true);
  EXPECT_EQ(FirstStageAfter([](auto& inputs, auto&) { inputs.set_garment("c"); }), "align");
}

TEST_F(StageKeysTest, PartAtTheStageOfTheOption) {
  EXPECT_EQ(FirstStageOf([](auto& options) { options.set_mosaic("bayer_rg8"); }), "decode");
  EXPECT_EQ(
      FirstStageOf([](auto& options) {
        options.mutable_pipeline()->mutable_triangulation()->mutable_consensus()->set_inlier_radius_mm(3);
      }),
      "triangulate");
  EXPECT_EQ(FirstStageOf([](auto& options) { options.set_single_pass(true); }), "second_pass");
  EXPECT_EQ(FirstStageOf([](auto& options) { options.set_scans("scans"); }), "align");
  EXPECT_EQ(FirstStageOf([](auto& options) {
              options.mutable_pipeline()->mutable_alignment()->set_continuation_rings(7);
            }),
            "align")
      << "the second pass looks where an alignment without options expects cells";
  EXPECT_EQ(FirstStageOf([](auto& options) { options.set_frames_alone(true); }), "refine");
}

// Who leaves a stage out of the key cannot compute it.
template <typename Stages>
constexpr bool kMayDecode = std::is_invocable_v<decltype(DecodeFrame), Stages, FrameImages, DecodeOptions,
                                                std::optional<size_t>, FrameProgress, std::stop_token>;
static_assert(kMayDecode<StageList<Stage::kDecode>>);
static_assert(kMayDecode<StageList<Stage::kTriangulate, Stage::kDecode>>);
static_assert(!kMayDecode<StageList<Stage::kTriangulate>>);
static_assert(!kMayDecode<StageList<>>);
static_assert(!kMayDecode<int>);

TEST_F(StageKeysTest, AreThoseOfTheStagesThatAreUsed) {
  const StageKeys all = KeysOf(inputs_, options_);
  EXPECT_TRUE(AreEqual(KeysOf(kAllStages, inputs_, options_), all));
  const StageKeys some = KeysOf(StageList<Stage::kAlign, Stage::kDecode>(), inputs_, options_);
  ASSERT_EQ(some.size(), 2);
  EXPECT_EQ(some[0].SerializeAsString(), all[3].SerializeAsString());
  EXPECT_EQ(some[1].SerializeAsString(), all[0].SerializeAsString());
  EXPECT_EQ(some[1].version(), AlgorithmVersion(Stage::kDecode));
}

TEST_F(StageKeysTest, SayWhy) {
  const StageKeys now = KeysOf(inputs_, options_);
  const auto why = [&now](const std::function<void(StageKeys&)>& change) {
    StageKeys was = now;
    change(was);
    const auto first = FirstDifference(was, now);
    return first ? first->why : "";
  };
  EXPECT_EQ(why([](StageKeys& keys) { keys[3].set_version(7); }),
            absl::StrCat("align has version ", AlgorithmVersion(Stage::kAlign), ", was 7"));
  EXPECT_EQ(why([](StageKeys& keys) { keys[1].set_inputs("s"); }), "triangulate has another rig");
  EXPECT_EQ(why([](StageKeys& keys) { keys[0].set_options("s"); }), "decode has other options");
  EXPECT_EQ(why([](StageKeys& keys) { keys[4].set_version(0); }), "refine was not done");
  EXPECT_THAT(why([](StageKeys& keys) { keys.Clear(); }), HasSubstr("0.1.2 or before"));
  EXPECT_THAT(why([](StageKeys& keys) { keys.RemoveLast(); }), HasSubstr("refine was not known"));
  EXPECT_EQ(why([](StageKeys& keys) {
              keys[4].set_version(9);
              keys[2].set_version(9);
            }),
            absl::StrCat("second_pass has version ", AlgorithmVersion(Stage::kSecondPass), ", was 9"))
      << "the first one";
}

// A neighbour's report is read from its file: of 0.1.2 or before, of a later version, or of something else.
TEST_F(StageKeysTest, OfNeighboursAreInputLikeAnyOther) {
  const StageKeys now = KeysOf(inputs_, options_);
  const std::function<void(StageKeys&)> changes[] = {
      [](StageKeys& keys) { keys.Clear(); },
      [](StageKeys& keys) { keys.RemoveLast(); },
      [](StageKeys& keys) { keys.DeleteSubrange(1, 4); },
      [](StageKeys& keys) { *keys.Add() = keys[0]; },
      [](StageKeys& keys) { keys[2].set_stage("dress"); },
      [](StageKeys& keys) { keys[4].set_version(-1); },
  };
  for (const auto& change : changes) {
    StageKeys theirs = now;
    change(theirs);
    EXPECT_TRUE(FirstDifference(now, theirs).has_value()) << theirs.size();
    EXPECT_TRUE(FirstDifference(theirs, now).has_value() || theirs.size() > now.size()) << theirs.size();
    EXPECT_FALSE(AreEqual(now, theirs));
  }
}

TEST(RedoneText, NamesWhatIsKept) {
  EXPECT_EQ(
      RedoneText("align", "align has version 2, was 1"),
      "computed again from align on, since align has version 2, was 1; observations and cloud are kept");
  EXPECT_EQ(RedoneText("decode", "decode has other options"),
            "computed again from decode on, since decode has other options");
}

}  // namespace
}  // namespace weft
