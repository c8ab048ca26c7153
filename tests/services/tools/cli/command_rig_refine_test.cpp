// weft rig refine.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <random>

#include "services/formats/files/observations_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/verdict/verdict.h"
#include "services/tools/cli/commands.h"
#include "simulation/studio_rig.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_aloud.h"
#include "weft/v1/calibration.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// A tube of cells before ten cameras, of which c03 was knocked after the calibration.
class CommandRigRefine : public ::testing::Test {
 protected:
  CommandRigRefine() {
    filmed_ =
        MakeStudioRig("studio",
                      {.cameras = 10, .distance_mm = 2000, .object_width_mm = 400, .object_height_mm = 600})
            .value();
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 0.1);
    std::vector<ImageObservations> images;
    for (const CameraModel& camera : filmed_.cameras) images.push_back({camera.id, {}});
    for (int row = 0; row < 30; ++row)
      for (int col = 0; col < 50; ++col) {
        const double angle = 0.12 * col;
        const Eigen::Vector3d normal(std::cos(angle), 0, std::sin(angle));
        const Eigen::Vector3d point = 150 * normal + Eigen::Vector3d(0, 16.0 * (row - 15), 0);
        for (size_t c = 0; c < images.size(); ++c) {
          if (normal.dot((filmed_.cameras[c].CenterWorld() - point).normalized()) < 0.2) continue;
          const auto pixel = filmed_.cameras[c].Project(point);
          if (!pixel || !filmed_.cameras[c].Contains(*pixel)) continue;
          const double x = noise(random), y = noise(random);
          images[c].observations.push_back(
              {pixel->x() + x, pixel->y() + y, {row, col, NodeKind::kCenter}, 0.1f, 1});
        }
      }
    std::filesystem::create_directories(folder_ / "result/0000");
    EXPECT_TRUE(WriteObservations(folder_ / "result/0000/observations.csv", images).ok());
    Rig before = filmed_;
    CameraModel& camera = before.cameras[3];
    const Eigen::Vector3d center = camera.CenterWorld();
    camera.rotation = Eigen::AngleAxisd(0.001, Eigen::Vector3d::UnitX()) * camera.rotation;
    camera.translation_mm = -camera.rotation * center;
    EXPECT_TRUE(WriteRig(folder_ / "rig.json", before).ok());
  }
  AloudRun Refine(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"refine", folder_ / "result", "--rig", folder_ / "rig.json", "--out", out_});
    return RunAloud(AddRigRefineCommand, std::move(more));
  }

  const TempFolder folder_;
  const std::string out_ = folder_ / "new.json";
  Rig filmed_;
};

TEST_F(CommandRigRefine, WritesTheRigAndTellsWhichCameraMoved) {
  const AloudRun run = Refine();
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr("\ncamera " + filmed_.cameras[3].id + " moved: turned by 0.0"));
  const auto rig = ReadRig(out_);
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_THAT(run.out, testing::EndsWith("\nrig      " + out_ + " (hash " + rig->ContentHash() + ")\n"));
  const Eigen::AngleAxisd off(rig->cameras[3].rotation * filmed_.cameras[3].rotation.transpose());
  EXPECT_LT(off.angle(), 0.0003);
  const AloudRun refused = Refine();
  EXPECT_EQ(refused.status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(refused.message(), HasSubstr("a rig, which takes may need"));
  const AloudRun json = Refine({"--force", "--json"});
  const auto report = FromJson<v1::RigRefinementReport>(json.out);
  EXPECT_TRUE(report.cameras(3).moved());
  EXPECT_EQ(report.rig_hash(), rig->ContentHash());
}

TEST_F(CommandRigRefine, WhereCamerasAreExchangedNothingIsWritten) {
  Rig exchanged = filmed_;
  std::swap(exchanged.cameras[2].id, exchanged.cameras[6].id);
  ASSERT_TRUE(WriteRig(folder_ / "rig.json", exchanged).ok());
  const AloudRun run = Refine();
  EXPECT_TRUE(IsVerdict(run.status)) << run.status;
  EXPECT_THAT(run.out, StartsWith("bad: "));
  EXPECT_THAT(run.out, testing::EndsWith("\nrig      " + out_ + " was not written\n"));
  EXPECT_FALSE(std::filesystem::exists(out_));
  EXPECT_TRUE(IsVerdict(Refine({"--json"}).status));
}

}  // namespace
}  // namespace weft
