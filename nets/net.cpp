#include "nets/net.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <opencv2/dnn.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "nets/net_model.h"

namespace weft {

struct Net::State {
  std::string source_name;
  NetModel model;
  cv::dnn::Net net;
};

Net::Net(std::unique_ptr<State> state) : state_(std::move(state)) {}
Net::Net(Net&&) noexcept = default;
Net& Net::operator=(Net&&) noexcept = default;
Net::~Net() = default;

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
  const std::string checked = WriteNetModel(*model);
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

absl::StatusOr<Tensor> Net::Run(const Tensor& image) {
  const auto bad = [&](const std::string& why) {
    return absl::InvalidArgumentError(absl::StrCat(state_->source_name, ": ", why));
  };
  const size_t size = static_cast<size_t>(image.channels) * static_cast<size_t>(image.height) *
                      static_cast<size_t>(image.width);
  if (size == 0 || image.values.size() != size) return bad("was given an image of another size than it says");
  const absl::StatusOr<NetSize> expected =
      SizeOfAnswer(state_->model, {image.channels, image.height, image.width});
  if (!expected.ok()) return bad(std::string(expected.status().message()));
  Tensor out;
  try {
    const int sizes[] = {1, image.channels, image.height, image.width};
    const cv::Mat input(4, sizes, CV_32F, const_cast<float*>(image.values.data()));
    state_->net.setInput(input);
    const cv::Mat answer = state_->net.forward();
    if (answer.dims != 4 || answer.size[0] != 1 || answer.type() != CV_32F ||
        answer.size[1] != expected->channels || answer.size[2] != expected->height ||
        answer.size[3] != expected->width)
      return bad("answers with something other than the image that its file describes");
    out.channels = answer.size[1], out.height = answer.size[2], out.width = answer.size[3];
    const float* values = answer.ptr<float>();
    out.values.assign(values, values + answer.total());
  } catch (const std::exception& e) {
    return bad(absl::StrCat("can't be run: ", e.what()));
  }
  if (!std::all_of(out.values.begin(), out.values.end(), [](float x) { return std::isfinite(x); }))
    return bad("answers with numbers that are not finite");
  return out;
}

}  // namespace weft
