#include "capture/rig/yaml_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(YamlFields, AreFoundHoweverTheyAreSpelt) {
  const YAML::Node map = YAML::Load("{Camera_Matrix: 1, k: 2}");
  EXPECT_EQ(YamlKey("Camera_Matrix"), YamlKey("camera_matrix"));
  EXPECT_EQ(YamlField(map, {"camera_matrix"}).as<int>(), 1);
  EXPECT_EQ(YamlField(map, {"no", "k"}).as<int>(), 2);
  EXPECT_TRUE(YamlField(map, {"no"}).IsNull());
  EXPECT_EQ(YamlSpelling(map, {"camera_matrix"}), "Camera_Matrix");
  EXPECT_EQ(YamlSpelling(map, {"no"}), "");
}

TEST(YamlFields, HaveNumbersInSequencesAndInMatrices) {
  EXPECT_THAT(*YamlNumbers(YAML::Load("[1, -2.5, 3e2]"), "D"), ElementsAre(1, -2.5, 300));
  EXPECT_THAT(*YamlNumbers(YAML::Load("{rows: 1, cols: 2, data: [4, 5]}"), "K"), ElementsAre(4, 5));
  EXPECT_THAT(*YamlNumbers(YamlField(YAML::Load("{a: 1}"), {"b"}), "D"), IsEmpty());
  const absl::Status text = YamlNumbers(YAML::Load("[1, two]"), "D").status();
  EXPECT_EQ(text.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(text.message()), HasSubstr("D"));
  EXPECT_EQ(YamlNumbers(YAML::Load("[1, 2]"), "T", 3).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(YamlNumbers(YAML::Load("[1, 2, 3]"), "T", 3).ok());
}

}  // namespace
}  // namespace weft
