// The fields of a net's ONNX file, read and written; net_model.h checks what they mean.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absl/status/statusor.h"
#include "nets/net_model.h"

namespace weft {

// Bounds of what is kept. The largest nets of `weft avatar train` have 5 levels: 40 nodes, 50 tensors, 1,024
// channels, kernels of 3.
inline constexpr size_t kMostNodes = 1024, kMostTensors = 4096, kMostInputs = 16, kMostOutputs = 16,
                        kMostNameBytes = 256;
inline constexpr int64_t kMostChannels = 1 << 16, kMostKernel = 16, kMostStride = 16, kMostScale = 16;
inline constexpr int64_t kMostSide = 1 << 15;

// InvalidArgument: a field, an operator or an attribute that our nets do not have, or more of them than
// above. Outputs have kAnySize channels where the file does not say them.
absl::StatusOr<NetModel> ReadNetFields(std::string_view onnx);

}  // namespace weft
