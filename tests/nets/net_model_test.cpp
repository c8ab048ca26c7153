#include "nets/net_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <string>

#include "nets/net.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

std::string DataFile(const std::string& name) {
  std::ifstream file(std::string(WEFT_TEST_DATA) + "/" + name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

NetTensor Numbers(const std::string& name, std::vector<int64_t> dims, float value = 0.5f) {
  int64_t count = 1;
  for (const int64_t dim : dims) count *= dim;
  return {name, std::move(dims), std::vector<float>(static_cast<size_t>(count), value)};
}

// A small U-Net of all five operators: 2 channels, halved, doubled, joined, answered with 3.
NetModel UNet() {
  NetModel model;
  model.inputs = {{"image", {2}}};
  model.tensors = {Numbers("w0", {4, 2, 3, 3}), Numbers("b0", {4}), Numbers("roi", {0}),
                   Numbers("scales", {4}), Numbers("w1", {3, 6, 1, 1})};
  model.tensors[3].values = {1, 1, 2, 2};
  NetNode conv, leaky, half, twice, join, answer;
  conv.inputs = {"image", "w0", "b0"};
  conv.kernel = {3, 3}, conv.pads = {1, 1};
  conv.output = "conv";
  leaky.kind = NetOperator::kLeakyRelu;
  leaky.inputs = {"conv"};
  leaky.output = "leaky";
  half.kind = NetOperator::kAveragePool;
  half.inputs = {"leaky"};
  half.kernel = {2, 2}, half.strides = {2, 2};
  half.output = "half";
  twice.kind = NetOperator::kResize;
  twice.inputs = {"half", "roi", "scales"};
  twice.output = "twice";
  join.kind = NetOperator::kConcat;
  join.inputs = {"twice", "image"};
  join.output = "join";
  answer.inputs = {"join", "w1"};
  answer.output = "answer";
  model.nodes = {conv, leaky, half, twice, join, answer};
  model.outputs = {{"answer", {3}}};
  return model;
}

// Two inputs of sides of their own, and two outputs, of which the net uses one itself.
NetModel TwoWays() {
  NetModel model;
  model.inputs = {{"near", {2, 4, 6}}, {"far", {1, 4, 6}}};
  model.tensors = {Numbers("w0", {2, 3, 1, 1})};
  NetNode join, conv, leaky;
  join.kind = NetOperator::kConcat;
  join.inputs = {"near", "far"};
  join.output = "join";
  conv.inputs = {"join", "w0"};
  conv.output = "mean";
  leaky.kind = NetOperator::kLeakyRelu;
  leaky.inputs = {"mean"};
  leaky.output = "bent";
  model.nodes = {join, conv, leaky};
  model.outputs = {{"bent", {2}}, {"mean", {2, 4, kAnySize}}};
  return model;
}

// What the check says of the U-Net with one change; empty: nothing.
std::string RefusalOf(const std::function<void(NetModel&)>& change) {
  NetModel model = UNet();
  change(model);
  return std::string(ReadNetModel(WriteNetModel(model)).status().message());
}

TEST(NetModel, ReadsWhatItWrites) {
  const absl::StatusOr<NetModel> model = ReadNetModel(WriteNetModel(UNet()));
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ(WriteNetModel(*model), WriteNetModel(UNet()));
  EXPECT_EQ(model->nodes.size(), 6u);
  EXPECT_THAT(model->nodes[0].inputs, ElementsAre("image", "w0", "b0"));
  EXPECT_EQ(model->tensors[0].values, UNet().tensors[0].values);
}

TEST(NetModel, KeepsNamesAndShapesOfInputsAndOutputs) {
  const absl::StatusOr<NetModel> model = ReadNetModel(WriteNetModel(TwoWays()));
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ(Describe(model->inputs), "\"near\" of 2 x 4 x 6, \"far\" of 1 x 4 x 6");
  EXPECT_EQ(Describe(model->outputs), "\"bent\" of 2 x any x any, \"mean\" of 2 x 4 x any");
  EXPECT_EQ(WriteNetModel(*model), WriteNetModel(TwoWays()));
}

TEST(NetModel, ReadsOutputsThatDoNotSayTheirChannels) {
  NetModel older = UNet();
  older.outputs[0].shape.channels = kAnySize;
  const absl::StatusOr<NetModel> model = ReadNetModel(WriteNetModel(older));
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ(WriteNetModel(*model), WriteNetModel(UNet()));
}

TEST(NetModel, ReadsTheNetsOfTraining) {
  const absl::StatusOr<NetModel> unet = ReadNetModel(DataFile("unet.onnx"));
  ASSERT_TRUE(unet.ok()) << unet.status();
  EXPECT_EQ(Describe(unet->inputs), "\"image\" of 3 x any x any");
  EXPECT_EQ(Describe(unet->outputs), "\"answer\" of 4 x any x any");
  EXPECT_EQ(unet->nodes.size(), 16u);
  EXPECT_EQ(unet->nodes[1].alpha, 0.2f);
  EXPECT_TRUE(ReadNetModel(DataFile("shift.onnx")).ok());
  EXPECT_TRUE(ReadNetModel(DataFile("pixels.onnx")).ok());
}

TEST(NetModel, RefusesTensorsThatAreNotWhatTheySay) {
  using Model = NetModel;
  EXPECT_EQ(RefusalOf([](Model&) {}), "");
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[0].values.pop_back(); }),
              HasSubstr("\"w0\": dims are 4 x 2 x 3 x 3, and it holds 71 numbers"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[0].dims[1] = -2; }), HasSubstr("dims are 4 x -2"));
  // Their product is 2^64 + 72.
  EXPECT_THAT(RefusalOf([](Model& m) {
                m.tensors[0].dims = {1 << 30, 1 << 30, 1 << 4, 1};
              }),
              HasSubstr("dims are 1073741824"));
  EXPECT_THAT(RefusalOf([](Model& m) {
                m.tensors[0].dims = {65536, 65536, 65536, 65536};
              }),
              HasSubstr("dims are"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[1].values[2] = std::numeric_limits<float>::infinity(); }),
              HasSubstr("\"b0\": holds numbers that are not finite"));
}

