// Every write and flush of the catalogue fails once, and the power is cut at every one: what was acknowledged
// is there.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "absl/strings/str_cat.h"
#include "services/server/catalogue/catalogue.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/catalogue/crash_vfs.h"

namespace weft {
namespace {

constexpr int kFrames = 30;

// What a catalogue holds, as text.
std::string ContentOf(Catalogue& catalogue) {
  std::string content;
  const auto jobs = catalogue.ListJobs(100);
  if (!jobs.ok()) return std::string(jobs.status().message());
  for (const v1::Job& job : *jobs) {
    absl::StrAppend(&content, job.ShortDebugString(), "\n");
    const auto frames = catalogue.ReadFrames(job.id());
    if (!frames.ok()) return std::string(frames.status().message());
    for (const v1::FrameInfo& info : *frames) absl::StrAppend(&content, "  ", info.ShortDebugString(), "\n");
  }
  return content;
}

v1::Job JobToLose(const std::string& id, v1::JobState state) {
  v1::Job job;
  job.set_id(id);
  job.set_state(state);
  job.mutable_spec()->set_dump(std::string(300, 'd'));
  return job;
}

std::vector<v1::FrameInfo> FramesToLose(v1::FrameState state) {
  std::vector<v1::FrameInfo> frames(kFrames);
  for (int i = 0; i < kFrames; ++i) {
    frames[i].set_frame(absl::StrCat(i));
    frames[i].set_state(state);
    frames[i].set_reason(std::string(100, 'r'));
  }
  return frames;
}

// What a queue does with its catalogue, one acknowledged change after the other.
std::vector<std::function<absl::Status(Catalogue&)>> Changes() {
  std::vector<std::function<absl::Status(Catalogue&)>> changes;
  for (const char* id : {"a", "b", "c"}) {
    const std::string job = id;
    changes.push_back([job](Catalogue& catalogue) {
      return catalogue.AddJob(JobToLose(job, v1::JOB_STATE_QUEUED), FramesToLose(v1::FRAME_STATE_WAITING));
    });
    changes.push_back(
        [job](Catalogue& catalogue) { return catalogue.Update(JobToLose(job, v1::JOB_STATE_RUNNING), {}); });
    for (const size_t position : {0, 7}) {
      changes.push_back([job, position](Catalogue& catalogue) {
        return catalogue.Update(JobToLose(job, v1::JOB_STATE_RUNNING),
                                {{position, FramesToLose(v1::FRAME_STATE_DONE)[position]}});
      });
    }
    changes.push_back([job](Catalogue& catalogue) {
      return catalogue.UpdateAll(JobToLose(job, v1::JOB_STATE_DONE), FramesToLose(v1::FRAME_STATE_DONE));
    });
  }
  return changes;
}

// Thousands of flushes of real files, which the simulated disk does not need.
std::filesystem::path InMemory() {
  return std::filesystem::is_directory("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path();
}

class CrashTest : public ::testing::Test {
 protected:
  CrashTest() {
    const auto catalogue = Catalogue::Open(folder_ / "reference.sqlite");
    states_.push_back(ContentOf(**catalogue));
    for (const auto& change : Changes()) {
      EXPECT_TRUE(change(**catalogue).ok());
      states_.push_back(ContentOf(**catalogue));
    }
  }

  void Clear() {
    std::filesystem::remove_all(folder_ / "state");
    std::filesystem::create_directory(folder_ / "state");
    vfs_.Forget();
  }

  // Makes the changes in turn until one fails; how many were acknowledged.
  size_t MakeChanges() {
    const auto catalogue = Catalogue::Open(path_);
    if (!catalogue.ok()) return 0;
    size_t acknowledged = 0;
    for (const auto& change : Changes()) {
      if (!change(**catalogue).ok()) break;
      ++acknowledged;
    }
    return acknowledged;
  }

  // Reads the catalogue after a crash: everything that was acknowledged, and the change that was under way
  // either whole or not at all; and nothing that would have to be restored.
  void ExpectState(size_t acknowledged) {
    const auto catalogue = Catalogue::Open(path_);
    ASSERT_TRUE(catalogue.ok()) << catalogue.status();
    EXPECT_TRUE((*catalogue)->warnings().empty()) << (*catalogue)->warnings()[0];
    const std::string content = ContentOf(**catalogue);
    const bool next = acknowledged + 1 < states_.size() && content == states_[acknowledged + 1];
    EXPECT_TRUE(next || content == states_[acknowledged]) << "after " << acknowledged << " changes:\n"
                                                          << content;
  }

  TempFolder folder_{InMemory()};
  const std::string path_ = folder_ / "state/catalogue.sqlite";
  std::vector<std::string> states_;  // after so many changes
  CrashVfs vfs_{path_};
};

TEST_F(CrashTest, AcknowledgedChangesSurviveAPowerCutAtEveryOperation) {
  Clear();
  ASSERT_EQ(MakeChanges() + 1, states_.size());
  const int64_t operations = vfs_.operations();
  ASSERT_GT(operations, 50);
  for (int64_t n = 1; n <= operations; ++n) {
    for (uint32_t seed = 0; seed < 4; ++seed) {
      SCOPED_TRACE(absl::StrCat("power off at operation ", n, " of ", operations, ", seed ", seed));
      Clear();
      vfs_.CutPowerAt(n);
      const size_t acknowledged = MakeChanges();
      vfs_.Crash(seed);
      ExpectState(acknowledged);
      if (HasFailure()) return;
    }
  }
}

// As a daemon does: what the disk refuses is tried again. At the end the power is cut.
TEST_F(CrashTest, EveryOperationFailsInTurnAndIsTriedAgain) {
  Clear();
  MakeChanges();
  const int64_t operations = vfs_.operations();
  for (int64_t n = 1; n <= operations; ++n) {
    for (const int64_t failures : {1, 5}) {
      SCOPED_TRACE(absl::StrCat(failures, " failures from operation ", n, " of ", operations));
      Clear();
      vfs_.FailFrom(n, failures);
      constexpr int kTries = 20;
      absl::StatusOr<std::unique_ptr<Catalogue>> catalogue = Catalogue::Open(path_);
      for (int i = 0; i < kTries && !catalogue.ok(); ++i) catalogue = Catalogue::Open(path_);
      ASSERT_TRUE(catalogue.ok()) << catalogue.status();
      size_t acknowledged = 0;
      for (const auto& change : Changes()) {
        absl::Status status = change(**catalogue);
        if (!status.ok()) {
          EXPECT_EQ(ContentOf(**catalogue), states_[acknowledged]) << "a refused change was made";
        }
        for (int i = 0; i < kTries && !status.ok(); ++i) status = change(**catalogue);
        ASSERT_TRUE(status.ok()) << status;
        EXPECT_EQ(ContentOf(**catalogue), states_[++acknowledged]);
      }
      vfs_.CutPowerAt(0);
      catalogue->reset();
      vfs_.Crash(static_cast<uint32_t>(n));
      ExpectState(acknowledged);
      if (HasFailure()) return;
    }
  }
}

}  // namespace
}  // namespace weft
