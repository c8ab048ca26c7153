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
#include "learning/prior_training.h"

namespace weft::learning {
namespace {

volatile std::sig_atomic_t stopped = 0;

// A line of weft.v1.NetTrainingProgress.
void PrintProgress(const NetProgress& at) {
  std::printf(R"({"share": %.4f, "minutes": %.2f, "step": %lld, "loss": %.4f)", at.share, at.minutes,
              static_cast<long long>(at.step), at.loss);
  const char* before = R"(, "held_out": [)";
  for (const HeldOutScore& score : at.scores) {
    std::printf(R"(%s{"cameras": %d, "frames": %d, "before_mm": %.4f, "after_mm": %.4f})", before,
                score.cameras, score.samples, score.before_mm, score.after_mm);
    before = ", ";
  }
  std::printf("%s}\n", at.scores.empty() ? "" : "]");
  std::fflush(stdout);
}

// Whole or not at all.
void Write(const std::string& path, const std::string& bytes) {
  const std::string draft = path + ".part";
  std::ofstream file(draft, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) throw std::runtime_error(path + ": can't be written");
  std::filesystem::rename(draft, path);
}

int Stopped() {
  std::fprintf(stderr, "weft-train: stopped; the same command goes on\n");
  return 1;
}

int MakePrior(const std::string& tables, const std::string& out, const PriorTraining& training) {
  const TrainedPrior prior = TrainPrior(tables, training, PrintProgress, [] { return stopped != 0; });
  if (!prior.is_finished) return Stopped();
  Write(out + "/prior.bin", prior.tables);
  return 0;
}

struct TrainerOptions {
  NetTraining training;
  std::string samples, out;
  int threads = 2;
  bool is_prior = false, is_of_pixels = false;
};

void AddOptions(CLI::App& app, TrainerOptions& options) {
  app.add_option("samples", options.samples, "File of samples")->required();
  app.add_option("--out", options.out, "Folder, made where it is missing")->required();
  app.add_option("--steps", options.training.steps, "How many batches it learns from")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  app.add_option("--minutes", options.training.minutes,
                 "It ends after these at the latest, earlier runs included; 0 for none")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--batch", options.training.batch, "Samples a step")->capture_default_str();
  app.add_option("--rate", options.training.rate, "Step size of AdamW at the start")->capture_default_str();
  app.add_option("--widths", options.training.widths, "Channels of the levels, finest first")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--seed", options.training.seed, "Of weights and order")->capture_default_str();
  app.add_flag(
      "--prior", options.is_prior,
      "Train the prior of a deformation graph's poses instead, on a file of poses; writes prior.bin. It "
      "takes minutes, and a stopped run begins anew");
  app.add_flag("--pixels", options.is_of_pixels,
               "The samples are of pixels and end with tangents: learn by squared distances of vertices and "
               "normals");
  app.add_option("--threads", options.threads, "Threads")->capture_default_str();
}

int Main(int argc, char** argv) {
  TrainerOptions options;
  CLI::App app(
      "Trains the net of an avatar on a file of samples, and writes net.onnx, sample.bin and training.json "
      "into "
      "--out. A stopped run goes on from its checkpoint with the same command. `weft avatar train --net` "
      "makes "
      "the samples and calls this.");
  AddOptions(app, options);
  CLI11_PARSE(app, argc, argv);
  NetTraining& training = options.training;
  torch::set_num_threads(options.threads);
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stopped = 1; });
  std::filesystem::create_directories(options.out);
  if (options.is_prior) {
    PriorTraining of_prior;
    of_prior.seed = training.seed;
    of_prior.steps = training.steps;
    return MakePrior(options.samples, options.out, of_prior);
  }
  if (options.is_of_pixels) training.loss = NetLoss::kVerticesAndNormals;
  const SampleFile file(options.samples);
  training.checkpoint = options.out + "/checkpoint.pt";
  const TrainedNet net = TrainNet(file, training, PrintProgress, [] { return stopped != 0; });
  if (!net.is_finished) return Stopped();
  Write(options.out + "/net.onnx", net.onnx);
  Write(options.out + "/sample.bin", net.sample);
  // Last: with it the training is over (weft.v1.AvatarNetTraining).
  char text[200];
  std::snprintf(text, sizeof(text), R"({"seed": %llu, "steps": %lld, "steps_taken": %lld, "threads": %d}
)",
                static_cast<unsigned long long>(training.seed), static_cast<long long>(training.steps),
                static_cast<long long>(net.steps), options.threads);
  Write(options.out + "/training.json", text);
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