TEST(NetModel, RefusesNamesThatAreUnknownOrTwice) {
  using Model = NetModel;
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[1].inputs = {"leaky"}; }),
              HasSubstr("no image that stands before"));
  EXPECT_THAT(RefusalOf([](Model& m) { std::swap(m.nodes[1], m.nodes[2]); }), HasSubstr("stands before"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[0].inputs[1] = "image"; }), HasSubstr("is no tensor"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[1].inputs = {"w0"}; }), HasSubstr("is no image"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[1].output = "conv"; }), HasSubstr("stands for two things"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[1].name = "w0"; }), HasSubstr("stands for two things"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[1].name = ""; }), HasSubstr("a name is missing"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors.push_back(Numbers("more", {1})); }),
              HasSubstr("\"more\" is used by nothing"));
  EXPECT_THAT(RefusalOf([](Model& m) {
                m.outputs[0] = {"join", {6}};
              }),
              HasSubstr("\"answer\" is used by nothing"));
  for (const char* name : {"image", "w0", "other"})
    EXPECT_THAT(RefusalOf([&](Model& m) { m.outputs[0].name = name; }), HasSubstr("is that of no node"))
        << name;
  EXPECT_THAT(RefusalOf([](Model& m) { m.outputs.push_back(m.outputs[0]); }), HasSubstr("stands twice"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.inputs.push_back(m.inputs[0]); }),
              HasSubstr("stands for two things"));
  EXPECT_THAT(RefusalOf([](Model& m) {
                m.inputs.push_back({"more", {1}});
              }),
              HasSubstr("\"more\" is used by nothing"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.inputs[0].name = m.nodes[0].inputs[0] = ""; }),
              HasSubstr("a name is missing"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[0].name = m.nodes[0].inputs[1] = std::string(257, 'n'); }),
              HasSubstr("up to 256 bytes"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[0].name = m.nodes[0].inputs[1] = "a\nb"; }),
              HasSubstr("printable"));
}

