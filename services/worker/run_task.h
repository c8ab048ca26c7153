// What a weft-worker does with its task.
#pragma once

#include <functional>
#include <stop_token>

#include "absl/status/status.h"
#include "weft/v1/task.pb.h"

namespace weft {

// Registers the task's frames and reports every event; calls never overlap. An error is reported as the last
// event, too. InvalidArgument names a field of the task. Otherwise the errors of LoadInputs and
// RegisterFrames.
absl::Status RunTask(const v1::Task& task, const std::function<void(const v1::WorkerEvent&)>& report,
                     std::stop_token stop);

}  // namespace weft
