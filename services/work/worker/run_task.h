// What a weft-worker does with its task.
#pragma once

#include <functional>
#include <stop_token>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"
#include "weft/v1/task.pb.h"

namespace weft {

// Confines this process to the files that the task names (services/ground/confinement), for good; call it
// before other threads start. Returns the folder of results that it may write into from now on: where that
// one is removed, another of its name is closed to it. Errors of ConfineProcess, reported as an event, too.
absl::StatusOr<UniqueFd> ConfineToTask(const v1::Task& task,
                                       const std::function<void(const v1::WorkerEvent&)>& report);

// Computes the task's frames and reports every event; calls never overlap.
// An error is reported as the last event, too. InvalidArgument names a field of the task. Cancelled: `out`,
// the folder that ConfineToTask returned, was removed. Otherwise the errors of WorkKind::Load and
// Work::Run.
absl::Status RunTask(const v1::Task& task, const UniqueFd& out,
                     const std::function<void(const v1::WorkerEvent&)>& report, std::stop_token stop);

// Reports an error as the last event, and returns it.
absl::Status ReportedToDaemon(const absl::Status& status,
                              const std::function<void(const v1::WorkerEvent&)>& report);

}  // namespace weft
