#include "learning/offset_net.h"

#include <gtest/gtest.h>
#include <torch/torch.h>

#include <algorithm>
#include <cmath>

#include "learning/onnx_export.h"
#include "nets/net.h"

namespace weft::learning {
namespace {

OffsetNet RandomNet(const NetShape& shape) {
  torch::manual_seed(3);
  OffsetNet net(shape);
  torch::NoGradGuard no_grad;
  for (torch::Tensor& p : net->parameters()) p.uniform_(-0.2, 0.2);
  return net;
}

TEST(OffsetNet, AnUntrainedNetAnswersNothing) {
  OffsetNet net(NetShape{5, 4, true, {8, 16}});
  const torch::Tensor answer = net->forward(torch::randn({2, 5, 16, 24}));
  EXPECT_EQ(answer.sizes(), (std::vector<int64_t>{2, 4, 16, 24}));
  EXPECT_EQ(answer.abs().max().item<float>(), 0);
}

// Table "Common", X2 of the design: what the product computes is what the trainer computed.
TEST(OffsetNet, OnnxAnswersAsTheTrainerDoes) {
  for (const std::vector<int64_t>& widths : {std::vector<int64_t>{8, 12}, {6, 8, 10, 12}}) {
    const NetShape shape{7, 4, true, widths};
    OffsetNet net = RandomNet(shape);
    auto loaded = Net::FromOnnx(NetToOnnx(net), "net.onnx");
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    torch::NoGradGuard no_grad;
    for (const auto& [height, width] : {std::pair(16, 24), {40, 8}}) {
      const torch::Tensor image = torch::randn({1, shape.features, height, width});
      const torch::Tensor expected = net->forward(image).contiguous();
      const float* in = image.data_ptr<float>();
      const auto outputs =
          loaded->Run({{"image", {shape.features, height, width, {in, in + image.numel()}}}});
      ASSERT_TRUE(outputs.ok()) << outputs.status();
      const Tensor& answer = outputs->at("answer");
      EXPECT_EQ(answer.shape(), (TensorShape{shape.answers, height, width}));
      const float largest = expected.abs().max().item<float>();
      for (size_t i = 0; i < answer.values.size(); ++i)
        ASSERT_NEAR(answer.values[i], expected.data_ptr<float>()[i], 1e-4f * largest);
    }
  }
}

}  // namespace
}  // namespace weft::learning
