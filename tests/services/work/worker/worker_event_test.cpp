#include "services/work/worker/worker_event.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>

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

TEST(WorkerEvent, ItsFieldsAreNamedAsInTheProtocol) {
  v1::WorkerUsage usage;
  usage.set_wall_s(2.5);
  usage.set_core_s(1.5);
  usage.set_peak_memory_mib(20);
  EXPECT_EQ(WorkerEventLine(EndedEvent(3, usage)),
            R"({"ended":{"exit_status":3,"core_s":1.5,"peak_memory_mib":20},)"
            R"("usage":{"wall_s":2.5,"core_s":1.5,"peak_memory_mib":20}})");
}

TEST(WorkerEvent, BeginsOnThisMachineNow) {
  char host[256] = "";
  ASSERT_EQ(gethostname(host, sizeof(host)), 0);
  const auto now_ns = [] {
    return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
  };
  const int64_t before_ns = now_ns();
  const v1::WorkerEvent event = BeganEvent();
  EXPECT_EQ(event.began().host(), host);
  EXPECT_GE(event.began().host_unix_ns(), before_ns);
  EXPECT_LE(event.began().host_unix_ns(), now_ns());
}

}  // namespace
}  // namespace weft
