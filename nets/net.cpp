#include "nets/net.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <opencv2/dnn.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "nets/net_model.h"

namespace weft {
namespace {

// Of any size: where sides are told the library's reader takes another way, which we did not try.
NetModel WithoutSides(NetModel model) {
  for (std::vector<NamedShape>* shapes : {&model.inputs, &model.outputs})
    for (NamedShape& named : *shapes) named.shape.height = named.shape.width = kAnySize;
  return model;
}

absl::Status CheckValues(const NamedTensors& inputs) {
  for (const auto& [name, input] : inputs) {
    const size_t size = static_cast<size_t>(input.channels) * static_cast<size_t>(input.height) *
                        static_cast<size_t>(input.width);
    if (input.values.size() != size)
      return absl::InvalidArgumentError(
          absl::StrCat("was given \"", name, "\" of another size than it says: ", Describe(input.shape()),
                       " in ", input.values.size(), " values"));
  }
  return absl::OkStatus();
}

absl::StatusOr<Tensor> TensorOf(const cv::Mat& blob, const NamedShape& expected) {
  if (blob.dims != 4 || blob.size[0] != 1 || blob.type() != CV_32F ||
      TensorShape{blob.size[1], blob.size[2], blob.size[3]} != expected.shape)
    return absl::InvalidArgumentError(
        absl::StrCat("answers with something other than ", Describe({expected}), ", as its file describes"));
  const float* values = blob.ptr<float>();
  if (!std::all_of(values, values + blob.total(), [](float x) { return std::isfinite(x); }))
    return absl::InvalidArgumentError(
        absl::StrCat("answers with numbers that are not finite in \"", expected.name, "\""));
  return Tensor{blob.size[1], blob.size[2], blob.size[3], {values, values + blob.total()}};
}

}  // namespace

struct Net::State {
  std::string source_name;
  NetModel model;
  cv::dnn::Net net;
};

Net::Net(std::unique_ptr<State> state) : state_(std::move(state)) {}
Net::Net(Net&&) noexcept = default;
Net& Net::operator=(Net&&) noexcept = default;
Net::~Net() = default;

const std::vector<NamedShape>& Net::inputs() const { return state_->model.inputs; }
const std::vector<NamedShape>& Net::outputs() const { return state_->model.outputs; }

absl::StatusOr<Net> Net::FromOnnx(std::string_view bytes, const std::string& source_name) {
  const auto bad = [&](const std::string& why) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": is no net that can be read: ", why));
  };
  if (bytes.empty()) return bad("it is empty");
  auto state = std::make_unique<State>();
  state->source_name = source_name;
  absl::StatusOr<NetModel> model = ReadNetModel(bytes);
  if (!model.ok()) return bad(std::string(model.status().message()));
  // What was checked, and nothing that this reader and the library's could understand in two ways.
  const std::string checked = WriteNetModel(WithoutSides(*model));
  state->model = *std::move(model);
  // Sizes are asked for later, weights are not.
  constexpr size_t kFactors = 4;
  for (NetTensor& tensor : state->model.tensors) {
    if (tensor.values.size() > kFactors) tensor.values = {};
  }
  try {
    state->net = cv::dnn::readNetFromONNX(checked.data(), checked.size());
    if (state->net.empty()) return bad("it has no layers");
    state->net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    state->net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  } catch (const std::exception& e) {  // the library's own, and those of the standard library within it
    return bad(e.what());
  }
  return Net(std::move(state));
}

absl::StatusOr<NamedTensors> Net::Run(const NamedTensors& inputs) {
  const auto bad = [&](absl::string_view why) {
    return absl::InvalidArgumentError(absl::StrCat(state_->source_name, ": ", why));
  };
  std::map<std::string, TensorShape> given;
  for (const auto& [name, input] : inputs) given[name] = input.shape();
  const absl::StatusOr<std::map<std::string, TensorShape>> shapes = ShapesOfOutputs(state_->model, given);
  if (!shapes.ok()) return bad(shapes.status().message());
  if (const absl::Status status = CheckValues(inputs); !status.ok()) return bad(status.message());
  NamedTensors out;
  try {
    for (const auto& [name, input] : inputs) {
      const int sizes[] = {1, input.channels, input.height, input.width};
      state_->net.setInput(cv::Mat(4, sizes, CV_32F, const_cast<float*>(input.values.data())), name);
    }
    std::vector<cv::String> names;
    for (const NamedShape& output : state_->model.outputs) names.push_back(output.name);
    std::vector<cv::Mat> blobs;
    state_->net.forward(blobs, names);
    for (size_t i = 0; i < names.size(); ++i) {
      absl::StatusOr<Tensor> output = TensorOf(blobs[i], {names[i], shapes->at(names[i])});
      if (!output.ok()) return bad(output.status().message());
      out[names[i]] = *std::move(output);
    }
  } catch (const std::exception& e) {
    return bad(absl::StrCat("can't be run: ", e.what()));
  }
  return out;
}

}  // namespace weft
