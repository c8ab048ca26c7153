#include "learning/net_training.h"

#include <gtest/gtest.h>
#include <torch/torch.h>

#include <cstring>
#include <stdexcept>
#include <string>

#include "nets/net.h"
#include "tests/capture/temp_folder.h"

namespace weft::learning {
namespace {

constexpr int kSide = 16, kFeatures = 5, kOffsets = 3;

template <class T>
void AppendBytes(const T& value, std::string* out) {
  out->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

// Samples whose offsets are a sum of two features: what can be learnt in a few steps. `tangents` more
// features are those of a plane.
std::string LearnableFile(int tangents = 0) {
  std::string out = "weftsmp1";
  const uint32_t texels = kSide * kSide;
  for (const uint32_t n : {static_cast<uint32_t>(kFeatures + tangents), uint32_t{kOffsets}, uint32_t{kSide},
                           uint32_t{kSide}, texels})
    AppendBytes(n, &out);
  for (uint32_t t = 0; t < texels; ++t) AppendBytes(t, &out);
  out.append(texels, 1);
  torch::manual_seed(5);
  for (uint32_t s = 0; s < 40; ++s) {
    const bool is_held_out = s >= 30;
    for (const uint32_t n : {is_held_out ? 1u : 0u, 0u, s, 2u + s % 2}) AppendBytes(n, &out);
    torch::Tensor features = torch::randn({kFeatures, texels});
    torch::Tensor offsets = torch::zeros({kOffsets, texels});
    offsets[0] = 0.5 * features[1] + 0.25 * features[2];
    if (tangents > 0) {
      features = torch::cat({features, torch::zeros({tangents, texels})});
      features[kFeatures].fill_(1.2), features[kFeatures + 4].fill_(1.2);
    }
    for (const torch::Tensor& tensor : {features, offsets}) {
      const torch::Tensor halves = tensor.to(torch::kHalf).contiguous();
      out.append(static_cast<const char*>(halves.data_ptr()), 2 * static_cast<size_t>(halves.numel()));
    }
  }
  return out;
}

std::string Written(const std::string& bytes, const std::string& path) {
  WriteBytes(path, bytes);
  return path;
}

class TrainNetTest : public testing::Test {
 protected:
  TrainNetTest() {
    torch::set_num_threads(2);
    training_.options.steps = 60;
    training_.widths = {8, 12};
  }
  Trained Learn(int stop_after = -1) {
    scores_.clear();
    share_ = 0;
    int asked = 0;
    return Train([this] { return MakeNetLearner(file_, training_); }, training_.options,
                 [this](const TrainingProgress& now) {
                   EXPECT_GE(now.share, share_);
                   share_ = now.share;
                   if (!now.scores.empty()) scores_.push_back(now.scores);
                 },
                 [&] { return stop_after >= 0 && ++asked > stop_after; });
  }

  // Of this test alone: a file that another process writes anew while it is mapped ends this one with SIGBUS.
  const TempFolder folder_;
  const SampleFile file_{Written(LearnableFile(), folder_ / "learnable.samples")};
  NetTraining training_;
  double share_ = 0;
  std::vector<std::vector<HeldOutScore>> scores_;
};

TEST_F(TrainNetTest, ComesNearerToTheTruthOfHeldOutFrames) {
  training_.options.steps = 300;
  const Trained net = Learn();
  ASSERT_TRUE(net.is_finished);
  EXPECT_EQ(net.steps, 300);
  ASSERT_EQ(scores_.back().size(), 2u);
  for (const HeldOutScore& score : scores_.back()) {
    EXPECT_EQ(score.samples, 5);
    EXPECT_LT(score.after_mm, 0.75 * score.before_mm);
  }
  EXPECT_EQ(scores_.front()[0].after_mm, scores_.front()[0].before_mm);  // untrained
  EXPECT_TRUE(Net::FromOnnx(net.files.at(kNetFile), "net.onnx").ok());
}

TEST_F(TrainNetTest, LearnsVerticesAndNormalsOfSamplesWithTangents) {
  const SampleFile file(Written(LearnableFile(kTangents), folder_ / "tangents.samples"));
  training_.loss = NetLoss::kVerticesAndNormals;
  training_.options.steps = 300;
  std::vector<HeldOutScore> last;
  const Trained net = Train([&] { return MakeNetLearner(file, training_); }, training_.options,
                            [&](const TrainingProgress& now) {
                              if (!now.scores.empty()) last = now.scores;
                            },
                            [] { return false; });
  ASSERT_TRUE(net.is_finished);
  for (const HeldOutScore& score : last) EXPECT_LT(score.after_mm, 0.75 * score.before_mm);
  // It is not told the tangents, and answers offsets alone.
  absl::StatusOr<Net> read = Net::FromOnnx(net.files.at(kNetFile), "net.onnx");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(Describe(read->inputs()), "\"image\" of 5 x any x any");
  EXPECT_EQ(Describe(read->outputs()), "\"answer\" of 3 x any x any");
  EXPECT_THROW(MakeNetLearner(file_, training_), std::runtime_error);
}

// Row X5 of the design.
TEST_F(TrainNetTest, GivesTheSameBytesAgain) {
  const Trained once = Learn();
  EXPECT_EQ(Learn().files, once.files);
  EXPECT_EQ(once.files.size(), 2u);
  training_.options.seed = 2;
  EXPECT_NE(Learn().files.at(kNetFile), once.files.at(kNetFile));
}

TEST_F(TrainNetTest, GoesOnWhereItWasStopped) {
  const Trained whole = Learn();
  training_.options.checkpoint = folder_ / "checkpoint.pt";
  const Trained stopped = Learn(25);
  EXPECT_FALSE(stopped.is_finished);
  EXPECT_TRUE(stopped.files.empty());
  const Trained rest = Learn();
  ASSERT_TRUE(rest.is_finished);
  EXPECT_EQ(rest.steps, 60);
  EXPECT_EQ(rest.files, whole.files);
}

}  // namespace
}  // namespace weft::learning
