#include "nets/net_model.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/status_macros.h"
#include "nets/net_model_fields.h"

namespace weft {
namespace {

absl::Status Refused(const std::string& what) { return absl::InvalidArgumentError(what); }

absl::Status CheckTensor(const NetTensor& tensor) {
  const std::string name = absl::StrCat("tensor \"", tensor.name, "\"");
  int64_t count = 1;
  for (const int64_t dim : tensor.dims) {
    // The product stays far below what overflows.
    if (dim < 0 || dim > kMostChannels || count > kMostNetValues)
      return Refused(absl::StrCat(name, ": dims are ", absl::StrJoin(tensor.dims, " x ")));
    count *= dim;
  }
  if (static_cast<uint64_t>(count) != tensor.values.size())
    return Refused(absl::StrCat(name, ": dims are ", absl::StrJoin(tensor.dims, " x "), ", and it holds ",
                                tensor.values.size(), " numbers"));
  if (!std::all_of(tensor.values.begin(), tensor.values.end(), [](float x) { return std::isfinite(x); }))
    return Refused(absl::StrCat(name, ": holds numbers that are not finite"));
  return absl::OkStatus();
}

// The checks of one model: each node is looked at with what was computed before it. Outputs get the channels
// that they have.
class ModelCheck {
 public:
  explicit ModelCheck(NetModel& model) : model_(model) {}

  absl::Status Run() {
    if (model_.nodes.empty()) return Refused("it has no layers");
    for (const NamedShape& input : model_.inputs) {
      WEFT_RETURN_IF_ERROR(Define(input.name));
      WEFT_RETURN_IF_ERROR(CheckShape("input", input));
      channels_[input.name] = input.shape.channels;
    }
    for (const NetTensor& tensor : model_.tensors) {
      absl::Status status = Define(tensor.name);
      status.Update(CheckTensor(tensor));
      if (!status.ok()) return status;
      tensors_[tensor.name] = &tensor;
    }
    for (const NetNode& node : model_.nodes) {
      if (absl::Status status = CheckNode(node); !status.ok())
        return Refused(absl::StrCat("node \"", node.output, "\": ", std::string(status.message())));
    }
    WEFT_RETURN_IF_ERROR(CheckOutputs());
    for (const std::string& name : defined_) {
      if (!used_.contains(name)) return Refused(absl::StrCat("\"", name, "\" is used by nothing"));
    }
    return absl::OkStatus();
  }

 private:
  absl::Status Define(const std::string& name) {
    if (name.empty()) return Refused("a name is missing");
    if (defined_.insert(name).second) return absl::OkStatus();
    return Refused(absl::StrCat("the name \"", name, "\" stands for two things"));
  }

  static absl::Status CheckShape(const char* kind, const NamedShape& named) {
    const auto [channels, height, width] = named.shape;
    const auto is_side = [](int64_t side) { return side == kAnySize || (side >= 1 && side <= kMostSide); };
    if (channels >= 1 && channels <= kMostChannels && is_side(height) && is_side(width))
      return absl::OkStatus();
    return Refused(absl::StrCat(kind, " \"", named.name, "\" is of ", Describe(named.shape),
                                ", expected 1 to ", kMostChannels, " channels and sides of 1 to ",
                                kMostSide));
  }

  absl::Status CheckOutputs() {
    std::set<std::string> names;
    for (const NetNode& node : model_.nodes) names.insert(node.output);
    for (NamedShape& output : model_.outputs) {
      if (names.erase(output.name) == 0)
        return Refused(absl::StrCat("output \"", output.name, "\" is that of no node, or stands twice"));
      const int64_t channels = channels_.at(output.name);
      if (output.shape.channels == kAnySize) output.shape.channels = channels;
      WEFT_RETURN_IF_ERROR(CheckShape("output", output));
      if (output.shape.channels != channels)
        return Refused(absl::StrCat("output \"", output.name, "\" is of ", output.shape.channels,
                                    " channels, and its node makes ", channels));
      used_.insert(output.name);
    }
    return absl::OkStatus();
  }

  absl::Status CheckNode(const NetNode& node) {
    const auto [least, most] = InputsOf(node.kind);
    if (node.inputs.size() < least || node.inputs.size() > most)
      return Refused(absl::StrCat("has ", node.inputs.size(), " inputs"));
    for (const std::string& input : node.inputs) used_.insert(input);
    const size_t images = node.kind == NetOperator::kConcat ? node.inputs.size() : 1;
    int64_t channels = 0;
    for (size_t i = 0; i < node.inputs.size(); ++i) {
      const bool is_known =
          i < images ? channels_.contains(node.inputs[i]) : tensors_.contains(node.inputs[i]);
      if (!is_known)
        return Refused(absl::StrCat("input \"", node.inputs[i], "\" is no ", i < images ? "image" : "tensor",
                                    " that stands before it"));
      if (i < images) channels += channels_.at(node.inputs[i]);
    }
    WEFT_RETURN_IF_ERROR(CheckNumbers(node));
    absl::Status status;
    if (node.kind == NetOperator::kConv) status = CheckConv(node, channels);
    if (node.kind == NetOperator::kResize) status = CheckResize(node);
    if (channels > kMostChannels) status = Refused(absl::StrCat("has ", channels, " channels"));
    if (status.ok()) status = Define(node.output);
    channels_[node.output] = channels;
    return status;
  }

