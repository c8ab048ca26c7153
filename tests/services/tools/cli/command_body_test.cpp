// weft body make, show.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "figure/body.h"
#include "services/formats/figure/body_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class CommandBody : public ::testing::Test {
 protected:
  CommandRun Make(std::vector<std::string> words) const {
    words.insert(words.begin(), {"body", "make", "--out", file_});
    return RunCommand(AddBodyCommand, std::move(words));
  }

  const TempFolder folder_;
  const std::string file_ = folder_ / "anna.body";
};

TEST_F(CommandBody, SizesAreFactorsAgainstThoseOfAnAveragePerson) {
  const CommandRun run =
      Make({"--stature-mm", "1620", "--girth", "1.1", "--waist-girth", "0.9", "--id", "anna"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr(file_ + ": 1620 mm tall, hash "));
  const auto body = ReadBody(file_);
  ASSERT_TRUE(body.ok()) << body.status();
  EXPECT_EQ(body->id, "anna");
  for (const BodyFactor& factor : BodyFactors()) {
    const double expected = factor.name == "stature"         ? 0.9  // of 1800 mm
                            : factor.name == "waist_girth"   ? 0.99
                            : factor.name.ends_with("girth") ? 1.1
                                                             : 1;
    EXPECT_NEAR(body->shape.*factor.value, expected, 1e-12) << factor.name;
  }
}

// Of an average person: 344 mm, 290, 255, 420 and 410.
TEST_F(CommandBody, TellsHowLongLimbsAre) {
  const CommandRun run = Make({"--arm-length", "1.1", "--leg-length", "0.9", "--shoulder-width", "1.2"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out,
              ::testing::EndsWith(
                  "belly_depth       1.000\nshoulder joints 413 mm apart, upper arm 319, forearm 280, "
                  "thigh 378, shin 369 mm\n"));
}

TEST_F(CommandBody, ASeedMakesTheSamePersonAgain) {
  std::vector<std::string> hashes;
  for (const char* seed : {"7", "7", "8"}) {
    ASSERT_TRUE(Make({"--seed", seed}).status.ok());
    hashes.push_back(BodyHash(ReadBody(file_)->shape));
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_NE(hashes[0], hashes[2]);
  ASSERT_TRUE(Make({}).status.ok());
  EXPECT_EQ(BodyHash(ReadBody(file_)->shape), BodyHash(BodyShape()));
}

TEST_F(CommandBody, SizesOfNobodyAreRefusedBeforeAFileIsWritten) {
  const CommandRun tall = Make({"--stature-mm", "3000"});
  EXPECT_EQ(tall.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(tall.message(), AllOf(HasSubstr("stature is 1.66"), HasSubstr("0.7 to 1.4")));
  EXPECT_EQ(Make({"--leg-length", "nan"}).status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(Make({"--stature", "1.1", "--stature-mm", "1900"}).message(), HasSubstr("excludes"));
  EXPECT_FALSE(std::filesystem::exists(file_));
}

TEST_F(CommandBody, ShowsSizesAndWritesTheBodyAsAMesh) {
  ASSERT_TRUE(Make({"--arm-length", "1.05"}).status.ok());
  const std::string mesh_file = folder_ / "anna.ply";
  const CommandRun run = RunCommand(AddBodyCommand, {"body", "show", file_, "--mesh", mesh_file});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, AllOf(HasSubstr("1800 mm tall"), HasSubstr("arm_length        1.050\n"),
                             HasSubstr(mesh_file + ": the body")));
  const auto mesh = ReadMesh(mesh_file);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->faces, Body::MeshFaces());
  // From the soles to the crown, y down, about as tall as it says.
  double low = 1e9, high = -1e9;
  for (const Eigen::Vector3d& v : mesh->vertices_mm) low = std::min(low, v.y()), high = std::max(high, v.y());
  EXPECT_NEAR(high - low, 1800, 150);
  EXPECT_EQ(RunCommand(AddBodyCommand, {"body", "show", folder_ / "none.body"}).status.code(),
            absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
