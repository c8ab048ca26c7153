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

namespace weft {
namespace {

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
  const auto answer = net->Run(sample.image);
  ASSERT_TRUE(answer.ok()) << answer.status();
  ASSERT_EQ(answer->values.size(), sample.answer.values.size());
  float largest = 0;
  for (const float x : sample.answer.values) largest = std::max(largest, std::abs(x));
  ASSERT_GT(largest, 0.01f);
  for (size_t i = 0; i < answer->values.size(); ++i)
    EXPECT_NEAR(answer->values[i], sample.answer.values[i], 1e-4f * largest);
}

TEST(Net, SameBytesAtOneAndTwoThreads) {
  const Sample sample = ReadSample();
  std::vector<std::vector<float>> answers;
  for (const int threads : {1, 2, 1}) {
    cv::setNumThreads(threads);
    auto net = Net::FromOnnx(ReadData("unet.onnx"), "unet.onnx");
    answers.push_back(net->Run(sample.image)->values);
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
    const auto answer = net->Run(image);
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->height, height);
    EXPECT_EQ(answer->width, width);
  }
}

TEST(Net, RefusesWhatIsNoNet) {
  const std::string good = ReadData("unet.onnx");
  EXPECT_THAT(Refusal(""), HasSubstr("shirt.avatar/net.onnx: is no net"));
  EXPECT_THAT(Refusal("weftspc1 and more"), HasSubstr("is no net"));
  EXPECT_THAT(Refusal(good.substr(0, good.size() / 2)), HasSubstr("is no net"));
}

TEST(Net, RefusesImagesThatDoNotFit) {
  auto net = Net::FromOnnx(ReadData("unet.onnx"), "unet.onnx");
  Tensor image = ReadSample().image;
  Tensor other = image;
  ++other.channels;
  other.values.resize(static_cast<size_t>(other.channels) * other.height * other.width);
  EXPECT_THAT(std::string(net->Run(other).status().message()), HasSubstr("unet.onnx"));
  other = image;
  other.values.pop_back();
  EXPECT_THAT(std::string(net->Run(other).status().message()), HasSubstr("another size"));
  image.values[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(std::string(net->Run(image).status().message()), HasSubstr("not finite"));
}

}  // namespace
}  // namespace weft