  static std::pair<size_t, size_t> InputsOf(NetOperator kind) {
    switch (kind) {
      case NetOperator::kConv:
        return {2, 3};
      case NetOperator::kResize:
        return {3, 3};
      case NetOperator::kConcat:
        return {2, kMostInputs};
      default:
        return {1, 1};
    }
  }

  static absl::Status CheckNumbers(const NetNode& node) {
    const auto within = [](const std::array<int64_t, 2>& values, int64_t least, int64_t most) {
      return std::all_of(values.begin(), values.end(), [&](int64_t x) { return x >= least && x <= most; });
    };
    if (!within(node.kernel, 1, kMostKernel))
      return Refused(absl::StrCat("kernel_shape is not 1 to ", kMostKernel));
    if (!within(node.strides, 1, kMostStride))
      return Refused(absl::StrCat("strides are not 1 to ", kMostStride));
    if (!within(node.dilations, 1, kMostStride))
      return Refused(absl::StrCat("dilations are not 1 to ", kMostStride));
    for (size_t axis = 0; axis < 2; ++axis) {
      const int64_t most =
          node.kind == NetOperator::kConv ? node.dilations[axis] * (node.kernel[axis] - 1) : 0;
      if (node.pads[axis] < 0 || node.pads[axis] > most)
        return Refused(absl::StrCat("pads are ", node.pads[axis], ", expected 0 to ", most));
    }
    if (!std::isfinite(node.alpha)) return Refused("alpha is not finite");
    return absl::OkStatus();
  }

  // Gives the channels of its answer.
  absl::Status CheckConv(const NetNode& node, int64_t& channels) const {
    const std::vector<int64_t>& dims = tensors_.at(node.inputs[1])->dims;
    if (dims.size() != 4 || std::any_of(dims.begin(), dims.end(), [](int64_t dim) { return dim < 1; }))
      return Refused("weights have other than 4 dims");
    if (dims[2] != node.kernel[0] || dims[3] != node.kernel[1])
      return Refused("kernel_shape is not that of its weights");
    if (node.group < 1 || node.group > channels || channels % node.group != 0 || dims[0] % node.group != 0)
      return Refused(absl::StrCat("group is ", node.group, ", of ", channels, " channels to ", dims[0]));
    if (dims[1] != channels / node.group)
      return Refused(
          absl::StrCat("weights are of ", dims[1] * node.group, " channels, and it gets ", channels));
    channels = dims[0];
    if (node.inputs.size() < 3) return absl::OkStatus();
    if (tensors_.at(node.inputs[2])->dims == std::vector<int64_t>{channels}) return absl::OkStatus();
    return Refused("its bias is not one number for each channel");
  }

  absl::Status CheckResize(const NetNode& node) const {
    if (!tensors_.at(node.inputs[1])->values.empty()) return Refused("roi is not empty");
    const std::vector<float>& scales = tensors_.at(node.inputs[2])->values;
    const auto is_whole = [](float x) { return x >= 1 && x <= kMostScale && x == std::floor(x); };
    if (scales.size() == 4 && scales[0] == 1 && scales[1] == 1 && is_whole(scales[2]) && is_whole(scales[3]))
      return absl::OkStatus();
    return Refused(absl::StrCat("scales are not 1, 1 and two whole numbers to ", kMostScale));
  }

  NetModel& model_;
  std::set<std::string> defined_, used_;
  std::unordered_map<std::string, int64_t> channels_;  // of images
  std::unordered_map<std::string, const NetTensor*> tensors_;
};

// Adds up what a run takes.
class RunSize {
 public:
  explicit RunSize(const NetModel& model) : model_(model) {
    for (const NetTensor& tensor : model.tensors) tensors_[tensor.name] = &tensor;
  }

