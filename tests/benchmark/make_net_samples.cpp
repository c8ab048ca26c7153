// Samples for weft-train from a data set of `weft dataset make`: `make_net_samples --help`.
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "services/work/animation/net_samples.h"

int main(int argc, char** argv) {
  weft::NetSampleRequest request;
  std::vector<std::string> sources;
  size_t threads = 2;
  CLI::App app(
      "Drives the takes of a data set by shape spaces that never saw them, and writes what a net can learn "
      "from that. "
      "Then `weft-train net SAMPLES --out NET` trains it, and `accuracy_drive TAKES --net NET` measures it.");
  app.add_option("sources", sources, "Data sets, or simulated takes")->required();
  app.add_option("--out", request.out, "File of samples")->required();
  app.add_option("--level", request.atlas.level, "A texel is 2^level cells wide")->capture_default_str();
  app.add_option("--gutter", request.atlas.gutter, "Texels beyond seams")->capture_default_str();
  app.add_option("--rigs", request.rigs, "Camera set-ups for each take and space")->capture_default_str();
  app.add_option("--every", request.every, "Frames from one sample to the next")->capture_default_str();
  app.add_option("--max-frames", request.training.max_frames, "Frames that a space learns from, at most")
      ->capture_default_str();
  app.add_option("--threads", threads, "Threads")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  auto takes = weft::TrainingTakes::Open(sources, {}, "", 0);
  const absl::Status status =
      !takes.ok()
          ? takes.status()
          : weft::MakeNetSamples(*takes, request,
                                 [](std::string_view stage, double share) {
                                   std::printf("%s %.0f %%\n", std::string(stage).c_str(), 100 * share);
                                   std::fflush(stdout);
                                 },
                                 {});
  if (!status.ok()) std::fprintf(stderr, "%s\n", std::string(status.message()).c_str());
  return status.ok() ? 0 : 1;
}
