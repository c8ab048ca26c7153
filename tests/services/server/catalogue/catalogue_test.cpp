#include "services/server/catalogue/catalogue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

v1::Job MakeJob(const std::string& id, v1::JobState state = v1::JOB_STATE_QUEUED) {
  v1::Job job;
  job.set_id(id);
  job.set_state(state);
  job.mutable_spec()->set_dump("/takes/" + id);
  return job;
}

std::vector<v1::FrameInfo> MakeFrames(int count) {
  std::vector<v1::FrameInfo> frames(count);
  for (int i = 0; i < count; ++i) {
    frames[i].set_frame(std::to_string(i));
    frames[i].set_state(v1::FRAME_STATE_WAITING);
  }
  return frames;
}

class CatalogueTest : public ::testing::Test {
 protected:
  std::unique_ptr<Catalogue> Open() {
    absl::StatusOr<std::unique_ptr<Catalogue>> catalogue = Catalogue::Open(path_);
    EXPECT_TRUE(catalogue.ok()) << catalogue.status();
    return catalogue.ok() ? *std::move(catalogue) : nullptr;
  }

  // Paths in the folder whose names hold that text.
  std::vector<std::string> FilesLike(const std::string& text) {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      if (entry.path().filename().string().find(text) != std::string::npos) found.push_back(entry.path());
    }
    return found;
  }

  TempFolder folder_;
  const std::string path_ = folder_ / "catalogue.sqlite";
};

TEST_F(CatalogueTest, RemembersJobsAndFramesAfterReopening) {
  {
    const auto catalogue = Open();
    ASSERT_TRUE(catalogue->AddJob(MakeJob("a"), MakeFrames(3)).ok());
    v1::FrameInfo info = MakeFrames(3)[1];
    info.set_state(v1::FRAME_STATE_FAILED);
    info.set_reason("too dark");
    info.set_attempts(2);
    ASSERT_TRUE(catalogue->Update(MakeJob("a"), {{1, info}}).ok());
  }
  const auto catalogue = Open();
  const auto job = catalogue->ReadJob("a");
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->spec().dump(), "/takes/a");
  const auto frames = catalogue->ReadFrames("a");
  ASSERT_TRUE(frames.ok());
  ASSERT_EQ(frames->size(), 3u);
  EXPECT_EQ((*frames)[0].state(), v1::FRAME_STATE_WAITING);
  EXPECT_EQ((*frames)[1].reason(), "too dark");
  EXPECT_EQ((*frames)[1].attempts(), 2);
  EXPECT_EQ((*frames)[2].frame(), "2");
}

TEST_F(CatalogueTest, ListsNewestFirstAndUnfinishedOldestFirst) {
  const auto catalogue = Open();
  ASSERT_TRUE(catalogue->AddJob(MakeJob("a"), {}).ok());
  ASSERT_TRUE(catalogue->AddJob(MakeJob("b"), {}).ok());
  ASSERT_TRUE(catalogue->AddJob(MakeJob("c"), {}).ok());
  ASSERT_TRUE(catalogue->Update(MakeJob("b", v1::JOB_STATE_DONE), {}).ok());
  const auto all = catalogue->ListJobs(2);
  ASSERT_TRUE(all.ok());
  ASSERT_EQ(all->size(), 2u);
  EXPECT_EQ((*all)[0].id(), "c");
  EXPECT_EQ((*all)[1].id(), "b");
  const auto unfinished = catalogue->UnfinishedJobs();
  ASSERT_TRUE(unfinished.ok());
  ASSERT_EQ(unfinished->size(), 2u);
  EXPECT_EQ((*unfinished)[0].id(), "a");
  EXPECT_EQ((*unfinished)[1].id(), "c");
}

