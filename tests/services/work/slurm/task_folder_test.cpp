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

}  // namespace
}  // namespace weft