  absl::StatusOr<std::map<std::string, TensorShape>> Of(const std::map<std::string, TensorShape>& inputs) {
    WEFT_RETURN_IF_ERROR(CheckInputs(model_.inputs, inputs));
    for (const auto& [name, shape] : inputs) {
      if (shape.height < 1 || shape.width < 1 || shape.height > kMostSide || shape.width > kMostSide)
        return Refused(absl::StrCat("takes images of up to ", kMostSide, " pixels a side, and \"", name,
                                    "\" is of ", Describe(shape)));
      sizes_[name] = shape;
    }
    for (const NetNode& node : model_.nodes) {
      WEFT_ASSIGN_OR_RETURN(const TensorShape size, SizeOf(node));
      // Each is bounded, so neither overflows.
      values_ += size.channels * size.height * size.width;
      if (values_ > kMostNetValues || products_ > kMostNetProducts)
        return Refused(absl::StrCat("takes more memory or time than any net of Weft for ", Told(inputs)));
      sizes_[node.output] = size;
    }
    std::map<std::string, TensorShape> out;
    for (const NamedShape& output : model_.outputs) {
      const TensorShape made = sizes_[output.name], said = output.shape;
      if ((said.height != kAnySize && said.height != made.height) ||
          (said.width != kAnySize && said.width != made.width))
        return Refused(absl::StrCat("makes an output \"", output.name, "\" of ", Describe(made), " of ",
                                    Told(inputs), ", and its file says ", Describe(said)));
      out[output.name] = made;
    }
    return out;
  }

 private:
  static std::string Told(const std::map<std::string, TensorShape>& inputs) {
    std::vector<NamedShape> named;
    for (const auto& [name, shape] : inputs) named.push_back({name, shape});
    return Describe(named);
  }

  absl::StatusOr<TensorShape> SizeOf(const NetNode& node) {
    TensorShape size = sizes_.at(node.inputs.front());
    switch (node.kind) {
      case NetOperator::kLeakyRelu:
        return size;
      case NetOperator::kConcat:
        for (size_t i = 1; i < node.inputs.size(); ++i) {
          const TensorShape& other = sizes_.at(node.inputs[i]);
          if (other.height != size.height || other.width != size.width)
            return Refused(absl::StrCat("node \"", node.output, "\" joins images of ", size.width, " x ",
                                        size.height, " and ", other.width, " x ", other.height,
                                        "; its sides are not multiples of what the net halves"));
          size.channels += other.channels;
        }
        return size;
      case NetOperator::kResize: {
        const std::vector<float>& scales = tensors_.at(node.inputs[2])->values;
        return Bounded({size.channels, size.height * static_cast<int64_t>(scales[2]),
                        size.width * static_cast<int64_t>(scales[3])},
                       node);
      }
      default:
        return SlidOver(node, size);
    }
  }

  absl::StatusOr<TensorShape> SlidOver(const NetNode& node, const TensorShape& size) {
    const auto places = [&](size_t axis, int64_t side) {
      const int64_t room = side + 2 * node.pads[axis] - node.dilations[axis] * (node.kernel[axis] - 1) - 1;
      return room < 0 ? 0 : room / node.strides[axis] + 1;
    };
    TensorShape out = {size.channels, places(0, size.height), places(1, size.width)};
    int64_t products = node.kernel[0] * node.kernel[1];
    if (node.kind == NetOperator::kConv) {
      const NetTensor& weights = *tensors_.at(node.inputs[1]);
      out.channels = weights.dims[0];
      products *= weights.dims[1];
    }
    const absl::StatusOr<TensorShape> bounded = Bounded(out, node);
    // kMostNetValues of at most 2^24 products: below 2^63 until the sum is looked at.
    if (bounded.ok()) products_ += products * (out.channels * out.height * out.width);
    return bounded;
  }

  static absl::StatusOr<TensorShape> Bounded(const TensorShape& size, const NetNode& node) {
    if (size.height < 1 || size.width < 1)
      return Refused(absl::StrCat("the image is too small for node \"", node.output, "\""));
    if (size.height > kMostSide || size.width > kMostSide ||
        size.channels * size.height * size.width > kMostNetValues)
      return Refused(absl::StrCat("node \"", node.output, "\" makes an image of ", size.channels, " x ",
                                  size.height, " x ", size.width, " values"));
    return size;
  }

  const NetModel& model_;
  std::unordered_map<std::string, const NetTensor*> tensors_;
  std::unordered_map<std::string, TensorShape> sizes_;
  int64_t values_ = 0, products_ = 0;
};

}  // namespace

absl::StatusOr<NetModel> ReadNetModel(std::string_view onnx) {
  WEFT_ASSIGN_OR_RETURN(NetModel model, ReadNetFields(onnx));
  WEFT_RETURN_IF_ERROR(ModelCheck(model).Run());
  // Some size that every halving divides, the same for all inputs.
  constexpr int64_t kSide = 64;
  std::map<std::string, TensorShape> tried;
  for (const auto& [name, shape] : model.inputs)
    tried[name] = {shape.channels, shape.height == kAnySize ? kSide : shape.height,
                   shape.width == kAnySize ? kSide : shape.width};
  WEFT_RETURN_IF_ERROR(ShapesOfOutputs(model, tried).status());
  return model;
}

absl::StatusOr<std::map<std::string, TensorShape>> ShapesOfOutputs(
    const NetModel& model, const std::map<std::string, TensorShape>& inputs) {
  return RunSize(model).Of(inputs);
}

}  // namespace weft
