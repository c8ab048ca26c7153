// Tensors that nets take and answer with, and shapes that these must have.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace weft {

// Of a side: each size will do.
inline constexpr int64_t kAnySize = -1;

struct TensorShape {
  int64_t channels = 0, height = kAnySize, width = kAnySize;

  bool operator==(const TensorShape&) const = default;
};

// [channels][height][width].
struct Tensor {
  int channels = 0, height = 0, width = 0;
  std::vector<float> values;

  TensorShape shape() const { return {channels, height, width}; }
};
using NamedTensors = std::map<std::string, Tensor>;

// An input or an output of a net.
struct NamedShape {
  std::string name;
  TensorShape shape;
};

// "27 x any x any".
std::string Describe(const TensorShape& shape);
// "\"image\" of 27 x any x any", one after another.
std::string Describe(const std::vector<NamedShape>& shapes);

// InvalidArgument, with what is expected: an input that is missing or unknown, or has another shape.
absl::Status CheckInputs(const std::vector<NamedShape>& expected,
                         const std::map<std::string, TensorShape>& given);

}  // namespace weft
