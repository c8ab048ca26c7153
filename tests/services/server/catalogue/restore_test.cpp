// Catalogues that were damaged, emptied, removed, or written by an older Weft.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "absl/strings/str_cat.h"
#include "services/server/catalogue/catalogue.h"
#include "services/server/catalogue/catalogue_rows.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kRestoredFrames = 40;

v1::Job JobToRestore(const std::string& id, v1::JobState state) {
  v1::Job job;
  job.set_id(id);
  job.set_state(state);
  job.mutable_spec()->set_dump("/takes/" + id);
  job.mutable_spec()->set_out("/results/" + id);
  job.mutable_frames()->set_total(kRestoredFrames);
  return job;
}

std::vector<v1::FrameInfo> FramesToRestore(v1::FrameState state) {
  std::vector<v1::FrameInfo> frames(kRestoredFrames);
  for (int i = 0; i < kRestoredFrames; ++i) {
    frames[i].set_frame(absl::StrCat("frame ", i));
    frames[i].set_state(state);
    frames[i].set_reason(std::string(60, 'r'));
  }
  return frames;
}

class RestoreTest : public ::testing::Test {
 protected:
  std::unique_ptr<Catalogue> Open() {
    absl::StatusOr<std::unique_ptr<Catalogue>> catalogue = Catalogue::Open(path_);
    EXPECT_TRUE(catalogue.ok()) << catalogue.status();
    return catalogue.ok() ? *std::move(catalogue) : nullptr;
  }

  // Jobs "0" to "9", all of them done but the last one.
  void Fill() {
    const auto catalogue = Open();
    for (int i = 0; i < 10; ++i) {
      const bool last = i == 9;
      const v1::Job job = JobToRestore(absl::StrCat(i), last ? v1::JOB_STATE_RUNNING : v1::JOB_STATE_DONE);
      const auto frames = FramesToRestore(last ? v1::FRAME_STATE_WAITING : v1::FRAME_STATE_DONE);
      ASSERT_TRUE(catalogue->AddJob(job, frames).ok());
    }
  }

  // All ten jobs with all their frames, as Fill wrote them.
  static void ExpectWhole(Catalogue& catalogue) {
    const auto jobs = catalogue.ListJobs(100);
    ASSERT_TRUE(jobs.ok()) << jobs.status();
    ASSERT_EQ(jobs->size(), 10u);
    for (int i = 0; i < 10; ++i) {
      const v1::Job& job = (*jobs)[9 - i];
      EXPECT_EQ(job.id(), absl::StrCat(i));
      EXPECT_EQ(job.spec().dump(), "/takes/" + job.id());
      EXPECT_EQ(job.state(), i == 9 ? v1::JOB_STATE_RUNNING : v1::JOB_STATE_DONE);
      EXPECT_EQ(job.warnings_size(), 0) << job.warnings(0);
      const auto frames = catalogue.ReadFrames(job.id());
      ASSERT_TRUE(frames.ok()) << frames.status();
      ASSERT_EQ(frames->size(), static_cast<size_t>(kRestoredFrames));
      for (int f = 0; f < kRestoredFrames; ++f) EXPECT_EQ((*frames)[f].frame(), absl::StrCat("frame ", f));
    }
  }

  // The set-aside files of that kind.
  std::vector<std::string> Quarantine(const std::string& kind) {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      const std::string name = entry.path().filename();
      if (name.find(".sqlite." + kind) != std::string::npos && !name.ends_with("-wal"))
        found.push_back(entry.path());
    }
    return found;
  }

  TempFolder folder_;
  const std::string path_ = folder_ / "catalogue.sqlite";
};

TEST_F(RestoreTest, ASoundCatalogueIsLeftAlone) {
  Fill();
  const auto catalogue = Open();
  EXPECT_TRUE(catalogue->warnings().empty());
  ExpectWhole(*catalogue);
  EXPECT_TRUE(Quarantine("damaged").empty());
}

