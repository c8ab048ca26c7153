// An executor whose tasks a test ends.
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/work/executor/executor.h"

namespace weft {

class PlayedExecutor final : public Executor {
 public:
  struct Running {
    v1::Task task;
    TaskListener listener;
  };

  int slots() const override { return 1; }
  std::string LogFolder(const std::string& job_id) const override {
    return logs.empty() ? "" : logs + "/" + job_id;
  }
  void TakeUp(const Claim& claim) override {
    for (const v1::Task& task : from_before) {
      std::optional<TaskListener> listener = claim(task);
      claimed.push_back(absl::StrCat(task.id(), listener ? " yes" : " no"));
      if (listener) running.push_back({task, *std::move(listener)});
    }
  }
  absl::Status Start(const v1::Task& task, TaskListener listener) override {
    const std::lock_guard lock(mutex);
    if (!start.ok()) return start;
    running.push_back({task, std::move(listener)});
    return absl::OkStatus();
  }
  void Stop(const std::string& task_id) override {
    const std::lock_guard lock(mutex);
    stopped.push_back(task_id);
  }
  void StopAll() override {
    while (std::optional<Running> one = Take()) one->listener.ended({.reason = "stopped"});
  }
  // The oldest that runs; whoever takes it tells of its end.
  std::optional<Running> Take() {
    const std::lock_guard lock(mutex);
    if (running.empty()) return std::nullopt;
    Running one = running.front();
    running.erase(running.begin());
    return one;
  }

  std::string logs;
  std::vector<v1::Task> from_before;
  std::vector<std::string> claimed;
  std::mutex mutex;
  absl::Status start;
  std::vector<Running> running;
  std::vector<std::string> stopped;
};

}  // namespace weft
