#include "services/server/daemon/program/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
