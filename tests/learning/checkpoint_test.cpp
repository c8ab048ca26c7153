#include "learning/checkpoint.h"

#include <gtest/gtest.h>
#include <torch/torch.h>

#include <filesystem>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft::learning {
namespace {

struct Learnt {
  torch::nn::Linear layer{2, 2};
  torch::optim::AdamW optimizer{layer->parameters(), torch::optim::AdamWOptions(0.1)};

  void Step() {
    optimizer.zero_grad();
    layer->forward(torch::ones({1, 2})).square().sum().backward();
    optimizer.step();
  }
};

TEST(Checkpoint, BringsBackAllThatTheNextStepDependsOn) {
  const TempFolder folder;
  const std::string path = folder / "checkpoint.pt";
  torch::manual_seed(7);
  Learnt learnt;
  learnt.Step(), learnt.Step();
  SaveCheckpoint(path, *learnt.layer, learnt.optimizer, {2, 1.25});
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  learnt.Step();
  // Five, of which torch draws in pairs.
  const torch::Tensor drawn = torch::cat({torch::randn({5}), torch::rand({5})});

  torch::manual_seed(8);
  Learnt other;
  const TrainingState state = LoadCheckpoint(path, *other.layer, other.optimizer);
  EXPECT_EQ(state.step, 2);
  EXPECT_EQ(state.minutes, 1.25);
  other.Step();
  EXPECT_TRUE(torch::equal(other.layer->weight, learnt.layer->weight));
  EXPECT_TRUE(torch::equal(other.layer->bias, learnt.layer->bias));
  EXPECT_TRUE(torch::equal(torch::cat({torch::randn({5}), torch::rand({5})}), drawn));
}

TEST(Checkpoint, OlderOnesLeaveTheGeneratorAsItIs) {
  const TempFolder folder;
  const std::string path = folder / "checkpoint.pt";
  Learnt learnt;
  learnt.Step();
  torch::serialize::OutputArchive archive, of_net, of_optimizer;
  learnt.layer->save(of_net);
  learnt.optimizer.save(of_optimizer);
  archive.write("net", of_net);
  archive.write("optimizer", of_optimizer);
  archive.write("step", torch::tensor(int64_t{1}));
  archive.write("minutes", torch::tensor(0.5, torch::kDouble));
  archive.save_to(path);
  Learnt other;
  torch::manual_seed(9);
  EXPECT_EQ(LoadCheckpoint(path, *other.layer, other.optimizer).step, 1);
  const torch::Tensor drawn = torch::randn({3});
  torch::manual_seed(9);
  EXPECT_TRUE(torch::equal(torch::randn({3}), drawn));
  EXPECT_TRUE(torch::equal(other.layer->weight, learnt.layer->weight));
}

TEST(Checkpoint, RefusesOtherModelsAndOtherFiles) {
  const TempFolder folder;
  const std::string path = folder / "checkpoint.pt";
  Learnt learnt;
  learnt.Step();
  SaveCheckpoint(path, *learnt.layer, learnt.optimizer, {1, 0});
  torch::nn::Sequential other(torch::nn::Linear(2, 2), torch::nn::Linear(2, 2));
  torch::optim::AdamW optimizer(other->parameters(), torch::optim::AdamWOptions(0.1));
  EXPECT_THROW(LoadCheckpoint(path, *other, optimizer), std::exception);
  WriteBytes(path, "no checkpoint");
  EXPECT_THROW(LoadCheckpoint(path, *learnt.layer, learnt.optimizer), std::exception);
}

}  // namespace
}  // namespace weft::learning
