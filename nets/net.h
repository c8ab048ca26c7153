// A trained net from an ONNX file, run by OpenCV's dnn module on the CPU.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

// [channels][height][width].
struct Tensor {
  int channels = 0, height = 0, width = 0;
  std::vector<float> values;
};

// One image in, one out. Not for use by two threads at once. The same bytes at any thread count; another kind
// of processor may give other last bits.
class Net {
 public:
  // Checked by net_model.h first: the library's reader was not made for files of strangers. InvalidArgument
  // names source_name for what is refused there, or by the library.
  static absl::StatusOr<Net> FromOnnx(std::string_view bytes, const std::string& source_name);
  Net(Net&&) noexcept;
  Net& operator=(Net&&) noexcept;
  ~Net();

  // InvalidArgument, with the net's source name: an image of other channels than the net takes, values that
  // are not finite in the answer, anything else that the library refuses.
  absl::StatusOr<Tensor> Run(const Tensor& image);

 private:
  struct State;
  explicit Net(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace weft
