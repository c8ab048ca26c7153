// weft rig import, export.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/files/rig_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Two cameras 3 m before what they look at, 1.5 m apart; lengths in this unit of so many mm.
std::string KrtOfTwo(double mm) {
  const auto camera = [mm](const std::string& id, double x_mm) {
    return id + "\n4000 0 300\n0 4000 300\n0 0 1\n0 0 0 0 0\n1 0 0 " + std::to_string(x_mm / mm) +
           "\n0 1 0 0\n0 0 1 " + std::to_string(3000 / mm) + "\n";
  };
  return camera("a", 0) + camera("b", 1500);
}

class CommandRig : public ::testing::Test {
 protected:
  CommandRun Rig(std::vector<std::string> words) const {
    words.insert(words.begin(), "rig");
    return RunCommand(AddRigCommand, std::move(words));
  }
  CommandRun ImportKrt(double mm, std::vector<std::string> more = {}) const {
    WriteBytes(folder_ / "KRT", KrtOfTwo(mm));
    std::vector<std::string> words = {"import",      "--krt", folder_ / "KRT", "--width-px", "600",
                                      "--height-px", "600",   "--out",         rig_file_};
    words.insert(words.end(), more.begin(), more.end());
    return Rig(words);
  }

  const TempFolder folder_;
  const std::string rig_file_ = folder_ / "rig.json";
};

TEST_F(CommandRig, LengthsMayBeInAUnitByItsNameOrByItsSize) {
  ASSERT_TRUE(ImportKrt(1000, {"--unit", "m"}).status.ok());
  EXPECT_EQ(ReadRig(rig_file_)->cameras[1].translation_mm, Eigen::Vector3d(1500, 0, 3000));
  ASSERT_TRUE(ImportKrt(25.4, {"--mm-per-unit", "25.4"}).status.ok());
  EXPECT_NEAR(ReadRig(rig_file_)->cameras[1].translation_mm.x(), 1500, 1e-3);
  EXPECT_THAT(ImportKrt(1, {"--unit", "mm", "--mm-per-unit", "1"}).message(), HasSubstr("excludes"));
}

TEST_F(CommandRig, OneSourceIsGivenAndKrtNeedsTheSizeOfImages) {
  WriteBytes(folder_ / "KRT", KrtOfTwo(1));
  const CommandRun no_size = Rig({"import", "--krt", folder_ / "KRT", "--out", rig_file_});
  EXPECT_EQ(no_size.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(no_size.message(), HasSubstr("--width-px and --height-px are needed"));
  EXPECT_FALSE(Rig({"import", "--out", rig_file_}).status.ok());
  EXPECT_FALSE(Rig({"import", "--krt", "a", "--opencv", "b", "--out", rig_file_}).status.ok());
  EXPECT_FALSE(std::filesystem::exists(rig_file_));
}

TEST_F(CommandRig, EveryFormatThatIsExportedCanBeImported) {
  ASSERT_TRUE(ImportKrt(1, {"--id", "studio"}).status.ok());
  const auto before = ReadRig(rig_file_);
  ASSERT_TRUE(before.ok()) << before.status();
  EXPECT_EQ(before->id, "studio");
  const auto there_and_back = [&](const std::string& format, std::vector<std::string> import) {
    const std::string other = folder_ / format;
    const CommandRun exported = Rig({"export", rig_file_, "--format", format, "--out", other});
    ASSERT_TRUE(exported.status.ok()) << exported.status;
    EXPECT_EQ(exported.out, other + ": 2 cameras\n");
    import.insert(import.begin(), "import");
    import.insert(import.end(), {"--" + format, other, "--out", folder_ / "back.json"});
    const CommandRun imported = Rig(import);
    ASSERT_TRUE(imported.status.ok()) << imported.status;
    const auto back = ReadRig(folder_ / "back.json");
    ASSERT_TRUE(back.ok()) << back.status();
    const Eigen::Vector3d point_mm(20, -30, 40);
    for (size_t c = 0; c < 2; ++c) {
      EXPECT_EQ(back->cameras[c].id, before->cameras[c].id) << format;
      EXPECT_LT((*back->cameras[c].Project(point_mm) - *before->cameras[c].Project(point_mm)).norm(), 1e-9);
    }
  };
  there_and_back("krt", {"--width-px", "600", "--height-px", "600"});
  there_and_back("opencv", {});
  there_and_back("colmap", {});
  EXPECT_EQ(ReadBytes(folder_ / "colmap/points3D.txt"), "");
}

TEST_F(CommandRig, ColmapsBinaryModelIsAnsweredWithTheCommandThatConvertsIt) {
  WriteBytes(folder_ / "sparse/cameras.bin", "x");
  const CommandRun run = Rig({"import", "--colmap", folder_ / "sparse", "--out", rig_file_});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(run.message(), AllOf(HasSubstr(folder_ / "sparse"), HasSubstr("colmap model_converter")));
  std::filesystem::remove(folder_ / "sparse/cameras.bin");
  EXPECT_EQ(Rig({"import", "--colmap", folder_ / "sparse", "--out", rig_file_}).status.code(),
            absl::StatusCode::kNotFound);
}

TEST_F(CommandRig, ACalibratedRigIsReplacedByForceAlone) {
  ASSERT_TRUE(ImportKrt(1).status.ok());
  weft::Rig rig = *ReadRig(rig_file_);
  ASSERT_TRUE(ImportKrt(1).status.ok());  // one that was imported can be imported again
  rig.cameras[0].fx_px += 1;
  CalibrationRecord record;
  record.cameras.resize(2);
  ASSERT_TRUE(WriteRig(rig_file_, rig, "", &record).ok());
  const CommandRun refused = ImportKrt(1);
  EXPECT_EQ(refused.status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(refused.message(), AllOf(HasSubstr("a calibrated rig"), HasSubstr("--force")));
  EXPECT_EQ(ReadRig(rig_file_)->ContentHash(), rig.ContentHash());
  EXPECT_TRUE(ImportKrt(1, {"--force"}).status.ok());
}

}  // namespace
}  // namespace weft
