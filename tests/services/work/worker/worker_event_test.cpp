#include "services/work/worker/worker_event.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(WorkerEvent, IsOneLineWhateverItsStringsHold) {
  v1::WorkerEvent event;
  event.mutable_finished()->set_frame("0007");
  event.mutable_finished()->set_state(v1::FRAME_STATE_FAILED);
  event.mutable_finished()->set_reason("two\nlines, \"quotes\" and \xc3\xa4");
  event.mutable_finished()->set_coverage(0.25);
  const std::string line = WorkerEventLine(event);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const absl::StatusOr<v1::WorkerEvent> parsed = ParseWorkerEvent(line);
  ASSERT_TRUE(parsed.ok()) << parsed.status();
  EXPECT_EQ(parsed->SerializeAsString(), event.SerializeAsString());
}

TEST(WorkerEvent, RefusesWhatNoWorkerSays) {
  for (const char* line :
       {"", "{}", "hello", "{\"finished\": 3}", "{\"unknown\": {}}", "[1, 2]", "{\"started\":"}) {
    EXPECT_EQ(ParseWorkerEvent(line).status().code(), absl::StatusCode::kInvalidArgument) << line;
  }
}

}  // namespace
}  // namespace weft
