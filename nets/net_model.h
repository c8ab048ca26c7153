// What a net's ONNX file describes, checked before any library runs it: files of strangers break OpenCV's
// reader.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// The operators of our nets (learning/onnx_export.h).
enum class NetOperator { kConv, kLeakyRelu, kAveragePool, kResize, kConcat };

// Constant numbers: weights, biases, factors.
struct NetTensor {
  std::string name;
  std::vector<int64_t> dims;  // at most 4; 0 only where it holds nothing
  std::vector<float> values;  // as many as the dims say, finite
};

struct NetNode {
  NetOperator kind = NetOperator::kConv;
  std::vector<std::string> inputs;  // names of tensors, of earlier nodes' outputs, or of the image
  std::string output;
  std::array<int64_t, 2> kernel = {1, 1}, pads = {0, 0}, strides = {1, 1},
                         dilations = {1, 1};  // height, width
  int64_t group = 1;
  float alpha = 0.01f;  // what LeakyRelu leaves of negative numbers
};

// A net of one image and one answer. What it holds holds: names are known and unique, nodes stand in the
// order of their computation and are all used, the last one answers; weights fit their channels.
struct NetModel {
  std::string image, answer;
  int64_t image_channels = 0;
  std::vector<NetNode> nodes;
  std::vector<NetTensor> tensors;
};

struct NetSize {
  int64_t channels = 0, height = 0, width = 0;
};

// InvalidArgument says what is wrong, without the file's name: what cannot be read; fields, operators or
// attributes that our nets do not have, as data in other files; dims that do not fit their data; numbers out
// of bounds or not finite; names that are unknown or not unique.
absl::StatusOr<NetModel> ReadNetModel(std::string_view onnx);

// The model as an ONNX file (opset 11) that has nothing else in it, for images of any size.
std::string WriteNetModel(const NetModel& model);

// Channels, height and width of the answer to such an image. InvalidArgument: the net does not take it, or
// takes more memory (kMostNetValues) or work (kMostNetProducts) for it than any net of ours.
absl::StatusOr<NetSize> SizeOfAnswer(const NetModel& model, const NetSize& image);

// The U-Net of default widths (learning/offset_net.h) takes 0.14 G values and 19 G products for an atlas of
// 512 x 512, which is larger than any garment's so far; these are 15 and 230 times that. LimitsOfRuns of
// tests/nets/net_model_test.cpp has the sum.
inline constexpr int64_t kMostNetValues = int64_t{1} << 31;
inline constexpr int64_t kMostNetProducts = int64_t{1} << 42;

}  // namespace weft
