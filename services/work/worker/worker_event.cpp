#include "services/work/worker/worker_event.h"

#include <google/protobuf/util/json_util.h>
#include <unistd.h>

#include "base/host_clock.h"
#include "base/status_macros.h"
#include "services/formats/files/json_file.h"

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
  WEFT_RETURN_IF_ERROR(ParseJson(line, "worker", event));
  if (event.event_case() == v1::WorkerEvent::EVENT_NOT_SET) {
    return absl::InvalidArgumentError("worker: a line without an event");
  }
  return event;
}

v1::WorkerEvent BeganEvent() {
  char host[256] = "";
  gethostname(host, sizeof(host) - 1);
  v1::WorkerEvent event;
  event.mutable_began()->set_host(host);
  event.mutable_began()->set_host_unix_ns(HostTime_ns());
  return event;
}

v1::WorkerEvent EndedEvent(int exit_status, const v1::WorkerUsage& usage) {
  v1::WorkerEvent event;
  v1::WorkerEnded& ended = *event.mutable_ended();
  ended.set_exit_status(exit_status);
  ended.set_core_s(usage.core_s());
  ended.set_peak_memory_mib(usage.peak_memory_mib());
  *event.mutable_usage() = usage;
  return event;
}

}  // namespace weft
