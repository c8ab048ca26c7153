#include "learning/prior_training.h"

#include <gtest/gtest.h>
#include <torch/torch.h>

#include <cmath>
#include <stdexcept>

#include "learning/table_file.h"
#include "tests/capture/temp_folder.h"

namespace weft::learning {
namespace {

constexpr int kNodes = 5, kVertices = 50, kNumbers = 6 * (kNodes - 1);

// A rope of five nodes, 100 mm apart, that curls up: each node turns by the same angle against the one
// before.
std::map<std::string, NumberTable> Rope(int poses, int held_out) {
  std::map<std::string, NumberTable> out;
  const auto poses_of = [](int count, int phase) {
    NumberTable table{static_cast<size_t>(count), kNumbers, {}};
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < kNumbers; ++k)
        table.values.push_back(k % 6 == 2 ? static_cast<float>(0.5 * std::sin(1.7 * i + phase)) : 0);
    return table;
  };
  out["pose"] = poses_of(poses, 0);
  out["held_out_pose"] = poses_of(held_out, 1);
  out["unit"] = {1, kNumbers, std::vector<float>(kNumbers, 1)};
  out["parent"] = {1, kNodes, {-1, 0, 1, 2, 3}};
  out["node_mm"] = {kNodes, 3, {}};
  for (int i = 0; i < kNodes; ++i)
    for (const float x : {100.0f * static_cast<float>(i), 0.0f, 0.0f}) out["node_mm"].values.push_back(x);
  out["rest_mm"] = {kVertices, 3, {}}, out["skin_node"] = {kVertices, 2, {}},
  out["skin_weight"] = {kVertices, 2, {}};
  for (int v = 0; v < kVertices; ++v) {
    const float at = 4.0f * static_cast<float>(v) / (kVertices - 1), below = std::min(3.0f, std::floor(at));
    for (const float x : {100 * at, 0.0f, 0.0f}) out["rest_mm"].values.push_back(x);
    for (const float node : {below, below + 1}) out["skin_node"].values.push_back(node);
    for (const float weight : {1 - (at - below), at - below}) out["skin_weight"].values.push_back(weight);
  }
  return out;
}

class TrainPriorTest : public testing::Test {
 protected:
  TrainPriorTest() {
    torch::set_num_threads(2);
    training_.options.steps = 250;
    training_.options.batch = 16;
    training_.latents = 2;
    training_.widths = {16, 24};
  }
  Trained Learn(const std::map<std::string, NumberTable>& tables, int stop_after = -1) {
    const std::string path = folder_ / "poses.bin";
    WriteBytes(path, EncodeTables(tables));
    int asked = 0;
    return Train([&] { return MakePriorLearner(path, training_); }, training_.options,
                 [this](const TrainingProgress& now) {
                   if (!now.scores.empty()) last_ = now.scores.front();
                 },
                 [&] { return stop_after >= 0 && ++asked > stop_after; });
  }

  TempFolder folder_;
  PriorTraining training_;
  HeldOutScore last_;
};

TEST_F(TrainPriorTest, HeldOutPosesComeBack) {
  const Trained prior = Learn(Rope(200, 20));
  ASSERT_TRUE(prior.is_finished);
  EXPECT_EQ(last_.samples, 20);
  EXPECT_GT(last_.before_mm, 40);
  EXPECT_LT(last_.after_mm, 0.25 * last_.before_mm);
  const std::string path = folder_ / "prior.bin";
  WriteBytes(path, prior.files.at(kPriorFile));
  const auto tables = ReadTables(path);
  EXPECT_EQ(tables.size(), 6u);
  EXPECT_EQ(tables.at("weight0").rows, 16u);
  EXPECT_EQ(tables.at("weight0").columns, 2u);
  EXPECT_EQ(tables.at("weight2").rows, static_cast<size_t>(kNumbers));
  EXPECT_EQ(tables.at("bias1").columns, 24u);
}

TEST_F(TrainPriorTest, TheSameSeedGivesTheSameBytes) {
  training_.options.steps = 20;
  const std::string first = Learn(Rope(40, 0)).files.at(kPriorFile);
  EXPECT_EQ(Learn(Rope(40, 0)).files.at(kPriorFile), first);
  training_.options.seed = 2;
  EXPECT_NE(Learn(Rope(40, 0)).files.at(kPriorFile), first);
}

TEST_F(TrainPriorTest, GoesOnWhereItWasStopped) {
  training_.options.steps = 20;
  const Trained whole = Learn(Rope(40, 4));
  training_.options.checkpoint = folder_ / "checkpoint.pt";
  EXPECT_FALSE(Learn(Rope(40, 4), 7).is_finished);
  const Trained rest = Learn(Rope(40, 4));
  ASSERT_TRUE(rest.is_finished);
  EXPECT_EQ(rest.files, whole.files);
}

TEST_F(TrainPriorTest, RefusesTablesThatDoNotFit) {
  auto tables = Rope(40, 0);
  tables.erase("parent");
  EXPECT_THROW(Learn(tables), std::runtime_error);
  EXPECT_THROW(Learn(Rope(1, 0)), std::runtime_error);
  tables = Rope(40, 0);
  tables["skin_node"].values[3] = 7;
  EXPECT_THROW(Learn(tables), std::runtime_error);
  tables = Rope(40, 0);
  tables["parent"].values[2] = 3;
  EXPECT_THROW(Learn(tables), std::runtime_error);
}

}  // namespace
}  // namespace weft::learning
