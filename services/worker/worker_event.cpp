#include "services/worker/worker_event.h"

#include <google/protobuf/util/json_util.h>

#include "services/files/json_file.h"

namespace weft {

std::string WorkerEventLine(const v1::WorkerEvent& event) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string line;
  // Fails for google.protobuf.Any alone, which the message does not hold.
  if (!google::protobuf::util::MessageToJsonString(event, &line, options).ok()) line.clear();
  return line;
}

absl::StatusOr<v1::WorkerEvent> ParseWorkerEvent(std::string_view line) {
  v1::WorkerEvent event;
  if (absl::Status status = ParseJson(line, "worker", event); !status.ok()) return status;
  if (event.event_case() == v1::WorkerEvent::EVENT_NOT_SET) {
    return absl::InvalidArgumentError("worker: a line without an event");
  }
  return event;
}

}  // namespace weft
