#include "learning/offset_net.h"

#include <torch/torch.h>

#include <string>

#include "learning/onnx_export.h"

namespace weft::learning {
namespace {

torch::nn::Conv2d Conv(int64_t from, int64_t to, int64_t size) {
  return torch::nn::Conv2d(torch::nn::Conv2dOptions(from, to, size).padding(size / 2));
}

torch::Tensor Leaky(const torch::Tensor& x) { return torch::leaky_relu(x, kLeak); }

}  // namespace

OffsetNetImpl::OffsetNetImpl(const NetShape& shape) : shape_(shape) {
  const auto add = [&](torch::nn::Conv2d layer) {
    layers_.push_back(register_module("layer" + std::to_string(layers_.size()), layer));
  };
  const std::vector<int64_t>& widths = shape.widths;
  int64_t from = shape.features;
  for (const int64_t width : widths) {
    add(Conv(from, width, 3));
    add(Conv(width, width, 3));
    from = width;
  }
  for (size_t level = widths.size() - 1; level-- > 0;) {
    add(Conv(widths[level + 1] + widths[level], widths[level], 3));
    add(Conv(widths[level], widths[level], 3));
  }
  torch::nn::Conv2d last = Conv(widths[0], shape.answers, 1);
  torch::nn::init::zeros_(last->weight);
  torch::nn::init::zeros_(last->bias);
  add(last);
}

torch::Tensor OffsetNetImpl::forward(const torch::Tensor& image) {
  const size_t levels = shape_.widths.size();
  std::vector<torch::Tensor> skips;
  torch::Tensor x = image;
  size_t layer = 0;
  const auto next = [&] { x = Leaky(layers_[layer++]->forward(x)); };
  for (size_t level = 0; level < levels; ++level) {
    if (level > 0) x = torch::avg_pool2d(x, 2);
    next(), next();
    if (level + 1 < levels) skips.push_back(x);
  }
  for (size_t level = levels - 1; level-- > 0;) {
    x = torch::upsample_nearest2d(x, {skips[level].size(2), skips[level].size(3)});
    x = torch::cat({x, skips[level]}, 1);
    next(), next();
  }
  torch::nn::Conv2d& last = layers_[layer];
  if (!is_training() || !shape_.has_deviation) return last->forward(x);
  // What the deviation wants does not move the layers before: they serve the offsets.
  const int64_t offsets = shape_.answers - 1;
  return torch::cat({last->forward(x).slice(1, 0, offsets), last->forward(x.detach()).slice(1, offsets)}, 1);
}

std::string NetToOnnx(OffsetNet& net) {
  const auto values = [](const torch::Tensor& tensor) {
    const torch::Tensor plain = tensor.detach().contiguous();
    return std::vector<float>(plain.data_ptr<float>(), plain.data_ptr<float>() + plain.numel());
  };
  std::vector<ConvWeights> layers;
  for (const torch::nn::Conv2d& layer : net->layers())
    layers.push_back({static_cast<int>(layer->weight.size(1)), static_cast<int>(layer->weight.size(0)),
                      static_cast<int>(layer->weight.size(2)), values(layer->weight), values(layer->bias)});
  return UNetToOnnx(layers, static_cast<int>(net->shape().widths.size()), kLeak);
}

}  // namespace weft::learning