TEST(NetModel, RefusesLayersThatDoNotFit) {
  using Model = NetModel;
  EXPECT_THAT(RefusalOf([](Model& m) { m.inputs[0].shape.channels = 5; }),
              HasSubstr("weights are of 2 channels"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[0].group = 0; }), HasSubstr("group is 0"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[0].group = 3; }), HasSubstr("group is 3"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[0].group = 2; }), HasSubstr("weights are of 4 channels"));
  EXPECT_EQ(RefusalOf([](Model& m) {
              m.nodes[0].group = 2;
              m.tensors[0] = Numbers("w0", {4, 1, 3, 3});
            }),
            "");
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[0].kernel = {3, 2}; }), HasSubstr("kernel_shape is not that"));
  EXPECT_THAT(RefusalOf([](Model& m) {
                m.nodes[2].kernel = {17, 2};
              }),
              HasSubstr("kernel_shape is not 1 to 16"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[2].strides = {0, 2}; }), HasSubstr("strides are not"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[0].dilations = {1, 17}; }), HasSubstr("dilations are not"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[0].pads = {1, 3}; }), HasSubstr("pads are 3"));
  EXPECT_THAT(RefusalOf([](Model& m) {
                m.nodes[2].pads = {1, 0};
              }),
              HasSubstr("pads are 1, expected 0 to 0"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[1] = Numbers("b0", {2, 2}); }), HasSubstr("bias"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[0] = Numbers("w0", {4, 18}); }), HasSubstr("4 dims"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[2] = Numbers("roi", {1}); }), HasSubstr("roi"));
  for (const float scale : {0.f, 0.5f, 1.5f, 17.f, -1.f})
    EXPECT_THAT(RefusalOf([&](Model& m) { m.tensors[3].values[2] = scale; }), HasSubstr("scales")) << scale;
  EXPECT_THAT(RefusalOf([](Model& m) { m.tensors[3].values[1] = 2; }), HasSubstr("scales"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[1].inputs.push_back("image"); }), HasSubstr("has 2 inputs"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[1].alpha = std::numeric_limits<float>::quiet_NaN(); }),
              HasSubstr("alpha"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.nodes[2].strides = {3, 2}; }), HasSubstr("joins images of"));
}

TEST(NetModel, RefusesShapesThatCannotBe) {
  using Model = NetModel;
  for (const TensorShape& shape : {TensorShape{0}, {kAnySize}, {2, 0}, {2, 4, -3}, {2, 1 << 16}, {1 << 17}})
    EXPECT_THAT(RefusalOf([&](Model& m) { m.inputs[0].shape = shape; }),
                HasSubstr("input \"image\" is of " + Describe(shape)));
  EXPECT_THAT(RefusalOf([](Model& m) { m.outputs[0].shape.channels = 4; }),
              HasSubstr("\"answer\" is of 4 channels, and its node makes 3"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.outputs[0].shape.height = 0; }), HasSubstr("output \"answer\""));
  // Of sides that are known nothing else is tried.
  EXPECT_THAT(RefusalOf([](Model& m) { m.inputs[0].shape.height = 31; }), HasSubstr("joins images of"));
  EXPECT_THAT(RefusalOf([](Model& m) { m.inputs[0].shape.height = 32, m.outputs[0].shape.height = 16; }),
              HasSubstr("\"answer\" of 3 x 32 x 64 of \"image\" of 2 x 32 x 64, and its file says 3 x 16"));
  EXPECT_EQ(RefusalOf([](Model& m) {
              m.inputs[0].shape = {2, 32, 16}, m.outputs[0].shape = {3, 32, 16};
            }),
            "");
}

TEST(NetModel, RefusesMoreThanAnyNetHas) {
  EXPECT_THAT(RefusalOf([](NetModel& m) {
                // Each join doubles the channels.
                for (int k = 0; k < 20; ++k) {
                  NetNode join;
                  join.kind = NetOperator::kConcat;
                  join.inputs = {m.nodes.back().output, m.nodes.back().output};
                  join.output = "more" + std::to_string(k);
                  m.nodes.push_back(join);
                }
                m.outputs = {{m.nodes.back().output, {kAnySize}}};
              }),
              HasSubstr("channels"));
  EXPECT_THAT(RefusalOf([](NetModel& m) {
                for (int k = 0; k < 2000; ++k) {
                  NetNode leaky;
                  leaky.kind = NetOperator::kLeakyRelu;
                  leaky.inputs = {m.nodes.back().output};
                  leaky.output = "more" + std::to_string(k);
                  m.nodes.push_back(leaky);
                }
                m.outputs = {{m.nodes.back().output, {kAnySize}}};
              }),
              HasSubstr("more than 1024 nodes"));
}

