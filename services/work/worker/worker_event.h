// Events of a worker as lines of JSON, the language of its standard output.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "weft/v1/task.pb.h"

namespace weft {

// One line without its end.
std::string WorkerEventLine(const v1::WorkerEvent& event);

// InvalidArgument: not a line of WorkerEventLine.
absl::StatusOr<v1::WorkerEvent> ParseWorkerEvent(std::string_view line);

// The events `began` and `ended` of this process.
v1::WorkerEvent BeganEvent();
v1::WorkerEvent EndedEvent(int exit_status, const v1::WorkerUsage& usage);

}  // namespace weft
