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

TEST(SlurmOptions, EveryOptionHasItsLimits) {
  const auto is_valid = [](auto change) {
    SlurmOptions options = Usable();
    change(options);
    return options.Validate().ok();
  };
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.folder = ""; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.tasks = 100'000; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.tasks = 100'001; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.tasks = 0; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.tasks = -1; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.frames_per_task = 100'000; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.frames_per_task = 1; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.frames_per_task = 100'001; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.cpus_per_task = 1024; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.cpus_per_task = 1025; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.cpus_per_task = 0; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.memory_mib = int64_t{1} << 30; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.memory_mib = (int64_t{1} << 30) + 1; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.memory_mib = -1; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.time_limit_min = 525'600; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.time_limit_min = 525'601; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.time_limit_min = -1; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.scratch_mib = 1; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.scratch_mib = 0; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.scratch_mib = int64_t{1} << 30; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.scratch_mib = (int64_t{1} << 30) + 1; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.scratch_folder = "/tmp"; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.scratch_folder = "tmp"; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.lag_s = 0; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.lag_s = 3600; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.lag_s = 3600.5; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.query_s = 3600; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.query_s = 3600.5; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.worker_program = ""; }));
  EXPECT_TRUE(is_valid([](SlurmOptions& o) { o.extra = {"--constraint=ssd", "--exclusive"}; }));
  EXPECT_FALSE(is_valid([](SlurmOptions& o) { o.extra = {"--constraint=a\nb"}; }));
  for (const char* own : {"--output=x", "--hold", "--dependency=singleton", "--clusters=all", "--wait"})
    EXPECT_FALSE(is_valid([&](SlurmOptions& o) { o.extra = {"--exclusive", own}; })) << own;
}

TEST(PathMap, NeedsTwoAbsolutePaths) {
  for (const char* wrong : {"/a=b", "a=/b", "=/b", "/a="})
    EXPECT_FALSE(PathMap::Create({wrong}).ok()) << wrong;
  EXPECT_EQ(PathMap::Create({"/=/root/"})->OnNodes("/"), "/root");
  EXPECT_EQ(PathMap::Create({"/a=/b", "/a/c=/d"})->OnNodes("/a/c"), "/d");
  EXPECT_EQ(PathMap::Create({"/a/c=/d", "/a=/b"})->OnNodes("/a/c/e"), "/d/e");
  EXPECT_EQ(PathMap::Create({"/a=/b=c"})->OnNodes("/a/x"), "/b=c/x");
}

}  // namespace
}  // namespace weft