// Fields by hand: number << 3 | 2, length, bytes.
std::string Field(int number, const std::string& bytes) {
  std::string out(1, static_cast<char>(number << 3 | 2));
  for (size_t rest = bytes.size();; rest >>= 7) {
    out += static_cast<char>(rest >= 128 ? rest % 128 + 128 : rest);
    if (rest < 128) break;
  }
  return out + bytes;
}

TEST(NetModel, RefusesFieldsThatOurNetsDoNotHave) {
  const std::string good = WriteNetModel(UNet());
  const auto refusal = [](const std::string& bytes) {
    return std::string(ReadNetModel(bytes).status().message());
  };
  EXPECT_EQ(refusal(good), "");
  EXPECT_THAT(refusal(good + Field(14, "x")), HasSubstr("the model has field 14"));
  EXPECT_THAT(refusal(good + Field(7, "")), HasSubstr("two graphs"));
  EXPECT_THAT(refusal(good + Field(8, std::string("\x10\x0b", 2))), HasSubstr("two opsets"));
  // external_data and data_location of a tensor, a graph in an attribute, a sparse tensor.
  EXPECT_THAT(refusal(Field(7, Field(5, Field(13, "x")))), HasSubstr("a tensor has field 13"));
  EXPECT_THAT(refusal(Field(7, Field(5, "\x70\x01"))), HasSubstr("a tensor has field 14"));
  EXPECT_THAT(refusal(Field(7, Field(1, Field(5, Field(6, ""))))), HasSubstr("an attribute has field 6"));
  EXPECT_THAT(refusal(Field(7, Field(15, ""))), HasSubstr("the graph has field 15"));
  EXPECT_THAT(refusal(Field(7, Field(5, "\x10\x07"))), HasSubstr("other numbers than floats"));
  EXPECT_THAT(refusal(Field(7, Field(1, Field(7, "com.microsoft")))), HasSubstr("domain \"com.microsoft\""));
  EXPECT_THAT(refusal(Field(7, Field(1, Field(4, "Loop")))), HasSubstr("operator \"Loop\""));
  EXPECT_THAT(refusal(Field(8, std::string("\x10\x0e", 2))), HasSubstr("opset 14, expected 11 to 13"));
  EXPECT_THAT(refusal("\x08\x06"), HasSubstr("no graph"));
  EXPECT_THAT(refusal("\xff\xff"), HasSubstr("no ONNX file"));
  for (size_t size = 1; size < good.size(); size += 7) EXPECT_NE(refusal(good.substr(0, size)), "") << size;
}

TEST(NetModel, SaysTheShapesOfOutputs) {
  const NetModel model = UNet();
  const auto shapes = ShapesOfOutputs(model, {{"image", {2, 30, 44}}});
  ASSERT_TRUE(shapes.ok()) << shapes.status();
  EXPECT_THAT(*shapes, ElementsAre(Pair("answer", TensorShape{3, 30, 44})));
  const auto refusal = [&](const std::map<std::string, TensorShape>& inputs) {
    return std::string(ShapesOfOutputs(model, inputs).status().message());
  };
  EXPECT_THAT(refusal({{"image", {3, 30, 44}}}),
              HasSubstr("takes \"image\" of 2 x any x any, and this one is of 3 x 30 x 44"));
  EXPECT_THAT(refusal({{"image", {2, 31, 44}}}), HasSubstr("not multiples of what the net halves"));
  EXPECT_THAT(refusal({{"image", {2, 1, 1}}}), HasSubstr("too small"));
  EXPECT_THAT(refusal({{"image", {2, 1 << 16, 1}}}), HasSubstr("pixels a side"));
  EXPECT_THAT(refusal({{"image", {2, kAnySize, 1}}}), HasSubstr("pixels a side"));
  EXPECT_THAT(refusal({{"image", {2, 1 << 14, 1 << 14}}}), HasSubstr("more memory or time"));
  EXPECT_THAT(refusal({}), HasSubstr("\"image\" of 2 x any x any, which is missing"));
}

