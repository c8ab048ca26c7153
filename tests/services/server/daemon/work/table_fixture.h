// A JobTable on which tests play executor, disk and clock.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "services/server/daemon/work/job_table.h"

namespace weft {

class TableFixture : public ::testing::Test {
 protected:
  using Files = JobEffects::Files;

  static v1::Job NewJob(const std::string& id, const std::string& caller = "anna") {
    v1::Job job;
    job.set_id(id);
    job.set_submitted_by(caller);
    job.mutable_spec()->set_dump("/takes/" + id);
    job.mutable_spec()->set_out("/results/" + id);
    return job;
  }

  static std::vector<std::string> Names(int frames) {
    std::vector<std::string> names;
    for (int i = 0; i < frames; ++i) names.push_back("f" + std::to_string(i));
    return names;
  }

  // A job that waits.
  JobRef Add(const v1::Job& job, int frames = 4) {
    auto reserved = table_.Reserve(JobLife(job, Names(frames)), v1::ROLE_OPERATOR);
    EXPECT_TRUE(reserved.ok()) << reserved.status();
    if (!reserved.ok()) return nullptr;
    table_.Activate(*reserved, now_);
    return *reserved;
  }

  JobEffects Effects() { return table_.TakeEffects(); }

  // The files that are asked for of this job.
  std::vector<Files> FilesOf(const JobRef& job) {
    std::vector<Files> asked;
    for (const auto& [of, what] : Effects().files)
      if (of == job) asked.push_back(what);
    return asked;
  }

  std::optional<PlannedTask> Next() { return table_.NextTask(slots_, shape_); }

  // The next task, begun, after the folder that it needs was taken.
  std::optional<PlannedTask> Begin() {
    std::optional<PlannedTask> task = Next();
    if (!task) {
      for (const auto& [job, what] : Effects().files)
        if (what == Files::kTakeFolder) table_.OnFolderTaken(job, absl::OkStatus(), now_);
      task = Next();
    }
    table_.EndRound();
    if (task) table_.Began(*task, "/logs", now_);
    return task;
  }

  static v1::WorkerEvent Started(const std::string& frame) {
    v1::WorkerEvent event;
    event.mutable_started()->set_frame(frame);
    return event;
  }
  static v1::WorkerEvent Advanced(const std::string& frame, double share) {
    v1::WorkerEvent event;
    event.mutable_advanced()->set_frame(frame);
    event.mutable_advanced()->set_share_done(share);
    return event;
  }
  static v1::WorkerEvent Finished(const std::string& frame, v1::FrameState state = v1::FRAME_STATE_DONE) {
    v1::WorkerEvent event;
    event.mutable_finished()->set_frame(frame);
    event.mutable_finished()->set_state(state);
    return event;
  }
  static v1::WorkerEvent Error(const std::string& code, const std::string& message,
                               v1::ErrorReason reason = v1::ERROR_REASON_UNSPECIFIED) {
    v1::WorkerEvent event;
    event.mutable_error()->set_reason(reason);
    event.mutable_error()->set_code(code);
    event.mutable_error()->set_message(message);
    return event;
  }

  void Tell(const PlannedTask& task, const v1::WorkerEvent& event, int64_t host_time_ns = 0) {
    table_.OnEvent(task.task.id(), event, host_time_ns);
  }
  void FinishFrames(const PlannedTask& task, v1::FrameState state = v1::FRAME_STATE_DONE) {
    for (const std::string& frame : task.task.frames()) Tell(task, Finished(frame, state));
  }
  void End(const PlannedTask& task, TaskEnd end = {.clean = true}) {
    table_.OnTaskEnded(task.task.id(), end, now_);
  }
  // All frames done by tasks, one after the other.
  void FinishAll(const JobRef& job) {
    while (job->life.frames().HasWaiting()) {
      const std::optional<PlannedTask> task = Begin();
      ASSERT_TRUE(task);
      FinishFrames(*task);
      End(*task);
    }
  }
  // From the last frame to the end.
  void Conclude(const JobRef& job) {
    if (job->checking) table_.OnChecked(job, std::vector<IncompleteFrame>{}, now_);
    ASSERT_TRUE(job->finishing);
    table_.OnFinished(job, table_.Outcome(job, {}), absl::OkStatus(), now_);
    table_.Saved(job);
  }

  v1::FrameState StateOf(const JobRef& job, size_t frame) const { return job->infos()[frame].state(); }
  void Pass(std::chrono::milliseconds time) { now_ += time; }

  JobTime now_{std::chrono::hours(1)};
  int slots_ = 1;
  TaskShape shape_{.parallel = 1, .least_frames = 1, .most_frames = 16};
  JobTable table_{JobTableOptions{.max_of_one_caller = 3}};
};

}  // namespace weft
