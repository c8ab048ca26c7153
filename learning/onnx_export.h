// Nets as ONNX files, which other programs open too.
#pragma once

#include <string>
#include <vector>

namespace weft::learning {

struct ConvWeights {
  int from = 0, to = 0, size = 1;  // channels; side of the filter, padded with zeros to keep the image's size
  std::vector<float> weights;      // [to][from][size][size]
  std::vector<float> bias;         // [to]
};

// The U-Net of offset_net.h: `layers` in the order of its computation, `levels` of it. Input "image",
// [1][features][height][width] of any height and width that can be halved levels - 1 times; output "answer".
// Operators Conv, LeakyRelu, AveragePool, Resize (nearest, by scale), Concat; opset 11, which OpenCV 4.6
// reads.
std::string UNetToOnnx(const std::vector<ConvWeights>& layers, int levels, float leak);

}  // namespace weft::learning