// As learning/onnx_export.cpp makes it.
NetModel DefaultUNet() {
  const std::vector<int64_t> widths = {24, 48, 64, 96};
  NetModel model;
  model.inputs = {{"image", {27}}};
  std::string at = "image";
  int64_t channels = 27;
  const auto add = [&](NetNode node) {
    node.output = "n" + std::to_string(model.nodes.size());
    at = node.output;
    model.nodes.push_back(std::move(node));
  };
  const auto convolve = [&](int64_t to, int64_t size) {
    const std::string name = "w" + std::to_string(model.nodes.size());
    model.tensors.push_back(Numbers(name, {to, channels, size, size}));
    NetNode conv, leaky;
    conv.inputs = {at, name};
    conv.kernel = {size, size}, conv.pads = {size / 2, size / 2};
    add(conv);
    channels = to;
    if (size == 1) return;
    leaky.kind = NetOperator::kLeakyRelu;
    leaky.inputs = {at};
    add(leaky);
  };
  std::vector<std::string> skips;
  for (size_t level = 0; level < widths.size(); ++level) {
    NetNode half;
    half.kind = NetOperator::kAveragePool;
    half.kernel = half.strides = {2, 2};
    half.inputs = {at};
    if (level > 0) add(half);
    convolve(widths[level], 3), convolve(widths[level], 3);
    skips.push_back(at);
  }
  model.tensors.push_back(Numbers("roi", {0}));
  model.tensors.push_back({"scales", {4}, {1, 1, 2, 2}});
  for (size_t level = widths.size() - 1; level-- > 0;) {
    NetNode twice, join;
    twice.kind = NetOperator::kResize;
    twice.inputs = {at, "roi", "scales"};
    add(twice);
    join.kind = NetOperator::kConcat;
    join.inputs = {at, skips[level]};
    add(join);
    channels += widths[level];
    convolve(widths[level], 3), convolve(widths[level], 3);
  }
  convolve(4, 1);
  model.outputs = {{at, {4}}};
  return model;
}

TEST(NetModel, LimitsOfRuns) {
  const NetModel model = DefaultUNet();
  ASSERT_TRUE(ReadNetModel(WriteNetModel(model)).ok());
  const auto is_taken = [&](int64_t height, int64_t width) {
    return ShapesOfOutputs(model, {{"image", {27, height, width}}}).ok();
  };
  EXPECT_TRUE(is_taken(512, 512));
  // Channels of all images at 1, 1/2, 1/4 and 1/8 of the sides: 0.136 G values.
  const int64_t values = 512 * 512 * (316 + 584 / 4 + 816 / 16 + 448 / 64);
  EXPECT_NEAR(static_cast<double>(kMostNetValues) / static_cast<double>(values), 15.8, 0.1);
  // So twice the pixels' sides pass, and four times do not.
  EXPECT_TRUE(is_taken(1024, 1024));
  EXPECT_TRUE(is_taken(1984, 2048));
  EXPECT_FALSE(is_taken(2048, 2056));
}

TEST(NetModel, WhatTheLibraryAnswersHasThatSize) {
  absl::StatusOr<Net> net = Net::FromOnnx(WriteNetModel(UNet()), "net.onnx");
  ASSERT_TRUE(net.ok()) << net.status();
  const auto outputs = net->Run({{"image", {2, 6, 10, std::vector<float>(120, 1)}}});
  ASSERT_TRUE(outputs.ok()) << outputs.status();
  const Tensor& answer = outputs->at("answer");
  EXPECT_EQ(answer.shape(), (TensorShape{3, 6, 10}));
  // In the middle: 18 products of 0.5 x 1, and 0.5; of four such channels and the image's two half is added.
  EXPECT_FLOAT_EQ(answer.values[2 * 10 + 4], 0.5f * (4 * 9.5f + 2));
  EXPECT_THAT(std::string(net->Run({{"image", {2, 5, 10, std::vector<float>(100, 1)}}}).status().message()),
              HasSubstr("net.onnx: node \"join\" joins"));
}

}  // namespace
}  // namespace weft
