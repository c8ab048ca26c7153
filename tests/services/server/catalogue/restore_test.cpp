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

  static void KeepBackup(Catalogue& catalogue) {
    const auto backup = catalogue.StartBackup();
    ASSERT_TRUE(backup.ok()) << backup.status();
    for (absl::StatusOr<bool> done = false; !*done; done = (*backup)->Step())
      ASSERT_TRUE(done.ok()) << done.status();
    const absl::Status kept = (*backup)->Keep();
    ASSERT_TRUE(kept.ok()) << kept;
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

TEST_F(RestoreTest, AnEmptiedOrRemovedFileIsRestoredFromItsBackup) {
  for (const bool remove : {false, true}) {
    SCOPED_TRACE(remove ? "removed" : "emptied");
    fs::remove(path_ + ".backup-1");
    fs::remove(path_);
    Fill();
    KeepBackup(*Open());
    remove ? fs::remove(path_) : (fs::resize_file(path_, 0), true);
    const auto catalogue = Open();
    ASSERT_EQ(catalogue->warnings().size(), 1u);
    EXPECT_THAT(catalogue->warnings()[0], HasSubstr("10 of them from the backup"));
    ExpectWhole(*catalogue);
  }
}

// A daemon that was killed leaves everything in the log; SQLite removes it when the file itself is empty.
TEST_F(RestoreTest, AnEmptiedFileIsRestoredFromItsLog) {
  {
    const auto catalogue = Open();
    for (int i = 0; i < 10; ++i) {
      ASSERT_TRUE(
          catalogue
              ->AddJob(JobToRestore(absl::StrCat(i), i == 9 ? v1::JOB_STATE_RUNNING : v1::JOB_STATE_DONE),
                       FramesToRestore(i == 9 ? v1::FRAME_STATE_WAITING : v1::FRAME_STATE_DONE))
              .ok());
    }
    fs::copy_file(path_ + "-wal", folder_ / "log");
  }
  fs::copy_file(folder_ / "log", path_ + "-wal", fs::copy_options::overwrite_existing);
  fs::resize_file(path_, 0);
  const auto catalogue = Open();
  ASSERT_EQ(catalogue->warnings().size(), 1u);
  ExpectWhole(*catalogue);
}

TEST_F(RestoreTest, ADamagedLogLosesNoLaterTransaction) {
  {
    const auto catalogue = Open();
    for (int i = 0; i < 10; ++i) {
      ASSERT_TRUE(catalogue
                      ->AddJob(JobToRestore(absl::StrCat(i), v1::JOB_STATE_RUNNING),
                               FramesToRestore(v1::FRAME_STATE_WAITING))
                      .ok());
    }
    fs::copy_file(path_, folder_ / "file");
    fs::copy_file(path_ + "-wal", folder_ / "log");
  }
  std::string log = ReadBytes(folder_ / "log");
  log[log.size() / 3] = static_cast<char>(~log[log.size() / 3]);
  WriteBytes(path_ + "-wal", log);
  fs::copy_file(folder_ / "file", path_, fs::copy_options::overwrite_existing);
  const auto catalogue = Open();
  ASSERT_EQ(catalogue->warnings().size(), 1u);
  EXPECT_THAT(catalogue->warnings()[0], HasSubstr("catalogue.sqlite-wal: damaged"));
  EXPECT_EQ(catalogue->ListJobs(100)->size(), 10u);
}

// What an interrupted write leaves is no damage.
TEST_F(RestoreTest, ATornEndOfTheLogIsLeftToSqlite) {
  {
    const auto catalogue = Open();
    for (int i = 0; i < 3; ++i)
      ASSERT_TRUE(catalogue->AddJob(JobToRestore(absl::StrCat(i), v1::JOB_STATE_RUNNING), {}).ok());
    fs::copy_file(path_, folder_ / "file");
    fs::copy_file(path_ + "-wal", folder_ / "log");
  }
  std::string log = ReadBytes(folder_ / "log");
  log.resize(log.size() - 1000);
  WriteBytes(path_ + "-wal", log);
  fs::copy_file(folder_ / "file", path_, fs::copy_options::overwrite_existing);
  const auto catalogue = Open();
  EXPECT_TRUE(catalogue->warnings().empty());
  EXPECT_EQ(catalogue->ListJobs(100)->size(), 2u);
}

TEST_F(RestoreTest, RandomDamageIsNoticedAndLosesNothingThatABackupHas) {
  Fill();
  KeepBackup(*Open());
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

// Without a backup: every row that no damaged byte touches is there, and no row is wrong.
TEST_F(RestoreTest, WithoutABackupAllRowsOutsideTheDamageAreKept) {
  Fill();
  const std::string whole = ReadBytes(path_);
  const size_t pages = whole.size() / 4096;
  int without_frames = 0;
  for (size_t page = 0; page < pages; ++page) {
    SCOPED_TRACE(page);
    std::string damaged = whole;
    std::fill_n(damaged.begin() + page * 4096, 4096, '\xa5');
    WriteBytes(path_, damaged);
    fs::remove(path_ + "-wal");
    const auto catalogue = Open();
    ASSERT_NE(catalogue, nullptr);
    ASSERT_EQ(catalogue->warnings().size(), 1u);
    const auto jobs = catalogue->ListJobs(100);
    ASSERT_TRUE(jobs.ok()) << jobs.status();
    size_t kept = 0;
    for (const v1::Job& job : *jobs) {
      const auto frames = catalogue->ReadFrames(job.id());
      ASSERT_TRUE(frames.ok()) << frames.status();
      for (const v1::FrameInfo& info : *frames) kept += info.reason().size() == 60;
    }
    EXPECT_GE(jobs->size(), 8u);
    without_frames += kept == 0;
    if (kept > 0) {
      EXPECT_GE(kept, 10u * kRestoredFrames - 60) << "of " << 10 * kRestoredFrames;
    }
    EXPECT_FALSE(Quarantine("damaged").empty());
  }
  // The page that says where those of the frames are; a job that goes on takes its frames from its inputs
  // then.
  EXPECT_LE(without_frames, 1);
}

TEST_F(RestoreTest, AChangedByteInARowIsNoticed) {
  Fill();
  KeepBackup(*Open());
  std::string bytes = ReadBytes(path_);
  const size_t at = bytes.find("/takes/4");
  ASSERT_NE(at, std::string::npos);
  bytes[at + 7] = '5';
  WriteBytes(path_, bytes);
  const auto catalogue = Open();
  ASSERT_EQ(catalogue->warnings().size(), 1u);
  EXPECT_THAT(catalogue->warnings()[0], HasSubstr("entry of job 4"));
  ExpectWhole(*catalogue);
}

TEST_F(RestoreTest, AnOlderStateOfTheFileGetsWhatTheBackupKnowsBesides) {
  Fill();
  const std::string old = ReadBytes(path_);
  {
    const auto catalogue = Open();
    ASSERT_TRUE(
        catalogue->UpdateAll(JobToRestore("9", v1::JOB_STATE_DONE), FramesToRestore(v1::FRAME_STATE_DONE))
            .ok());
    KeepBackup(*catalogue);
  }
  WriteBytes(path_, old);
  const auto catalogue = Open();
  ASSERT_EQ(catalogue->warnings().size(), 1u);
  EXPECT_EQ(catalogue->ReadJob("9")->state(), v1::JOB_STATE_DONE);
  EXPECT_EQ((*catalogue->ReadFrames("9"))[3].state(), v1::FRAME_STATE_DONE);
}

TEST_F(RestoreTest, AnInterruptedRestorationIsFinished) {
  Fill();
  // As it is between the two renames.
  fs::rename(path_, path_ + ".new.damaged-x");
  WriteBytes(path_, "garbage");
  const auto catalogue = Open();
  EXPECT_TRUE(catalogue->warnings().empty());
  ExpectWhole(*catalogue);
  EXPECT_EQ(ReadBytes(path_ + ".damaged-x"), "garbage");
}

TEST_F(RestoreTest, ABackupOfADamagedCatalogueReplacesNoBackup) {
  Fill();
  KeepBackup(*Open());
  const std::string kept = ReadBytes(path_ + ".backup-1");
  const auto catalogue = Open();
  // A byte that rots while the catalogue is in use.
  std::string bytes = ReadBytes(path_);
  const size_t at = bytes.find("/takes/4");
  std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(at));
  file.write("X", 1);
  file.close();
  const auto backup = catalogue->StartBackup();
  ASSERT_TRUE(backup.ok());
  for (absl::StatusOr<bool> done = false; !*done; done = (*backup)->Step()) ASSERT_TRUE(done.ok());
  EXPECT_EQ((*backup)->Keep().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(ReadBytes(path_ + ".backup-1"), kept);
}

// Rows as b38437e wrote them: without checksums, and with texts that no reader takes.
TEST_F(RestoreTest, ACatalogueOfTheFirstSchemaIsUpgraded) {
  {
    const auto database = Database::Open(path_);
    ASSERT_TRUE(database.ok());
    ASSERT_TRUE(MakeTables(**database, kFirstSchemaVersion).ok());
    for (int i = 0; i < 2; ++i) {
      v1::Job job = JobToRestore(absl::StrCat(i), v1::JOB_STATE_DONE);
      if (i == 0) job.add_warnings("c\xff\xfe.png");
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
  EXPECT_EQ(Quarantine("older").size(), 1u);
}

}  // namespace
}  // namespace weft
