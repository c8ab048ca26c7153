#include "services/server/daemon/program/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>
#include <sys/resource.h>

#include <filesystem>
#include <utility>

#include "services/ground/process/freed_memory.h"

namespace weft {
namespace {

using prometheus::BuildCounter;
using prometheus::BuildGauge;
using prometheus::BuildHistogram;

prometheus::Gauge& AddGauge(prometheus::Registry& registry, const char* name, const char* help) {
  return BuildGauge().Name(name).Help(help).Register(registry).Add({});
}

// Names of clients' making are one: Prometheus keeps each that it ever saw.
std::string LabelOf(const Method& method) { return method.name.front() == '/' ? "other" : method.name; }

double OpenDescriptors() {
  std::error_code error;
  const std::filesystem::directory_iterator folder("/proc/self/fd", error);
  return error ? 0 : static_cast<double>(std::distance(begin(folder), end(folder)));
}

double CpuSeconds() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

struct Metrics::Families {
  prometheus::Registry registry;

  prometheus::Family<prometheus::Counter>& calls =
      BuildCounter()
          .Name("weft_calls_total")
          .Help("Calls of gRPC methods that have ended, refused ones too, by outcome")
          .Register(registry);
  prometheus::Family<prometheus::Histogram>& call_seconds =
      BuildHistogram()
          .Name("weft_call_seconds")
          .Help("How long unary calls took in the daemon")
          .Register(registry);
  prometheus::Family<prometheus::Gauge>& jobs =
      BuildGauge().Name("weft_jobs").Help("Jobs that have not ended, by state").Register(registry);
  prometheus::Family<prometheus::Gauge>& running =
      BuildGauge().Name("weft_calls_running").Help("Calls that run, by kind").Register(registry);
  prometheus::Family<prometheus::Counter>& frames =
      BuildCounter()
          .Name("weft_frames_total")
          .Help("Frames that workers have ended since the daemon began, by outcome")
          .Register(registry);

  prometheus::Gauge& queued = jobs.Add({{"state", "queued"}});
  prometheus::Gauge& jobs_running = jobs.Add({{"state", "running"}});
  prometheus::Gauge& unary = running.Add({{"kind", "unary"}});
  prometheus::Gauge& streams = running.Add({{"kind", "stream"}});
  prometheus::Gauge& uploads = running.Add({{"kind", "upload"}});
  prometheus::Counter& done = frames.Add({{"outcome", "done"}});
  prometheus::Counter& failed = frames.Add({{"outcome", "failed"}});
  prometheus::Gauge& watchers = AddGauge(registry, "weft_job_watchers", "Clients that watch jobs");
  prometheus::Gauge& workers = AddGauge(registry, "weft_workers", "Worker processes at the most");
  prometheus::Gauge& connections = AddGauge(registry, "weft_connections", "Connections of gRPC clients");
  prometheus::Gauge& takes = AddGauge(registry, "weft_takes_recording", "Takes that are being recorded");
  prometheus::Gauge& dropped =
      AddGauge(registry, "weft_recording_sets_dropped", "Frame sets that takes being recorded have lost");
  prometheus::Gauge& missing =
      AddGauge(registry, "weft_recording_frames_missing", "Frames that takes being recorded lack");
  prometheus::Gauge& free =
      AddGauge(registry, "weft_state_free_bytes", "Room on the disk of the state folder");
  prometheus::Gauge& serving = AddGauge(registry, "weft_serving", "1 while health says SERVING, otherwise 0");
  prometheus::Gauge& resident =
      AddGauge(registry, "process_resident_memory_bytes", "Memory of weftd, without workers");
  prometheus::Gauge& descriptors = AddGauge(registry, "process_open_fds", "Open descriptors of weftd");
  prometheus::Gauge& started =
      AddGauge(registry, "process_start_time_seconds", "When weftd began, since 1970");
  prometheus::Counter& cpu = BuildCounter()
                                 .Name("process_cpu_seconds_total")
                                 .Help("Processor time of weftd, without workers")
                                 .Register(registry)
                                 .Add({});
};

Metrics::Metrics(std::function<DaemonLoad()> load, double started_s)
    : load_(std::move(load)), families_(std::make_unique<Families>()) {
  families_->started.Set(started_s);
}

Metrics::~Metrics() = default;

void Metrics::Count(const ObservedCall& call) {
  const std::string method = LabelOf(call.method);
  families_->calls.Add({{"method", method}, {"outcome", call.outcome}}).Increment();
  if (call.method.kind != CallKind::kUnary || call.lasted.count() == 0) return;
  // Not a static object: calls may end while the program does.
  const prometheus::Histogram::BucketBoundaries bounds_s = {
      0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30};
  families_->call_seconds.Add({{"method", method}}, bounds_s).Observe(call.lasted.count());
}

std::string Metrics::Text() {
  const DaemonLoad load = load_();
  Families& all = *families_;
  // Counters of ours that others count: what came since the last time.
  const auto advance = [](prometheus::Counter& counter, double value) {
    if (value > counter.Value()) counter.Increment(value - counter.Value());
  };
  all.queued.Set(load.jobs_queued);
  all.jobs_running.Set(load.jobs_running);
  all.unary.Set(load.calls_running);
  all.streams.Set(load.streams_running);
  all.uploads.Set(load.uploads_running);
  advance(all.done, static_cast<double>(load.frames_done));
  advance(all.failed, static_cast<double>(load.frames_failed));
  all.watchers.Set(load.watchers);
  all.workers.Set(load.workers);
  all.connections.Set(load.connections);
  all.takes.Set(load.takes_recording);
  all.dropped.Set(static_cast<double>(load.sets_dropped));
  all.missing.Set(static_cast<double>(load.frames_missing));
  all.free.Set(static_cast<double>(load.state_free_bytes));
  all.serving.Set(load.serving ? 1 : 0);
  all.resident.Set(static_cast<double>(ResidentBytes()));
  all.descriptors.Set(OpenDescriptors());
  advance(all.cpu, CpuSeconds());
  return prometheus::TextSerializer().Serialize(all.registry.Collect());
}

}  // namespace weft
