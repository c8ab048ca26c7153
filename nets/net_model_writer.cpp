// WriteNetModel: see net_model.h.
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>

#include <bit>
#include <string>

#include "nets/net_model.h"

namespace weft {
namespace {

using google::protobuf::internal::WireFormatLite;

// One message; fields by their numbers in onnx.proto of ONNX 1.12.
class Message {
 public:
  Message& Number(int field, int64_t value) {
    return Append([&](auto* out) { WireFormatLite::WriteInt64(field, value, out); });
  }
  Message& Float(int field, float value) {
    return Append([&](auto* out) { WireFormatLite::WriteFloat(field, value, out); });
  }
  Message& Bytes(int field, const std::string& value) {
    return Append([&](auto* out) { WireFormatLite::WriteBytes(field, value, out); });
  }
  Message& Within(int field, const Message& value) { return Bytes(field, value.bytes_); }
  const std::string& bytes() const { return bytes_; }

 private:
  template <typename Write>
  Message& Append(const Write& write) {
    google::protobuf::io::StringOutputStream stream(&bytes_);
    google::protobuf::io::CodedOutputStream out(&stream);
    write(&out);
    return *this;
  }

  std::string bytes_;
};

constexpr int kFloat = 1, kInt = 2, kText = 3, kInts = 7;  // AttributeProto.type

Message Ints(const char* name, std::initializer_list<int64_t> values) {
  Message attribute;
  attribute.Bytes(1, name);
  for (const int64_t value : values) attribute.Number(8, value);
  attribute.Number(20, kInts);
  return attribute;
}
Message Text(const char* name, const char* value) {
  Message attribute;
  attribute.Bytes(1, name).Bytes(4, value).Number(20, kText);
  return attribute;
}
Message Int(const char* name, int64_t value) {
  Message attribute;
  attribute.Bytes(1, name).Number(3, value).Number(20, kInt);
  return attribute;
}

void AddAttributes(const NetNode& node, Message& out) {
  const auto add = [&out](const Message& attribute) { out.Within(5, attribute); };
  switch (node.kind) {
    case NetOperator::kLeakyRelu: {
      Message alpha;
      alpha.Bytes(1, "alpha").Float(2, node.alpha).Number(20, kFloat);
      return add(alpha);
    }
    case NetOperator::kConcat:
      return add(Int("axis", 1));
    case NetOperator::kResize:
      add(Text("mode", "nearest"));
      add(Text("coordinate_transformation_mode", "asymmetric"));
      return add(Text("nearest_mode", "floor"));
    case NetOperator::kConv:
      add(Ints("dilations", {node.dilations[0], node.dilations[1]}));
      add(Int("group", node.group));
      [[fallthrough]];
    case NetOperator::kAveragePool:
      add(Ints("kernel_shape", {node.kernel[0], node.kernel[1]}));
      add(Ints("pads", {node.pads[0], node.pads[1], node.pads[0], node.pads[1]}));
      add(Ints("strides", {node.strides[0], node.strides[1]}));
  }
}

const char* NameOf(NetOperator kind) {
  switch (kind) {
    case NetOperator::kConv:
      return "Conv";
    case NetOperator::kLeakyRelu:
      return "LeakyRelu";
    case NetOperator::kAveragePool:
      return "AveragePool";
    case NetOperator::kResize:
      return "Resize";
    case NetOperator::kConcat:
      return "Concat";
  }
  return "";
}

Message NodeOf(const NetNode& node) {
  Message out;
  for (const std::string& input : node.inputs) out.Bytes(1, input);
  out.Bytes(2, node.output).Bytes(4, NameOf(node.kind));
  AddAttributes(node, out);
  return out;
}

Message StoredTensor(const NetTensor& tensor) {
  Message out;
  for (const int64_t dim : tensor.dims) out.Number(1, dim);
  static_assert(std::endian::native == std::endian::little);
  out.Number(2, 1).Bytes(8, tensor.name);
  out.Bytes(9, std::string(reinterpret_cast<const char*>(tensor.values.data()),
                           sizeof(float) * tensor.values.size()));
  return out;
}

Message DimensionOf(int64_t size, const char* name) {
  Message out;
  return size == kAnySize ? out.Bytes(2, name) : out.Number(1, size);
}

// An input or an output.
Message ValueOf(const NamedShape& named) {
  Message shape, type, any, out;
  shape.Within(1, DimensionOf(1, "batch")).Within(1, DimensionOf(named.shape.channels, "channels"));
  shape.Within(1, DimensionOf(named.shape.height, "height"));
  shape.Within(1, DimensionOf(named.shape.width, "width"));
  type.Number(1, 1).Within(2, shape);
  out.Bytes(1, named.name).Within(2, any.Within(1, type));
  return out;
}

}  // namespace

std::string WriteNetModel(const NetModel& model) {
  Message graph, opset, out;
  for (const NetNode& node : model.nodes) graph.Within(1, NodeOf(node));
  graph.Bytes(2, "net");
  for (const NetTensor& tensor : model.tensors) graph.Within(5, StoredTensor(tensor));
  for (const NamedShape& input : model.inputs) graph.Within(11, ValueOf(input));
  for (const NamedShape& output : model.outputs) graph.Within(12, ValueOf(output));
  opset.Number(2, 11);
  out.Number(1, 6).Bytes(2, "weft").Within(7, graph).Within(8, opset);
  return out.bytes();
}

}  // namespace weft
