// weft-train as a child process.
#pragma once

#include <functional>
#include <stop_token>

#include "absl/status/status.h"
#include "services/work/animation/training_folder.h"
#include "weft/v1/avatar.pb.h"

namespace weft {

// FailedPrecondition, with the remedy, where this weft has no weft-train beside it.
absl::Status CheckNetTrainer();

// Runs it. `on_progress` is called for each line that it prints. Once `stop` is requested it is told to end,
// keeps what it knows, and the status is Cancelled; the same task goes on. Internal: it failed, with what it
// printed; errors of ChildProcess::Spawn.
absl::Status RunNetTrainer(const NetTask& task,
                           const std::function<void(const v1::NetTrainingProgress& now)>& on_progress,
                           const std::stop_token& stop);

}  // namespace weft