TEST_F(RestoreTest, AnEmptiedOrRemovedFileIsMadeAnewFromTheRecords) {
  Fill();
  for (const bool with_log : {false, true}) {
    for (const bool remove : {false, true}) {
      SCOPED_TRACE(absl::StrCat(remove ? "removed" : "emptied", with_log ? ", with its log" : ""));
      WriteBytes(path_ + "-wal", with_log ? std::string(5000, 'w') : "");
      remove ? fs::remove(path_) : (fs::resize_file(path_, 0), true);
      const auto catalogue = Open();
      ASSERT_EQ(catalogue->warnings().size(), 1u);
      EXPECT_THAT(catalogue->warnings()[0], HasSubstr("is restored: 10 jobs from their records"));
      EXPECT_THAT(catalogue->warnings()[0], HasSubstr(remove ? ": is gone" : ": is empty"));
      ExpectWhole(*catalogue);
    }
  }
}

// SQLite takes a damaged page for the log's end.
TEST_F(RestoreTest, ADamagedLogLosesNoJob) {
  for (const bool is_cut : {false, true}) {
    {
      const auto catalogue = Open();
      for (int i = 0; i < 10; ++i) {
        const v1::Job job = JobToRestore(absl::StrCat(is_cut, i), v1::JOB_STATE_RUNNING);
        ASSERT_TRUE(catalogue->AddJob(job, FramesToRestore(v1::FRAME_STATE_WAITING)).ok());
      }
      fs::copy_file(path_, folder_ / "file", fs::copy_options::overwrite_existing);
      fs::copy_file(path_ + "-wal", folder_ / "log", fs::copy_options::overwrite_existing);
    }
    std::string log = ReadBytes(folder_ / "log");
    if (is_cut)
      log.resize(log.size() - 1000);
    else
      log[log.size() / 3] = static_cast<char>(~log[log.size() / 3]);
    WriteBytes(path_ + "-wal", log);
    fs::copy_file(folder_ / "file", path_, fs::copy_options::overwrite_existing);
    EXPECT_EQ(Open()->ListJobs(100)->size(), is_cut ? 20u : 10u);
  }
}

TEST_F(RestoreTest, RandomDamageIsNoticedAndLosesNothing) {
  Fill();
  const std::string whole = ReadBytes(path_);
  std::mt19937 random(1);
  for (int round = 0; round < 12; ++round) {
    SCOPED_TRACE(round);
    std::string damaged = whole;
    for (int i = 0; i < 20; ++i) damaged[random() % damaged.size()] ^= static_cast<char>(1 + random() % 255);
    WriteBytes(path_, damaged);
    fs::remove(path_ + "-wal");
    const auto catalogue = Open();
    ASSERT_NE(catalogue, nullptr);
    ExpectWhole(*catalogue);
  }
}

TEST_F(RestoreTest, AnyDamagedPageLosesNothing) {
  Fill();
  const std::string whole = ReadBytes(path_);
  for (size_t page = 0; page < whole.size() / 4096; ++page) {
    SCOPED_TRACE(page);
    std::string damaged = whole;
    std::fill_n(damaged.begin() + page * 4096, 4096, '\xa5');
    WriteBytes(path_, damaged);
    fs::remove(path_ + "-wal");
    const auto catalogue = Open();
    ASSERT_NE(catalogue, nullptr);
    EXPECT_EQ(catalogue->warnings().size(), 1u);
    ExpectWhole(*catalogue);
    EXPECT_FALSE(Quarantine("damaged").empty());
  }
}

TEST_F(RestoreTest, AChangedByteInARowIsNoticedAndOtherJobsKeepTheirProgress) {
  Fill();
  {
    const auto catalogue = Open();
    v1::FrameInfo done = FramesToRestore(v1::FRAME_STATE_DONE)[3];
    ASSERT_TRUE(catalogue->Update(JobToRestore("9", v1::JOB_STATE_RUNNING), {{3, done}}).ok());
  }
  std::string bytes = ReadBytes(path_);
  const size_t at = bytes.find("/takes/4");
  ASSERT_NE(at, std::string::npos);
  bytes[at + 7] = '5';
  WriteBytes(path_, bytes);
  const auto catalogue = Open();
  ASSERT_EQ(catalogue->warnings().size(), 1u);
  EXPECT_THAT(catalogue->warnings()[0], HasSubstr("entry of job 4"));
  ExpectWhole(*catalogue);
  EXPECT_EQ((*catalogue->ReadFrames("9"))[3].state(), v1::FRAME_STATE_DONE);
}

