// Nets that the check lets pass, of all shapes: the bytes choose operators, channels and numbers. Each is
// imported by OpenCV and run on images of several sizes; both must agree on what comes out. OpenCV may refuse
// a net by an exception: it assumes sizes of its own at import.
#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "nets/net.h"
#include "nets/net_model.h"
#include "tests/fuzz/fuzz_target.h"

namespace weft {
namespace {

class Choices {
 public:
  Choices(const uint8_t* data, size_t size) : data_(data), size_(size) {}
  int64_t Of(int64_t limit) { return at_ < size_ ? data_[at_++] % limit : 0; }
  bool AreLeft() const { return at_ < size_; }
  // Apart from the others.
  int64_t Last(int64_t limit) const { return size_ > 0 ? data_[size_ - 1] % limit : 0; }

 private:
  const uint8_t* data_;
  size_t size_, at_ = 0;
};

class Maker {
 public:
  explicit Maker(Choices choices) : choices_(choices) {
    model_.inputs = {{"image", {1 + choices_.Of(6)}}};
    images_.emplace_back("image", model_.inputs[0].shape.channels);
    if (choices_.Last(4) != 3) return;
    model_.inputs.push_back({"second", {1 + choices_.Of(6)}});
    images_.emplace_back("second", model_.inputs[1].shape.channels);
  }

  NetModel Make() {
    while (choices_.AreLeft() && model_.nodes.size() < 12) AddNode(static_cast<NetOperator>(choices_.Of(5)));
    AddNode(NetOperator::kConv);
    if (choices_.Last(8) < 4) JoinUnused();
    for (const auto& [name, channels] : Unused()) {
      if (name != "image" && name != "second") model_.outputs.push_back({name, {channels}});
    }
    // One that the net uses itself.
    if (choices_.Last(16) == 15 && model_.nodes.front().output != model_.outputs.front().name)
      model_.outputs.push_back({model_.nodes.front().output, {kAnySize}});
    return std::move(model_);
  }

 private:
  std::string Tensor(std::vector<int64_t> dims, float least) {
    NetTensor& tensor = model_.tensors.emplace_back();
    tensor.name = "t" + std::to_string(model_.tensors.size());
    size_t count = 1;
    for (const int64_t dim : dims) count *= static_cast<size_t>(dim);
    for (size_t i = 0; i < count; ++i)
      tensor.values.push_back(least + static_cast<float>(choices_.Of(16)) / 16);
    tensor.dims = std::move(dims);
    return tensor.name;
  }

  void AddNode(NetOperator kind) {
    const size_t newest = images_.size() - 1;
    const size_t from = choices_.Of(4) == 0 ? static_cast<size_t>(choices_.Of(256)) % images_.size() : newest;
    NetNode node;
    node.kind = kind;
    node.inputs = {images_[from].first};
    node.output = "n" + std::to_string(model_.nodes.size());
    int64_t channels = images_[from].second;
    if (kind == NetOperator::kConv || kind == NetOperator::kAveragePool) {
      for (size_t axis = 0; axis < 2; ++axis) {
        node.kernel[axis] = 1 + choices_.Of(5);
        node.strides[axis] = 1 + choices_.Of(3);
      }
    }
    if (kind == NetOperator::kConv) {
      for (size_t axis = 0; axis < 2; ++axis) {
        node.dilations[axis] = 1 + choices_.Of(3);
        node.pads[axis] = choices_.Of(1 + node.dilations[axis] * (node.kernel[axis] - 1));
      }
      node.group = choices_.Of(2) == 0 ? 1 : channels;
      const int64_t to = node.group * (1 + choices_.Of(3));
      node.inputs.push_back(Tensor({to, channels / node.group, node.kernel[0], node.kernel[1]}, -0.5f));
      if (choices_.Of(3) != 0) node.inputs.push_back(Tensor({to}, -0.5f));
      channels = to;
    } else if (kind == NetOperator::kLeakyRelu) {
      node.alpha = static_cast<float>(choices_.Of(5)) / 4;
    } else if (kind == NetOperator::kResize) {
      node.inputs.push_back(Tensor({0}, 0));
      node.inputs.push_back(Tensor({4}, 1));
      model_.tensors.back().values = {1, 1, static_cast<float>(1 + choices_.Of(3)),
                                      static_cast<float>(1 + choices_.Of(3))};
    } else if (kind == NetOperator::kConcat) {
      for (int64_t more = 1 + choices_.Of(2); more > 0; --more) {
        const auto& other = images_[static_cast<size_t>(choices_.Of(256)) % images_.size()];
        node.inputs.push_back(other.first);
        channels += other.second;
      }
    }
    if (channels > 64) return;
    model_.nodes.push_back(node);
    images_.emplace_back(node.output, channels);
  }

  std::vector<std::pair<std::string, int64_t>> Unused() const {
    std::vector<std::pair<std::string, int64_t>> out;
    for (const auto& image : images_) {
      bool is_used = false;
      for (const NetNode& node : model_.nodes)
        is_used =
            is_used || std::find(node.inputs.begin(), node.inputs.end(), image.first) != node.inputs.end();
      if (!is_used) out.push_back(image);
    }
    return out;
  }

  // What nobody uses is joined at the end; where sizes differ the check refuses it.
  void JoinUnused() {
    NetNode join;
    join.kind = NetOperator::kConcat;
    join.output = "answer";
    int64_t sum = 0;
    for (const auto& [name, channels] : Unused()) join.inputs.push_back(name), sum += channels;
    if (join.inputs.size() < 2) return;
    model_.nodes.push_back(join);
    images_.emplace_back(join.output, sum);
  }

  Choices choices_;
  NetModel model_;
  std::vector<std::pair<std::string, int64_t>> images_;
};

bool IsOfLibrary(const absl::Status& status) {
  return absl::IsInvalidArgument(status) && status.message().find("OpenCV(") != absl::string_view::npos;
}

}  // namespace
}  // namespace weft

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace weft;
  const NetModel made = Maker(Choices(data, std::min<size_t>(size, 4096))).Make();
  const std::string onnx = WriteNetModel(made);
  if (!ReadNetModel(onnx).ok()) return 0;
  auto net = Net::FromOnnx(onnx, "net");
  if (!net.ok()) {
    FuzzRequire(IsOfLibrary(net.status()), std::string(net.status().message()));
    return 0;
  }
  for (const auto& [height, width] : {std::pair(64, 64), {24, 40}, {1, 3}, {64, 64}}) {
    NamedTensors inputs;
    std::map<std::string, TensorShape> shapes;
    for (const auto& [name, shape] : made.inputs) {
      const auto channels = static_cast<int>(shape.channels);
      Tensor& input = inputs[name] = {channels, height, width, {}};
      input.values.assign(static_cast<size_t>(channels * height * width), 0.25f);
      shapes[name] = input.shape();
    }
    const auto expected = ShapesOfOutputs(made, shapes);
    if (!expected.ok() || std::any_of(expected->begin(), expected->end(), [](const auto& output) {
          return output.second.channels * output.second.height * output.second.width > (1 << 20);
        }))
      continue;
    const auto outputs = net->Run(inputs);
    FuzzRequire(outputs.ok() || IsOfLibrary(outputs.status()), std::string(outputs.status().message()));
  }
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  std::vector<std::string> seeds;
  for (int k = 0; k < 64; ++k) {
    std::string& seed = seeds.emplace_back();
    for (int i = 0; i < 40 + 8 * k; ++i) seed += static_cast<char>((i * (37 + 2 * k) + k * 101) >> (i % 3));
  }
  return seeds;
}
