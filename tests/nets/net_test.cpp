#include "nets/net.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <string>

#include "nets/net_model.h"

namespace weft {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string ReadData(const std::string& name) {
  std::ifstream file(std::string(WEFT_TEST_DATA) + "/" + name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// An image, and what libtorch answers to it with the net of the same name.
struct Sample {
  Tensor image, answer;
};
Sample ReadSample() {
  const std::string bytes = ReadData("unet_sample.bin");
  const char* at = bytes.data() + 8;
  Sample out;
  for (Tensor* tensor : {&out.image, &out.answer}) {
    uint32_t sizes[3];
    std::memcpy(sizes, at, sizeof(sizes));
    tensor->channels = static_cast<int>(sizes[0]);
    tensor->height = static_cast<int>(sizes[1]);
    tensor->width = static_cast<int>(sizes[2]);
    tensor->values.resize(size_t{sizes[0]} * sizes[1] * sizes[2]);
    std::memcpy(tensor->values.data(), at + sizeof(sizes), sizeof(float) * tensor->values.size());
    at += sizeof(sizes) + sizeof(float) * tensor->values.size();
  }
  return out;
}

std::string Refusal(const std::string& bytes) {
  return std::string(Net::FromOnnx(bytes, "shirt.avatar/net.onnx").status().message());
}

TEST(Net, AnswersAsLibtorchDoes) {
  auto net = Net::FromOnnx(ReadData("unet.onnx"), "unet.onnx");
  ASSERT_TRUE(net.ok()) << net.status();
  const Sample sample = ReadSample();
  const auto outputs = net->Run({{"image", sample.image}});
  ASSERT_TRUE(outputs.ok()) << outputs.status();
  const Tensor& answer = outputs->at("answer");
  ASSERT_EQ(answer.values.size(), sample.answer.values.size());
  float largest = 0;
  for (const float x : sample.answer.values) largest = std::max(largest, std::abs(x));
  ASSERT_GT(largest, 0.01f);
  for (size_t i = 0; i < answer.values.size(); ++i)
    EXPECT_NEAR(answer.values[i], sample.answer.values[i], 1e-4f * largest);
}

TEST(Net, SameBytesAtOneAndTwoThreads) {
  const Sample sample = ReadSample();
  std::vector<std::vector<float>> answers;
  for (const int threads : {1, 2, 1}) {
    cv::setNumThreads(threads);
    auto net = Net::FromOnnx(ReadData("unet.onnx"), "unet.onnx");
    answers.push_back(net->Run({{"image", sample.image}})->at("answer").values);
  }
  EXPECT_EQ(answers[0], answers[1]);
  EXPECT_EQ(answers[0], answers[2]);
}

TEST(Net, TakesImagesOfOtherSizes) {
  auto net = Net::FromOnnx(ReadData("unet.onnx"), "unet.onnx");
  Tensor image = ReadSample().image;
  for (const auto& [height, width] : {std::pair(24, 16), {8, 48}, {24, 16}}) {
    image.height = height, image.width = width;
    image.values.assign(static_cast<size_t>(image.channels) * height * width, 0.5f);
    const auto outputs = net->Run({{"image", image}});
    ASSERT_TRUE(outputs.ok()) << outputs.status();
    EXPECT_EQ(outputs->at("answer").shape(), (TensorShape{4, height, width}));
  }
}

TEST(Net, RefusesWhatIsNoNet) {
  const std::string good = ReadData("unet.onnx");
  EXPECT_THAT(Refusal(""), HasSubstr("shirt.avatar/net.onnx: is no net"));
  EXPECT_THAT(Refusal("weftspc1 and more"), HasSubstr("is no net"));
  EXPECT_THAT(Refusal(good.substr(0, good.size() / 2)), HasSubstr("is no net"));
}

TEST(Net, SaysWhatItTakesAndGives) {
  const auto net = Net::FromOnnx(ReadData("unet.onnx"), "unet.onnx");
  ASSERT_TRUE(net.ok()) << net.status();
  EXPECT_EQ(Describe(net->inputs()), "\"image\" of 3 x any x any");
  EXPECT_EQ(Describe(net->outputs()), "\"answer\" of 4 x any x any");
}

// Of "near" minus "far" / 2, both as it is and a quarter of what is negative: names are not in the order of
// the alphabet, and an output is used by the net itself.
NetModel Difference() {
  NetModel model;
  model.inputs = {{"near", {1, 2, 3}}, {"far", {1, 2, 3}}};
  model.tensors = {{"w", {1, 2, 1, 1}, {1, -0.5f}}};
  NetNode join, conv, leaky;
  join.kind = NetOperator::kConcat;
  join.inputs = {"near", "far"};
  join.output = "join";
  conv.inputs = {"join", "w"};
  conv.output = "plain";
  leaky.kind = NetOperator::kLeakyRelu;
  leaky.alpha = 0.25f;
  leaky.inputs = {"plain"};
  leaky.output = "bent";
  model.nodes = {join, conv, leaky};
  model.outputs = {{"plain", {1, 2, 3}}, {"bent", {1, 2, 3}}};
  return model;
}

TEST(Net, TakesAndGivesTensorsByName) {
  auto net = Net::FromOnnx(WriteNetModel(Difference()), "two.onnx");
  ASSERT_TRUE(net.ok()) << net.status();
  const Tensor near{1, 2, 3, {1, 2, 3, 4, 5, 6}}, far{1, 2, 3, {4, 4, 4, 10, 10, 16}};
  for (int again = 0; again < 2; ++again) {
    const auto outputs = net->Run({{"near", near}, {"far", far}});
    ASSERT_TRUE(outputs.ok()) << outputs.status();
    ASSERT_EQ(outputs->size(), 2u);
    EXPECT_THAT(outputs->at("plain").values, ElementsAre(-1, 0, 1, -1, 0, -2));
    EXPECT_THAT(outputs->at("bent").values, ElementsAre(-0.25f, 0, 1, -0.25f, 0, -0.5f));
  }
  const auto exchanged = net->Run({{"near", far}, {"far", near}});
  ASSERT_TRUE(exchanged.ok()) << exchanged.status();
  EXPECT_THAT(exchanged->at("plain").values, ElementsAre(3.5f, 3, 2.5f, 8, 7.5f, 13));
}

TEST(Net, RefusesOtherNamesAndShapes) {
  auto net = Net::FromOnnx(WriteNetModel(Difference()), "two.onnx");
  const Tensor image{1, 2, 3, std::vector<float>(6, 1)}, wide{1, 2, 6, std::vector<float>(12, 1)};
  const auto refusal = [&](const NamedTensors& inputs) {
    return std::string(net->Run(inputs).status().message());
  };
  EXPECT_EQ(refusal({{"near", image}, {"far", image}}), "");
  EXPECT_EQ(refusal({{"near", image}}), "two.onnx: takes \"far\" of 1 x 2 x 3, which is missing");
  EXPECT_EQ(refusal({{"near", image}, {"image", image}}),
            "two.onnx: has no input \"image\"; it takes \"near\" of 1 x 2 x 3, \"far\" of 1 x 2 x 3");
  EXPECT_EQ(refusal({{"near", image}, {"far", wide}}),
            "two.onnx: takes \"far\" of 1 x 2 x 3, and this one is of 1 x 2 x 6");
}

TEST(Net, RefusesImagesThatDoNotFit) {
  auto net = Net::FromOnnx(ReadData("unet.onnx"), "unet.onnx");
  Tensor image = ReadSample().image;
  Tensor other = image;
  ++other.channels;
  other.values.resize(static_cast<size_t>(other.channels) * other.height * other.width);
  const auto refusal = [&](const Tensor& given) {
    return std::string(net->Run({{"image", given}}).status().message());
  };
  EXPECT_THAT(refusal(other),
              HasSubstr("unet.onnx: takes \"image\" of 3 x any x any, and this one is of 4 x 8 x 16"));
  other = image;
  other.values.pop_back();
  EXPECT_THAT(refusal(other), HasSubstr("another size than it says: 3 x 8 x 16 in 383 values"));
  image.values[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(refusal(image), HasSubstr("not finite in \"answer\""));
}

}  // namespace
}  // namespace weft
