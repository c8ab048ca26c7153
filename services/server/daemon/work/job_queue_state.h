// What JobQueue keeps of a job, a task and a watcher. Only for its own source files.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/work/job/job_folder.h"
#include "services/work/job/job_life.h"

namespace weft {

struct JobQueue::LiveJob {
  explicit LiveJob(JobLife begun)
      : life(std::move(begun)),
        folder(life.job().spec().out(), absl::StrCat("job ", life.job().id(), " of weftd")) {}

  const v1::Job& job() const { return life.job(); }
  const std::string& caller() const { return life.job().submitted_by(); }
  const std::vector<v1::FrameInfo>& infos() const { return life.frames().infos(); }

  JobLife life;
  JobFolder folder;                // its lock is held from the job's first task to its end
  bool checking = false;           // its results are being looked at; no task of it runs
  bool checked = false;            // they are all there
  bool finishing = false;          // its last files are being written
  bool unsaved = false;            // the catalogue refused a state of it; it gets them all once it can
  std::optional<v1::Job> outcome;  // its last state, until the catalogue has it
  // Set while a disk has no room for its tasks.
  std::optional<std::chrono::steady_clock::time_point> start_again;
  std::chrono::seconds pause{1};
  // Of a job that follows a take: when to look for new frame sets, and what was there the last time.
  std::optional<std::chrono::steady_clock::time_point> look_at;
  std::unique_ptr<TakeFollower> take;  // of the background, as long as the job follows it
  std::vector<int64_t> recorded_ns;    // per frame, CLOCK_REALTIME
  bool take_settled = false;
  bool take_closed = false;
  bool ended = false;
  int failed_starts = 0;  // workers in a row that ended before they began a frame
  int notes = 0;          // warnings about its tasks
  int watchers = 0;
  uint64_t version = 1;  // counts changes of `job`
};

struct JobQueue::RunningTask {
  std::shared_ptr<LiveJob> job;
  std::vector<size_t> positions;
  std::optional<v1::TaskError> error;
  std::optional<v1::WorkerUsage> usage;
  std::chrono::steady_clock::time_point handed_out = std::chrono::steady_clock::now();
  bool began = false;
  bool is_taken_up = false;  // it tells again what it told the daemon before this one
};

struct JobQueue::Watcher {
  std::shared_ptr<LiveJob> job;
  std::function<void()> changed;
  uint64_t seen_job = 0;
  uint64_t seen_frames = 0;
  bool told_end = false;
};

}  // namespace weft
