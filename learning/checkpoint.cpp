#include "learning/checkpoint.h"

#include <ATen/CPUGeneratorImpl.h>
#include <torch/torch.h>

#include <filesystem>

namespace weft::learning {
namespace {

at::Generator TorchGenerator() { return at::detail::getDefaultCPUGenerator(); }

}  // namespace

void SaveCheckpoint(const std::string& path, torch::nn::Module& model, torch::optim::Optimizer& optimizer,
                    const TrainingState& state) {
  torch::serialize::OutputArchive archive, of_net, of_optimizer;
  model.save(of_net);
  optimizer.save(of_optimizer);
  archive.write("net", of_net);
  archive.write("optimizer", of_optimizer);
  archive.write("step", torch::tensor(state.step));
  archive.write("minutes", torch::tensor(state.minutes, torch::kDouble));
  archive.write("generator", TorchGenerator().get_state());
  archive.save_to(path + ".part");
  std::filesystem::rename(path + ".part", path);
}

TrainingState LoadCheckpoint(const std::string& path, torch::nn::Module& model,
                             torch::optim::Optimizer& optimizer) {
  torch::serialize::InputArchive archive, of_net, of_optimizer;
  archive.load_from(path);
  archive.read("net", of_net);
  model.load(of_net);
  archive.read("optimizer", of_optimizer);
  optimizer.load(of_optimizer);
  torch::Tensor steps, minutes, generator;
  archive.read("step", steps);
  archive.read("minutes", minutes);
  if (archive.try_read("generator", generator)) TorchGenerator().set_state(generator);
  return {steps.item<int64_t>(), minutes.item<double>()};
}

}  // namespace weft::learning
