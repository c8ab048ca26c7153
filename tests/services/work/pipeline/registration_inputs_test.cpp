#include "services/work/pipeline/registration_inputs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::RegistrationSpec Range(int first, int end) {
  v1::RegistrationSpec spec;
  spec.set_dump("take");
  spec.set_first_frame(first);
  spec.set_end_frame(end);
  return spec;
}

TEST(FramesInRange, TakesAllFramesByDefaultAndTheEndIsOpen) {
  const std::vector<std::string> names = {"0007", "0008", "0009"};
  EXPECT_THAT(*FramesInRange(Range(0, 0), names), ElementsAre(0, 1, 2));
  EXPECT_THAT(*FramesInRange(Range(1, 0), names), ElementsAre(1, 2));
  EXPECT_THAT(*FramesInRange(Range(1, 2), names), ElementsAre(1));
}

TEST(FramesInRange, RefusesRangesOutsideTheDumpAndSaysWhatItHolds) {
  const std::vector<std::string> names = {"0007", "0008", "0009"};
  for (const auto& [first, end] : {std::pair(0, 4), {3, 0}, {2, 2}, {2, 1}, {-1, 2}, {0, -1}}) {
    const auto range = FramesInRange(Range(first, end), names);
    ASSERT_EQ(range.status().code(), absl::StatusCode::kInvalidArgument) << first << ":" << end;
    EXPECT_THAT(std::string(range.status().message()), HasSubstr("holds 3 frame(s), 0007 to 0009"));
  }
}

TEST(LoadInputs, NamesTheFieldThatIsEmptyOrNoPath) {
  v1::RegistrationSpec spec;
  spec.set_dump("take");
  spec.set_rig("rig.json");
  spec.set_out("out");
  spec.set_garment("shirt");
  EXPECT_THAT(std::string(LoadInputs(spec).status().message()), HasSubstr("field spec.board"));
  spec.set_board(std::string("a\0b", 3));
  EXPECT_EQ(LoadInputs(spec).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(LoadInputs(spec).status().message()), HasSubstr("zero byte"));
}

TEST(LoadInputs, RefusesUnknownPresetsBeforeAnythingIsRead) {
  v1::RegistrationSpec spec;
  for (auto* field : {spec.mutable_dump(), spec.mutable_rig(), spec.mutable_board(), spec.mutable_out(),
                      spec.mutable_garment()}) {
    *field = "/nowhere";
  }
  spec.mutable_options()->set_preset("fastest");
  const absl::Status status = LoadInputs(spec).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("\"fastest\" is unknown; it is best or paper"));
  spec.mutable_options()->set_preset("paper");
  EXPECT_EQ(LoadInputs(spec).status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
