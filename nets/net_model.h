// What a net's ONNX file describes, checked before any library runs it: files of strangers break OpenCV's
// reader.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "nets/tensor.h"

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
  std::vector<std::string> inputs;  // names of tensors, of earlier nodes' outputs, or of the net's inputs
  std::string output;
  std::array<int64_t, 2> kernel = {1, 1}, pads = {0, 0}, strides = {1, 1},
                         dilations = {1, 1};  // height, width
  int64_t group = 1;
  float alpha = 0.01f;  // what LeakyRelu leaves of negative numbers
};

// What it holds holds: names are known and unique, nodes stand in the order of their computation, weights fit
// their channels. Each input, node and tensor is used, each output is that of a node.
struct NetModel {
  std::vector<NamedShape> inputs, outputs;  // channels are known, sides may be of any size
  std::vector<NetNode> nodes;
  std::vector<NetTensor> tensors;
};

// InvalidArgument says what is wrong, without the file's name: what cannot be read; fields, operators or
// attributes that our nets do not have, as data in other files; dims that do not fit their data; numbers out
// of bounds or not finite; names that are unknown or not unique. Channels of outputs follow from the nodes: a
// file that does not say them is read, one that says others is not.
absl::StatusOr<NetModel> ReadNetModel(std::string_view onnx);

// The model as an ONNX file (opset 11) that has nothing else in it.
std::string WriteNetModel(const NetModel& model);

// Shapes of the outputs for such inputs. InvalidArgument: errors of CheckInputs; the net takes more memory
// (kMostNetValues) or work (kMostNetProducts) for them than any net of ours, joins images of two sizes, or
// makes another shape than its file says.
absl::StatusOr<std::map<std::string, TensorShape>> ShapesOfOutputs(
    const NetModel& model, const std::map<std::string, TensorShape>& inputs);

// The U-Net of default widths (learning/offset_net.h) takes 0.14 G values and 19 G products for an atlas of
// 512 x 512, which is larger than any garment's so far; these are 15 and 230 times that. LimitsOfRuns of
// tests/nets/net_model_test.cpp has the sum.
inline constexpr int64_t kMostNetValues = int64_t{1} << 31;
inline constexpr int64_t kMostNetProducts = int64_t{1} << 42;

}  // namespace weft
