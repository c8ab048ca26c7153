// weft-train: trains the net of an avatar on a file of samples. `weft avatar train` calls it.
#include <torch/torch.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "learning/net_training.h"

namespace weft::learning {
namespace {

volatile std::sig_atomic_t stopped = 0;

// A line of JSON for each look at the samples that were held out.
void PrintProgress(const NetProgress& at) {
  std::printf(R"({"minutes": %.2f, "step": %lld, "loss": %.4f)", at.minutes, static_cast<long long>(at.step),
              at.loss);
  for (const HeldOutScore& score : at.scores)
    std::printf(R"(, "%s_%d_cameras_mm": [%.3f, %.3f])",
                score.split == Split::kUnseen ? "unseen" : "validate", score.cameras, score.before_mm,
                score.after_mm);
  std::printf("}\n");
  std::fflush(stdout);
}

void Write(const std::string& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) throw std::runtime_error(path + ": can't be written");
}

int Main(int argc, char** argv) {
  NetTraining training;
  std::string samples, out;
  int threads = 2;
  CLI::App app(
      "Trains the net of an avatar on a file of samples, and writes net.onnx and sample.bin into --out. A "
      "stopped run "
      "goes on from its checkpoint with the same command. `weft avatar train --net` makes the samples and "
      "calls this.");
  app.add_option("samples", samples, "File of samples")->required();
  app.add_option("--out", out, "Folder, made where it is missing")->required();
  app.add_option("--minutes", training.minutes, "How long to train, earlier runs included")
      ->capture_default_str();
  app.add_option("--steps", training.steps, "Stop after so many steps; 0 for none")->capture_default_str();
  app.add_option("--batch", training.batch, "Samples a step")->capture_default_str();
  app.add_option("--rate", training.rate, "Step size of AdamW at the start")->capture_default_str();
  app.add_option("--widths", training.widths, "Channels of the levels, finest first")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--seed", training.seed, "Of weights and order")->capture_default_str();
  app.add_option("--threads", threads, "Threads")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  torch::set_num_threads(threads);
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stopped = 1; });
  std::filesystem::create_directories(out);
  const SampleFile file(samples);
  training.checkpoint = out + "/checkpoint.pt";
  const TrainedNet net = TrainNet(file, training, PrintProgress, [] { return stopped != 0; });
  if (!net.is_finished) {
    std::fprintf(stderr, "weft-train: stopped; the same command goes on\n");
    return 1;
  }
  Write(out + "/net.onnx", net.onnx);
  Write(out + "/sample.bin", net.sample);
  std::filesystem::remove(training.checkpoint);
  return 0;
}

}  // namespace
}  // namespace weft::learning

int main(int argc, char** argv) {
  try {
    return weft::learning::Main(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "weft-train: %s\n", e.what());
    return 1;
  }
}