TEST_F(RestoreTest, AnOlderStateOfTheFileGetsWhatTheRecordsKnowBesides) {
  Fill();
  const std::string old = ReadBytes(path_);
  {
    const auto catalogue = Open();
    ASSERT_TRUE(
        catalogue->UpdateAll(JobToRestore("9", v1::JOB_STATE_DONE), FramesToRestore(v1::FRAME_STATE_DONE))
            .ok());
    ASSERT_TRUE(catalogue->AddJob(JobToRestore("10", v1::JOB_STATE_QUEUED), {}).ok());
  }
  WriteBytes(path_, old);
  const auto catalogue = Open();
  EXPECT_TRUE(catalogue->warnings().empty());
  EXPECT_EQ(catalogue->ReadJob("9")->state(), v1::JOB_STATE_DONE);
  EXPECT_EQ((*catalogue->ReadFrames("9"))[3].state(), v1::FRAME_STATE_DONE);
  EXPECT_EQ(catalogue->ListJobs(1)->front().id(), "10");
}

// A job that ended under a Weft that writes no records, or again later.
TEST_F(RestoreTest, RowsThatSayMoreThanTheirRecordsStay) {
  Fill();
  const std::string records = path_ + ".jobs";
  fs::copy(records, folder_ / "records");
  v1::Job later = JobToRestore("3", v1::JOB_STATE_FAILED);
  later.set_finished_unix_ns(7);
  {
    const auto catalogue = Open();
    ASSERT_TRUE(catalogue->UpdateAll(JobToRestore("9", v1::JOB_STATE_DONE), {}).ok());
    ASSERT_TRUE(catalogue->UpdateAll(later, {}).ok());
  }
  fs::remove_all(records);
  fs::copy(folder_ / "records", records);
  for (const bool lost : {false, true}) {
    if (lost) fs::remove(path_);  // by now the records have it
    const auto catalogue = Open();
    EXPECT_EQ(catalogue->warnings().empty(), !lost);
    EXPECT_EQ(catalogue->ReadJob("9")->state(), v1::JOB_STATE_DONE);
    EXPECT_EQ(catalogue->ReadJob("3")->state(), v1::JOB_STATE_FAILED);
  }
}

// A daemon that was killed before the row of a job that it was told to hurry.
TEST_F(RestoreTest, APriorityThatWasAnsweredStays) {
  Fill();
  v1::Job running = JobToRestore("9", v1::JOB_STATE_RUNNING);
  auto frames = FramesToRestore(v1::FRAME_STATE_WAITING);
  frames[0].set_state(v1::FRAME_STATE_DONE);
  {
    const auto catalogue = Open();
    ASSERT_TRUE(catalogue->Update(running, {{0, frames[0]}}).ok());
    ASSERT_TRUE(catalogue->KeepPriority("9", 7).ok());
  }
  for (const bool again : {false, true}) {
    const auto catalogue = Open();
    EXPECT_EQ(catalogue->ReadJob("9")->priority(), 7) << again;
    EXPECT_EQ((*catalogue->ReadFrames("9"))[0].state(), v1::FRAME_STATE_DONE) << "the progress of its row";
    EXPECT_EQ(catalogue->ReadJob("8")->priority(), 0);
  }
}

TEST_F(RestoreTest, AnInterruptedRestorationIsFinished) {
  Fill();
  // As it is between the renaming and the new file's commit.
  fs::rename(path_, path_ + ".damaged-x");
  ASSERT_TRUE(Database::Open(path_).ok());
  const auto catalogue = Open();
  ExpectWhole(*catalogue);
  EXPECT_EQ(Quarantine("damaged").size(), 1u);
}