TEST_F(CatalogueTest, RemovesEndedJobsWithTheirFrames) {
  const auto catalogue = Open();
  for (const char* id : {"a", "b", "c", "d"}) {
    ASSERT_TRUE(
        catalogue->AddJob(MakeJob(id, *id == 'b' ? v1::JOB_STATE_RUNNING : v1::JOB_STATE_DONE), MakeFrames(2))
            .ok());
  }
  const auto ended = catalogue->EndedJobs(1, 10);
  ASSERT_TRUE(ended.ok());
  ASSERT_EQ(ended->size(), 2u);
  EXPECT_EQ((*ended)[0].id(), "c");
  EXPECT_EQ((*ended)[1].id(), "d");
  ASSERT_TRUE(catalogue->RemoveJob("c").ok());
  EXPECT_EQ(catalogue->ReadJob("c").status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(catalogue->ReadFrames("c")->empty());
  EXPECT_EQ(catalogue->ReadFrames("d")->size(), 2u);
  EXPECT_EQ(catalogue->RemoveJob("c").code(), absl::StatusCode::kNotFound);
}

TEST_F(CatalogueTest, APriorityOutlivesTheDatabase) {
  {
    const auto catalogue = Open();
    ASSERT_TRUE(catalogue->AddJob(MakeJob("a"), MakeFrames(3)).ok());
    ASSERT_TRUE(catalogue->KeepPriority("a", 7).ok());
    EXPECT_TRUE(catalogue->KeepPriority("b", 7).ok()) << "one without a record has nothing to keep";
  }
  std::filesystem::remove(path_);
  const auto again = Open();
  EXPECT_EQ(again->ReadJob("a")->priority(), 7);
  EXPECT_EQ(again->ReadFrames("a")->size(), 3u);
  EXPECT_EQ(again->ReadJob("b").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(CatalogueTest, NamesUnknownAndRepeatedJobs) {
  const auto catalogue = Open();
  ASSERT_TRUE(catalogue->AddJob(MakeJob("a"), MakeFrames(1)).ok());
  EXPECT_EQ(catalogue->AddJob(MakeJob("a"), {}).code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(catalogue->ReadJob("b").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(catalogue->Update(MakeJob("b"), {{0, {}}}).code(), absl::StatusCode::kNotFound);
}

TEST_F(CatalogueTest, StoresHostileNamesAsTheyAre) {
  const auto catalogue = Open();
  v1::Job job = MakeJob("x'; DROP TABLE jobs; --");
  ASSERT_TRUE(catalogue->AddJob(job, {}).ok());
  ASSERT_TRUE(catalogue->ReadJob(job.id()).ok());
  EXPECT_EQ(catalogue->ListJobs(10)->size(), 1u);
}

TEST_F(CatalogueTest, RefusesASecondOpener) {
  const auto first = Open();
  const auto second = Catalogue::Open(path_);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("in use by another weftd"));
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(path_));
}

TEST_F(CatalogueTest, SetsAFileThatIsNoDatabaseAside) {
  WriteBytes(path_, std::string(8192, 'x'));
  const auto catalogue = Open();
  ASSERT_NE(catalogue, nullptr);
  ASSERT_EQ(catalogue->warnings().size(), 1u);
  EXPECT_THAT(catalogue->warnings()[0], HasSubstr("catalogue.sqlite.damaged-"));
  EXPECT_EQ(FilesLike("damaged").size(), 1u);
  EXPECT_EQ(ReadBytes(FilesLike("damaged")[0]), std::string(8192, 'x'));
}

TEST_F(CatalogueTest, RefusesADatabaseOfANewerWeft) {
  Open();
  {
    const auto database = Database::Open(path_);
    ASSERT_TRUE(database.ok());
    ASSERT_TRUE((*database)->Execute("PRAGMA user_version = 99").ok());
  }
  const auto catalogue = Catalogue::Open(path_);
  EXPECT_EQ(catalogue.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(catalogue.status().message()), HasSubstr("newer Weft"));
}

TEST_F(CatalogueTest, NamesAFolderThatDoesNotExist) {
  const auto catalogue = Catalogue::Open(folder_ / "none/catalogue.sqlite");
  EXPECT_EQ(catalogue.status().code(), absl::StatusCode::kPermissionDenied) << catalogue.status();
}

TEST_F(CatalogueTest, TextsThatAreNotUtf8AreEscapedAndHideNoJob) {
  const auto catalogue = Open();
  v1::Job job = MakeJob("a");
  job.add_warnings("c\xff\xfe.png: unknown camera");
  ASSERT_TRUE(catalogue->AddJob(job, MakeFrames(1)).ok());
  v1::FrameInfo info = MakeFrames(1)[0];
  info.set_reason("\xc3");
  ASSERT_TRUE(catalogue->Update(job, {{0, info}}).ok());
  ASSERT_EQ(catalogue->ListJobs(10)->size(), 1u);
  EXPECT_EQ(catalogue->ReadJob("a")->warnings(0), "c\\xff\\xfe.png: unknown camera");
  EXPECT_EQ((*catalogue->ReadFrames("a"))[0].reason(), "\\xc3");
}

TEST_F(CatalogueTest, KeepsWhatAKilledProcessHadWritten) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    auto catalogue = Catalogue::Open(path_);
    const bool ok = catalogue.ok() && (*catalogue)->AddJob(MakeJob("a"), MakeFrames(2)).ok();
    const char answer = ok ? '1' : '0';
    if (write(ready[1], &answer, 1) != 1) _exit(1);
    for (;;) pause();
  }
  char answer = 0;
  ASSERT_EQ(read(ready[0], &answer, 1), 1);
  EXPECT_EQ(answer, '1');
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  close(ready[0]);
  close(ready[1]);
  const auto catalogue = Open();
  ASSERT_TRUE(catalogue->ReadJob("a").ok());
  EXPECT_EQ(catalogue->ReadFrames("a")->size(), 2u);
}

TEST_F(CatalogueTest, ListsPagesBehindAJob) {
  const auto catalogue = Open();
  for (const char* id : {"a", "b", "c", "d"}) ASSERT_TRUE(catalogue->AddJob(MakeJob(id), {}).ok());
  const auto ids = [](const absl::StatusOr<std::vector<v1::Job>>& jobs) {
    std::string all;
    for (const v1::Job& job : jobs.value()) all += job.id();
    return all;
  };
  EXPECT_EQ(ids(catalogue->ListJobs(10)), "dcba");
  EXPECT_EQ(ids(catalogue->ListJobs(2, "d")), "cb");
  EXPECT_EQ(ids(catalogue->ListJobs(2, "b")), "a");
  EXPECT_EQ(ids(catalogue->ListJobs(2, "a")), "");
  EXPECT_EQ(catalogue->ListJobs(2, "x").status(),
            absl::NotFoundError("no job \"x\"; `weft job list` shows the jobs"));
  EXPECT_EQ(catalogue->AddJob(MakeJob("a"), {}), absl::AlreadyExistsError("a job \"a\" exists already"));
  EXPECT_EQ(catalogue->RemoveJob("x").code(), absl::StatusCode::kNotFound);
  for (const char* id : {"a", "b", "c"})
    ASSERT_TRUE(catalogue->Update(MakeJob(id, v1::JOB_STATE_CANCELLED), {}).ok());
  EXPECT_EQ(ids(catalogue->EndedJobs(0, 2)), "ab");
  EXPECT_EQ(ids(catalogue->EndedJobs(2, 2)), "c");
  EXPECT_EQ(ids(catalogue->UnfinishedJobs()), "d");
}

TEST_F(CatalogueTest, RecordsFollowJobsThatBeginAndEnd) {
  const auto catalogue = Open();
  const JobRecords records(path_);
  ASSERT_TRUE(catalogue->AddJob(MakeJob("a"), MakeFrames(2)).ok());
  EXPECT_EQ(records.Read("a")->frames_size(), 2);
  ASSERT_TRUE(catalogue->Update(MakeJob("a", v1::JOB_STATE_RUNNING), {{2, MakeFrames(3)[2]}}).ok());
  EXPECT_EQ(catalogue->ReadFrames("a")->size(), 3u);
  EXPECT_EQ(records.Read("a")->job().state(), v1::JOB_STATE_QUEUED);
  ASSERT_TRUE(catalogue->UpdateAll(MakeJob("a", v1::JOB_STATE_DONE), MakeFrames(1)).ok());
  EXPECT_EQ(catalogue->ReadFrames("a")->size(), 1u);
  EXPECT_EQ(records.Read("a")->job().state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(records.Read("a")->frames_size(), 1);
  ASSERT_TRUE(catalogue->UpdateAll(MakeJob("b"), {}).ok()) << "it is added";
  EXPECT_EQ(catalogue->ListJobs(1)->front().id(), "b");
  ASSERT_TRUE(catalogue->RemoveJob("a").ok());
  EXPECT_EQ(records.Read("a").status().code(), absl::StatusCode::kNotFound);
}

// Changes a text in the file and its log where they stand, under a catalogue that has more than its cache.
TEST_F(CatalogueTest, RowsThatAreDamagedWhileItIsInUseSaySo) {
  const auto catalogue = Open();
  std::vector<v1::FrameInfo> frames = MakeFrames(2);
  frames[1].set_reason("mark-of-frame");
  v1::Job marked = MakeJob("m", v1::JOB_STATE_RUNNING);
  marked.mutable_spec()->set_rig("mark-of-job");
  ASSERT_TRUE(catalogue->AddJob(marked, frames).ok());
  for (int i = 0; i < 12; ++i) {
    v1::Job large = MakeJob(std::to_string(i));
    large.set_message(std::string(400'000, 'x'));
    ASSERT_TRUE(catalogue->AddJob(large, {}).ok());
  }
  for (const std::string& path : {path_, path_ + "-wal"}) {
    const std::string bytes = ReadBytes(path);
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    for (size_t at = bytes.find("mark-of-"); at != std::string::npos; at = bytes.find("mark-of-", at + 1))
      file.seekp(static_cast<std::streamoff>(at)).put('M');
  }
  EXPECT_EQ(catalogue->ListJobs(12)->size(), 12u);
  const std::string remedy =
      " is damaged; start weftd again: it restores the entry from its record. The results are untouched";
  const auto job = catalogue->ReadJob("m");
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->ShortDebugString(),
            "id: \"m\" state: JOB_STATE_RUNNING message: \"the catalogue\\'s entry of job m" + remedy + "\"");
  const auto read = catalogue->ReadFrames("m");
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ((*read)[0].ShortDebugString(), frames[0].ShortDebugString());
  EXPECT_EQ((*read)[1].ShortDebugString(),
            "frame: \"1\" state: FRAME_STATE_WAITING reason: \"the catalogue\\'s entry of frame 1 of job m" +
                remedy + "\"");
}

}  // namespace
}  // namespace weft
