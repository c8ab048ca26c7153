#include "services/server/daemon/program/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <string>

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(MetricsText, HasWhatTheLoadSays) {
  DaemonLoad load;
  load.jobs_queued = 3;
  load.frames_done = 5;
  load.frames_failed = 1;
  load.serving = false;
  Metrics metrics([&] { return load; }, 1.5);
  std::string text = metrics.Text();
  EXPECT_THAT(text, HasSubstr("\nweft_jobs{state=\"queued\"} 3"));
  EXPECT_THAT(text, HasSubstr("\nweft_frames_total{outcome=\"done\"} 5"));
  EXPECT_THAT(text, HasSubstr("\nweft_frames_total{outcome=\"failed\"} 1"));
  EXPECT_THAT(text, HasSubstr("\nweft_serving 0"));
  EXPECT_THAT(text, HasSubstr("\nprocess_start_time_seconds 1.5"));
  EXPECT_THAT(text, HasSubstr("# TYPE weft_frames_total counter"));
  load.jobs_queued = 0;
  load.frames_done = 8;
  text = metrics.Text();
  EXPECT_THAT(text, HasSubstr("\nweft_jobs{state=\"queued\"} 0"));
  EXPECT_THAT(text, HasSubstr("\nweft_frames_total{outcome=\"done\"} 8"));
}

TEST(MetricsText, HasEveryNumberOfTheLoad) {
  DaemonLoad load;
  load.jobs_queued = 11;
  load.jobs_running = 12;
  load.calls_running = 13;
  load.streams_running = 14;
  load.uploads_running = 15;
  load.frames_done = 16;
  load.frames_failed = 17;
  load.watchers = 18;
  load.workers = 19;
  load.connections = 20;
  load.takes_recording = 21;
  load.sets_dropped = 22;
  load.frames_missing = 23;
  load.state_free_bytes = 24;
  load.serving = true;
  Metrics metrics([&] { return load; }, 25);
  const std::string text = metrics.Text();
  for (const char* line : {"weft_jobs{state=\"queued\"} 11", "weft_jobs{state=\"running\"} 12",
                           "weft_calls_running{kind=\"unary\"} 13", "weft_calls_running{kind=\"stream\"} 14",
                           "weft_calls_running{kind=\"upload\"} 15", "weft_frames_total{outcome=\"done\"} 16",
                           "weft_frames_total{outcome=\"failed\"} 17", "weft_job_watchers 18",
                           "weft_workers 19", "weft_connections 20", "weft_takes_recording 21",
                           "weft_recording_sets_dropped 22", "weft_recording_frames_missing 23",
                           "weft_state_free_bytes 24", "weft_serving 1", "process_start_time_seconds 25"})
    EXPECT_THAT(text, HasSubstr(std::string("\n") + line + "\n"));
  const auto value_of = [&](const std::string& name) {
    const size_t at = text.find("\n" + name + " ");
    return at == std::string::npos ? -1 : std::stod(text.substr(at + name.size() + 2));
  };
  EXPECT_GT(value_of("process_resident_memory_bytes"), 1e6);
  EXPECT_GE(value_of("process_open_fds"), 3);
  EXPECT_LT(value_of("process_open_fds"), 1e5);
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  const double most_s = static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) + 2;
  EXPECT_GT(value_of("process_cpu_seconds_total"), 0);
  EXPECT_LE(value_of("process_cpu_seconds_total"), most_s);
}

TEST(MetricsText, CountsCallsByMethodAndOutcome) {
  Metrics metrics([] { return DaemonLoad(); }, 0);
  const Method submit{.name = "Jobs.SubmitJob"}, watch{.name = "Jobs.WatchJob", .kind = CallKind::kStream};
  metrics.Count({submit, "OK", std::chrono::milliseconds(3)});
  metrics.Count({submit, "OK", std::chrono::milliseconds(5)});
  metrics.Count({submit, "UNAUTHENTICATED", std::chrono::seconds(0)});
  metrics.Count({watch, "OK", std::chrono::hours(1)});
  const std::string text = metrics.Text();
  EXPECT_THAT(text, HasSubstr("weft_calls_total{method=\"Jobs.SubmitJob\",outcome=\"OK\"} 2"));
  EXPECT_THAT(text, HasSubstr("weft_calls_total{method=\"Jobs.SubmitJob\",outcome=\"UNAUTHENTICATED\"} 1"));
  EXPECT_THAT(text, HasSubstr("weft_calls_total{method=\"Jobs.WatchJob\",outcome=\"OK\"} 1"));
  // Refused calls and streams say nothing of how fast the daemon is.
  EXPECT_THAT(text, HasSubstr("weft_call_seconds_count{method=\"Jobs.SubmitJob\"} 2"));
  EXPECT_THAT(text, Not(HasSubstr("weft_call_seconds_count{method=\"Jobs.WatchJob\"}")));
}

// Else a client could fill the daemon's memory with names.
TEST(MetricsText, HasOneNameForAllThatClientsMakeUp) {
  Metrics metrics([] { return DaemonLoad(); }, 0);
  for (int i = 0; i < 3; ++i)
    metrics.Count({{.name = "/a.b/C" + std::to_string(i)}, "UNIMPLEMENTED", std::chrono::seconds(0)});
  const std::string text = metrics.Text();
  EXPECT_THAT(text, HasSubstr("weft_calls_total{method=\"other\",outcome=\"UNIMPLEMENTED\"} 3"));
  EXPECT_THAT(text, Not(HasSubstr("/a.b/")));
}

}  // namespace
}  // namespace weft
