#include "services/work/slurm/slurm_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/work/slurm/slurm_commands.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

SlurmOptions Usable() {
  SlurmOptions options;
  options.folder = "/shared/weft";
  options.worker_program = "/usr/bin/weft-worker";
  return options;
}

TEST(SlurmOptions, NamesTheOptionThatIsWrong) {
  EXPECT_TRUE(Usable().Validate().ok());
  const auto error_of = [](auto change) {
    SlurmOptions options = Usable();
    change(options);
    return std::string(options.Validate().message());
  };
  EXPECT_THAT(error_of([](SlurmOptions& o) { o.folder = "shared"; }), HasSubstr("--slurm-folder: shared"));
  EXPECT_THAT(error_of([](SlurmOptions& o) { o.frames_per_task = 0; }),
              HasSubstr("--slurm-frames-per-task: 0"));
  EXPECT_THAT(error_of([](SlurmOptions& o) { o.lag_s = -1; }), HasSubstr("--slurm-lag-s"));
  EXPECT_THAT(error_of([](SlurmOptions& o) { o.query_s = 0; }), HasSubstr("--slurm-query-s"));
  EXPECT_THAT(error_of([](SlurmOptions& o) { o.extra = {"-p main"}; }), HasSubstr("option of sbatch"));
  EXPECT_THAT(error_of([](SlurmOptions& o) { o.extra = {"--array=0-3"}; }), HasSubstr("set by weftd itself"));
  EXPECT_THAT(error_of([](SlurmOptions& o) { o.mapped_paths = {"/a"}; }), HasSubstr("HERE=THERE"));
}

TEST(PathMap, MapsTheLongestFolder) {
  const auto map = PathMap::Create({"/data=/mnt/data/", "/data/fast=/scratch"});
  ASSERT_TRUE(map.ok());
  EXPECT_EQ(map->OnNodes("/data/take"), "/mnt/data/take");
  EXPECT_EQ(map->OnNodes("/data/fast/take"), "/scratch/take");
  EXPECT_EQ(map->OnNodes("/data"), "/mnt/data");
  EXPECT_EQ(map->OnNodes("/database"), "/database");
}

TEST(PathMap, MapsAllPathsOfATask) {
  const auto map = PathMap::Create({"/data=/mnt"});
  v1::Task task;
  v1::RegistrationSpec& spec = *task.mutable_spec();
  for (std::string* path : {spec.mutable_dump(), spec.mutable_rig(), spec.mutable_board(),
                            spec.mutable_garment(), spec.mutable_driving()->mutable_avatar(),
                            spec.mutable_out(), task.mutable_state_folder(), task.add_allowed_paths()}) {
    *path = "/data/x";
  }
  ASSERT_TRUE(map->Apply(task).ok());
  for (const std::string& path :
       {spec.dump(), spec.rig(), spec.board(), spec.garment(), spec.driving().avatar(), spec.out(),
        task.state_folder(), task.allowed_paths(0)}) {
    EXPECT_EQ(path, "/mnt/x");
  }
  spec.mutable_options()->set_scans("/data/scans");
  EXPECT_THAT(std::string(map->Apply(task).message()), HasSubstr("/data/scans: nodes see it as /mnt/scans"));
}

TEST(SlurmCommands, KnowsWhatSbatchRefusesForGood) {
  EXPECT_TRUE(IsRefusedForGood("sbatch: error: invalid partition specified: fast"));
  EXPECT_TRUE(
      IsRefusedForGood("sbatch: error: Batch job submission failed: Requested time limit is invalid "
                       "(missing or exceeds some limit)"));
  EXPECT_TRUE(IsRefusedForGood("Requested node configuration is not available"));
  EXPECT_FALSE(IsRefusedForGood("Unable to contact slurm controller (connect failure)"));
  EXPECT_FALSE(IsRefusedForGood("Socket timed out on send/recv operation"));
}

TEST(SlurmCommands, NamesTheCommandThatIsMissing) {
  const absl::Status status = SlurmCommands::Find("/nonexistent").status();
  EXPECT_TRUE(absl::IsNotFound(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("sbatch"));
}

}  // namespace
}  // namespace weft
