#include "services/formats/figure/body_file.h"

#include <gtest/gtest.h>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(BodyFile, KeepsAllFactors) {
  const NamedBody body = {"anna", RandomBodyShape(3)};
  const TempFolder folder;
  ASSERT_TRUE(WriteBody(folder / "anna.body", body).ok());
  const absl::StatusOr<NamedBody> read = ReadBody(folder / "anna.body");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->id, "anna");
  EXPECT_EQ(read->shape, body.shape);
  EXPECT_EQ(BodyHash(read->shape), BodyHash(body.shape));
}

TEST(BodyFile, EveryFactorIsAFieldOfItsNameAndPartOfTheHash) {
  for (const BodyFactor& factor : BodyFactors()) {
    const absl::StatusOr<NamedBody> body =
        ParseBody("{\"" + std::string(factor.name) + "\": 1.25}", "anna.body");
    ASSERT_TRUE(body.ok()) << body.status();
    BodyShape expected;
    expected.*factor.value = 1.25;
    EXPECT_EQ(body->shape, expected) << factor.name;
    EXPECT_NE(BodyHash(expected), BodyHash(BodyShape())) << factor.name;
  }
}

TEST(BodyFile, SaysWhatIsWrongWithAFile) {
  const auto message = [](const std::string& json) {
    const absl::StatusOr<NamedBody> body = ParseBody(json, "anna.body");
    EXPECT_EQ(body.status().code(), absl::StatusCode::kInvalidArgument) << json;
    return std::string(body.status().message());
  };
  EXPECT_NE(message("{\"waist_girth\": 3}").find("anna.body: body: waist_girth is 3"), std::string::npos);
  EXPECT_NE(message("{\"waist_girth\": \"NaN\"}").find("waist_girth"), std::string::npos);
  EXPECT_NE(message("{\"tail_length\": 1}").find("tail_length"), std::string::npos);
  EXPECT_NE(message("solid anna").find("anna.body"), std::string::npos);
  EXPECT_EQ(ReadBody("/nowhere/anna.body").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
