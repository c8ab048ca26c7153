#include "services/work/slurm/task_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class TaskFolderTest : public ::testing::Test {
 protected:
  TaskFolderTest() {
    std::string name = (std::filesystem::temp_directory_path() / "weft tasks XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TaskFolderTest() override { std::filesystem::remove_all(path_); }

  std::string path_;
};

TEST_F(TaskFolderTest, QuotesPathsForTheShell) {
  EXPECT_EQ(ShellWord("it's"), "'it'\\''s'");
  SlurmOptions options;
  options.worker_program = "/opt/a b/weft-worker";
  options.memory_mib = 900;
  const std::string text = ScriptText("/shared/my job", options, "module load weft");
  EXPECT_THAT(text, HasSubstr("module load weft\nexec '/opt/a b/weft-worker' '/shared/my job'/task-"));
  EXPECT_THAT(text, HasSubstr("--events '/shared/my job'/events-\"$SLURM_ARRAY_TASK_ID\""));
  EXPECT_THAT(text, HasSubstr("--memory-mib 900"));
}

TEST_F(TaskFolderTest, EventsAreReadOnceAndWhole) {
  EventReader reader(path_ + "/events-0");
  EXPECT_TRUE(reader.Read().empty());
  EXPECT_FALSE(reader.exists());
  std::ofstream file(path_ + "/events-0", std::ios::app);
  file << R"({"started": {"frame": "0001"}})"
       << "\nno event\n"
       << R"({"finished": )" << std::flush;
  std::vector<v1::WorkerEvent> events = reader.Read();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].started().frame(), "0001");
  EXPECT_TRUE(reader.exists());
  file << R"({"frame": "0001"}})"
       << "\n"
       << std::flush;
  events = reader.Read();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].finished().frame(), "0001");
  EXPECT_TRUE(reader.Read().empty());
}

TEST_F(TaskFolderTest, KeepsLogsInWhichSomethingStands) {
  const TaskFolder folder(path_ + "/array");
  const v1::Task task;
  ASSERT_TRUE(folder.Write({&task, &task}, SlurmOptions(), PathMap()).ok());
  EXPECT_TRUE(folder.CheckRoom().ok());
  std::ofstream(folder.LogFile(0)) << "";
  std::ofstream(folder.LogFile(1)) << "first\nsecond\n";
  EXPECT_EQ(folder.LastWords(1), "first | second");
  folder.Remove(0);
  folder.Remove(1);
  folder.RemoveIfEmpty();
  EXPECT_TRUE(std::filesystem::exists(folder.LogFile(1)));
  std::filesystem::remove(folder.LogFile(1));
  folder.RemoveIfEmpty();
  EXPECT_FALSE(std::filesystem::exists(folder.path()));
}

TEST_F(TaskFolderTest, NamesASetupFileThatIsMissing) {
  SlurmOptions options;
  options.setup_file = path_ + "/setup.sh";
  const absl::Status status = TaskFolder(path_ + "/array").Write({}, options, PathMap());
  EXPECT_TRUE(absl::IsNotFound(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("setup.sh"));
}

TEST_F(TaskFolderTest, ScriptsHaveOneLineForEachThing) {
  SlurmOptions options;
  options.worker_program = "/bin/worker";
  options.lag_s = 30.5;
  const std::string begin = "#!/bin/sh\n# Written by weftd. Runs one task of a job.\n";
  const std::string exec =
      "exec '/bin/worker' '/f'/task-\"$SLURM_ARRAY_TASK_ID\".json --events "
      "'/f'/events-\"$SLURM_ARRAY_TASK_ID\" "
      "--patience-s 31";
  EXPECT_EQ(ScriptText("/f", options, ""), begin + exec + "\n");
  options.memory_mib = 1;
  EXPECT_EQ(ScriptText("/f", options, "set -e\n"), begin + "set -e\n" + exec + " --memory-mib 1\n");
}

TEST_F(TaskFolderTest, TasksGetPathsAndScratchOfTheNodes) {
  const TaskFolder folder(path_ + "/array");
  SlurmOptions options;
  options.worker_program = "/bin/worker";
  options.allowed_paths = {"/data", "/home"};
  options.state_folder = "/data/state";
  options.scratch_folder = "/tmp/scratch";
  options.scratch_mib = 77;
  v1::Task first, second;
  first.set_id("a.1"), second.set_id("a.2");
  first.mutable_spec()->set_out("/data/out");
  ASSERT_TRUE(folder.Write({&first, &second}, options, *PathMap::Create({"/data=/mnt"})).ok());
  auto left = folder.TasksLeft(2);
  ASSERT_EQ(left.size(), 2u);
  EXPECT_EQ(left[0].first, 0);
  EXPECT_EQ(left[0].second.id(), "a.1");
  EXPECT_EQ(left[0].second.spec().out(), "/mnt/out");
  EXPECT_EQ(left[0].second.state_folder(), "/mnt/state");
  EXPECT_THAT(left[0].second.allowed_paths(), ::testing::ElementsAre("/mnt", "/home"));
  EXPECT_EQ(left[0].second.scratch_folder(), "/tmp/scratch");
  EXPECT_EQ(left[0].second.scratch_mib(), 77);
  EXPECT_EQ(left[1].first, 1);
  EXPECT_EQ(folder.TasksLeft(1).size(), 1u);
  folder.Remove(0);
  left = folder.TasksLeft(2);
  ASSERT_EQ(left.size(), 1u);
  EXPECT_EQ(left[0].second.id(), "a.2");
  options.scratch_folder = "";
  ASSERT_TRUE(folder.Write({&first}, options, PathMap()).ok());
  EXPECT_EQ(folder.TasksLeft(1)[0].second.scratch_mib(), 0);
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/room"));
  first.mutable_spec()->mutable_options()->set_scans("/data/scans");
  EXPECT_FALSE(folder.Write({&first}, options, *PathMap::Create({"/data=/mnt"})).ok());
}

TEST_F(TaskFolderTest, TheLastWordsAreTheEndOfTheLog) {
  const TaskFolder folder(path_);
  EXPECT_EQ(folder.LastWords(0), "");
  std::ofstream(folder.LogFile(0)) << std::string(100, 'a') << "\n\n  \n" << std::string(599, 'b') << "\n";
  EXPECT_EQ(folder.LastWords(0), std::string(599, 'b'));
  std::ofstream(folder.LogFile(1)) << "a\n" << std::string(598, 'b');
  EXPECT_EQ(folder.LastWords(1), "a | " + std::string(598, 'b'));
}

TEST_F(TaskFolderTest, RemoveLeavesOthersAndLogsWithWords) {
  const TaskFolder folder(path_);
  for (const int index : {0, 1})
    for (const std::string& file : {folder.TaskFile(index), folder.EventFile(index), folder.LogFile(index)})
      std::ofstream(file) << (index == 1 && file == folder.LogFile(1) ? "words" : "");
  folder.Remove(0);
  EXPECT_FALSE(std::filesystem::exists(folder.TaskFile(0)));
  EXPECT_FALSE(std::filesystem::exists(folder.EventFile(0)));
  EXPECT_FALSE(std::filesystem::exists(folder.LogFile(0)));
  EXPECT_TRUE(std::filesystem::exists(folder.TaskFile(1)));
  folder.Remove(1);
  EXPECT_FALSE(std::filesystem::exists(folder.EventFile(1)));
  EXPECT_TRUE(std::filesystem::exists(folder.LogFile(1)));
}

}  // namespace
}  // namespace weft
