// The net that says how far a driven mesh is off: a U-Net over the garment's atlas, after Halimi et al. 2022,
// section 6.1, much smaller.
#pragma once

#include <torch/nn.h>

#include <string>
#include <vector>

namespace weft::learning {

struct NetShape {
  int features = 0, answers = 0;                   // channels in and out
  bool has_deviation = true;                       // the last answer is the log of a deviation
  std::vector<int64_t> widths = {24, 48, 64, 96};  // channels of the levels, finest first
};

// [batch][features][height][width] to [batch][answers][height][width]; sizes are multiples of
// 2^(levels - 1). Two 3x3 convolutions a level, mean pooling, nearest upsampling, skips by concatenation;
// no normalisation, so that an answer depends on its frame alone. An untrained net answers 0.
class OffsetNetImpl : public torch::nn::Module {
 public:
  explicit OffsetNetImpl(const NetShape& shape);
  torch::Tensor forward(const torch::Tensor& image);

  const NetShape& shape() const { return shape_; }
  // In the order of the computation: two of each level down, two of each level up, the last one.
  std::vector<torch::nn::Conv2d>& layers() { return layers_; }

 private:
  NetShape shape_;
  std::vector<torch::nn::Conv2d> layers_;
};
TORCH_MODULE(OffsetNet);

inline constexpr double kLeak = 0.2;

// The bytes of the net's ONNX file (onnx_export.h).
std::string NetToOnnx(OffsetNet& net);

}  // namespace weft::learning