TEST_F(RestoreTest, ADamagedRecordIsMadeAnewOrNamed) {
  Fill();
  WriteBytes(path_ + ".jobs/4", "no record");
  EXPECT_TRUE(Open()->warnings().empty());
  fs::remove(path_);
  ExpectWhole(*Open());
  WriteBytes(path_ + ".jobs/4", "no record");
  fs::remove(path_);
  const auto catalogue = Open();
  ASSERT_EQ(catalogue->warnings().size(), 2u);
  EXPECT_THAT(catalogue->warnings()[1], HasSubstr(".jobs/4: damaged, and the list of jobs lacks this job"));
  EXPECT_EQ(catalogue->ListJobs(100)->size(), 9u);
}

TEST_F(RestoreTest, WhatWasRemovedDoesNotComeBack) {
  Fill();
  ASSERT_TRUE(Open()->RemoveJob("4").ok());
  fs::remove(path_);
  EXPECT_EQ(Open()->ListJobs(100)->size(), 9u);
}

TEST_F(RestoreTest, RowsAndBackupsOfAWeftWithoutRecordsAreTakenOver) {
  Fill();
  fs::remove_all(path_ + ".jobs");
  fs::copy_file(path_, path_ + ".backup-1");
  WriteBytes(path_, ReadBytes(path_).substr(0, 5000));
  {
    const auto catalogue = Open();
    ASSERT_EQ(catalogue->warnings().size(), 1u);
    ExpectWhole(*catalogue);
  }
  EXPECT_FALSE(fs::exists(path_ + ".backup-1"));
  fs::remove_all(path_ + ".jobs");
  EXPECT_TRUE(Open()->warnings().empty());
  fs::remove(path_);
  ExpectWhole(*Open());
}

// Rows as b38437e wrote them: without checksums, and with texts that no reader takes.
TEST_F(RestoreTest, ACatalogueOfTheFirstSchemaIsUpgraded) {
  {
    const auto database = Database::Open(path_);
    ASSERT_TRUE(database.ok());
    ASSERT_TRUE(
        (*database)
            ->Execute("CREATE TABLE jobs (sequence INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL "
                      "UNIQUE, state TEXT NOT NULL, message TEXT NOT NULL, job BLOB NOT NULL);"
                      "CREATE TABLE frames (job_id TEXT NOT NULL, position INTEGER NOT NULL, name TEXT "
                      "NOT NULL, state TEXT NOT NULL, attempts INTEGER NOT NULL, info BLOB NOT NULL, "
                      "PRIMARY KEY (job_id, position)) WITHOUT ROWID; PRAGMA user_version = 1")
            .ok());
    for (int i = 0; i < 2; ++i) {
      v1::Job job = JobToRestore(absl::StrCat(i), v1::JOB_STATE_DONE);
      if (i == 0) job.add_warnings("c\xff\xfe.png");
      job.set_created_unix_ns(i);
      auto insert = (*database)->Prepare("INSERT INTO jobs (id, state, message, job) VALUES (?, ?, ?, ?)");
      ASSERT_TRUE(insert.ok()) << insert.status();
      insert->BindText(1, job.id()).BindText(2, "JOB_STATE_DONE").BindText(3, "");
      ASSERT_TRUE(insert->BindBytes(4, job.SerializeAsString()).Run().ok());
    }
  }
  const auto catalogue = Open();
  EXPECT_TRUE(catalogue->warnings().empty());
  const auto jobs = catalogue->ListJobs(10);
  ASSERT_EQ(jobs->size(), 2u);
  EXPECT_EQ((*jobs)[1].warnings(0), "c\\xff\\xfe.png");
  EXPECT_EQ((*jobs)[0].id(), "1");
  EXPECT_EQ(Quarantine("older").size(), 1u);
}

}  // namespace
}  // namespace weft
