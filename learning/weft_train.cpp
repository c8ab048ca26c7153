// weft-train: trains the nets of avatars. `weft avatar train` calls it.
#include <torch/torch.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "learning/net_training.h"
#include "learning/prior_training.h"
#include "learning/training_loop.h"

namespace weft::learning {
namespace {

volatile std::sig_atomic_t stopped = 0;

// A line of weft.v1.NetTrainingProgress.
void PrintProgress(const TrainingProgress& at) {
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

// Of each kind of training.
struct Command {
  std::string data, out;
  int threads = 2;
};

void AddOptions(CLI::App& app, Command& command, TrainingOptions& options) {
  app.add_option("data", command.data, "File that it learns from")->required();
  app.add_option("--out", command.out, "Folder, made where it is missing")->required();
  app.add_option("--steps", options.steps, "How many batches it learns from")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  app.add_option("--minutes", options.minutes,
                 "It ends after these at the latest, earlier runs included; 0 for none")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--batch", options.batch, "Samples a step")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--rate", options.rate, "Step size of AdamW at the start")->capture_default_str();
  app.add_option("--seed", options.seed, "Of weights and order")->capture_default_str();
  app.add_option("--threads", command.threads, "Threads")->capture_default_str();
}

void AddWidths(CLI::App& app, NetTraining& training) {
  app.add_option("--widths", training.widths, "Channels of the levels, finest first")
      ->delimiter(',')
      ->capture_default_str();
}

// Trains and writes the files; the checkpoint lies beside them until then. A `record` is written last: with
// it the training is over (weft.v1.AvatarNetTraining).
template <class Make>
int TrainInto(const Command& command, TrainingOptions& options, const char* checkpoint, const char* record,
              const Make& make) {
  torch::set_num_threads(command.threads);
  std::filesystem::create_directories(command.out);
  options.checkpoint = command.out + "/" + checkpoint;
  const Trained trained = Train(make, options, PrintProgress, [] { return stopped != 0; });
  if (!trained.is_finished) {
    std::fprintf(stderr, "weft-train: stopped; the same command goes on\n");
    return 1;
  }
  for (const auto& [name, bytes] : trained.files) Write(command.out + "/" + name, bytes);
  if (record != nullptr) {
    char text[200];
    std::snprintf(text, sizeof(text), R"({"seed": %llu, "steps": %lld, "steps_taken": %lld, "threads": %d}
)",
                  static_cast<unsigned long long>(options.seed), static_cast<long long>(options.steps),
                  static_cast<long long>(trained.steps), command.threads);
    Write(command.out + "/" + record, text);
  }
  std::filesystem::remove(options.checkpoint);
  return 0;
}

int TrainNet(const Command& command, NetTraining& training) {
  const SampleFile file(command.data);
  return TrainInto(command, training.options, "checkpoint.pt", "training.json",
                   [&] { return MakeNetLearner(file, training); });
}

int TrainPrior(const Command& command, PriorTraining& training) {
  return TrainInto(command, training.options, "prior_checkpoint.pt", nullptr,
                   [&] { return MakePriorLearner(command.data, training); });
}

int Main(int argc, char** argv) {
  CLI::App app(
      "Trains nets of avatars. A stopped run goes on from its checkpoint with the same command. "
      "`weft avatar train` makes what they learn from and calls this.");
  app.require_subcommand(1);
  Command command;
  NetTraining of_net, of_pixels;
  of_pixels.loss = NetLoss::kVerticesAndNormals;
  PriorTraining of_prior;
  CLI::App& net = *app.add_subcommand(
      "net",
      "How far driven meshes are off, from a file of samples; writes net.onnx, sample.bin, training.json");
  AddOptions(net, command, of_net.options);
  AddWidths(net, of_net);
  CLI::App& pixels = *app.add_subcommand(
      "pixels",
      "The same by squared distances of vertices and normals, from samples of pixels that end with tangents");
  AddOptions(pixels, command, of_pixels.options);
  AddWidths(pixels, of_pixels);
  CLI::App& prior = *app.add_subcommand(
      "prior", "The prior of a deformation graph's poses, from a file of poses; writes prior.bin");
  AddOptions(prior, command, of_prior.options);
  CLI11_PARSE(app, argc, argv);
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stopped = 1; });
  if (prior.parsed()) return TrainPrior(command, of_prior);
  return TrainNet(command, pixels.parsed() ? of_pixels : of_net);
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
