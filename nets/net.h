// A trained net from an ONNX file, run by OpenCV's dnn module on the CPU.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "nets/tensor.h"

namespace weft {

// Not for use by two threads at once. The same bytes at any thread count; another kind of processor may give
// other last bits.
class Net {
 public:
  // Checked by net_model.h first: the library's reader was not made for files of strangers. InvalidArgument
  // names source_name for what is refused there, or by the library.
  static absl::StatusOr<Net> FromOnnx(std::string_view bytes, const std::string& source_name);
  Net(Net&&) noexcept;
  Net& operator=(Net&&) noexcept;
  ~Net();

  // As the file names them, in its order.
  const std::vector<NamedShape>& inputs() const;
  const std::vector<NamedShape>& outputs() const;

  // All outputs for all inputs. InvalidArgument, with the net's source name: errors of ShapesOfOutputs
  // (net_model.h), an input that holds fewer or more values than its shape says, an output with values that
  // are not finite, anything else that the library refuses.
  absl::StatusOr<NamedTensors> Run(const NamedTensors& inputs);

 private:
  struct State;
  explicit Net(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace weft
