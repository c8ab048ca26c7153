#include "learning/onnx_export.h"

#include <onnx/onnx_pb.h>

#include <cstdint>
#include <initializer_list>

namespace weft::learning {
namespace {

constexpr int kOpset = 11, kIrVersion = 6;

class Graph {
 public:
  Graph() {
    model_.set_ir_version(kIrVersion);
    model_.set_producer_name("weft-train");
    model_.add_opset_import()->set_version(kOpset);
    graph_ = model_.mutable_graph();
    graph_->set_name("offsets");
  }

  std::string Conv(const std::string& input, const ConvWeights& layer) {
    const std::string name = Name("conv");
    AddTensor(name + ".weight", {layer.to, layer.from, layer.size, layer.size}, layer.weights);
    AddTensor(name + ".bias", {layer.to}, layer.bias);
    onnx::NodeProto& node = Node("Conv", name, {input, name + ".weight", name + ".bias"});
    const int64_t pad = layer.size / 2;
    Ints(node, "kernel_shape", {layer.size, layer.size});
    Ints(node, "pads", {pad, pad, pad, pad});
    Ints(node, "strides", {1, 1});
    return name;
  }
  std::string Leaky(const std::string& input, float leak) {
    const std::string name = Name("leaky");
    onnx::AttributeProto& alpha = *Node("LeakyRelu", name, {input}).add_attribute();
    alpha.set_name("alpha");
    alpha.set_type(onnx::AttributeProto::FLOAT);
    alpha.set_f(leak);
    return name;
  }
  std::string Halve(const std::string& input) {
    const std::string name = Name("half");
    onnx::NodeProto& node = Node("AveragePool", name, {input});
    Ints(node, "kernel_shape", {2, 2});
    Ints(node, "strides", {2, 2});
    return name;
  }
  std::string Double(const std::string& input) {
    const std::string name = Name("double");
    AddTensor(name + ".scales", {4}, {1, 1, 2, 2});
    AddTensor(name + ".roi", {0}, {});
    onnx::NodeProto& node = Node("Resize", name, {input, name + ".roi", name + ".scales"});
    Text(node, "mode", "nearest");
    Text(node, "coordinate_transformation_mode", "asymmetric");
    Text(node, "nearest_mode", "floor");
    return name;
  }
  std::string Join(const std::string& a, const std::string& b) {
    const std::string name = Name("join");
    onnx::AttributeProto& axis = *Node("Concat", name, {a, b}).add_attribute();
    axis.set_name("axis");
    axis.set_type(onnx::AttributeProto::INT);
    axis.set_i(1);
    return name;
  }
  // Of images of any size.
  std::string Finish(const std::string& output, int features, int answers) {
    graph_->mutable_node(graph_->node_size() - 1)->set_output(0, "answer");
    (void)output;
    Describe(*graph_->add_input(), "image", features);
    Describe(*graph_->add_output(), "answer", answers);
    return model_.SerializeAsString();
  }

 private:
  std::string Name(const char* kind) { return kind + std::to_string(names_++); }
  onnx::NodeProto& Node(const char* kind, const std::string& name,
                        std::initializer_list<std::string> inputs) {
    onnx::NodeProto& node = *graph_->add_node();
    node.set_op_type(kind);
    node.set_name(name);
    for (const std::string& input : inputs) node.add_input(input);
    node.add_output(name);
    return node;
  }
  static void Ints(onnx::NodeProto& node, const char* name, std::initializer_list<int64_t> values) {
    onnx::AttributeProto& attribute = *node.add_attribute();
    attribute.set_name(name);
    attribute.set_type(onnx::AttributeProto::INTS);
    for (const int64_t value : values) attribute.add_ints(value);
  }
  static void Text(onnx::NodeProto& node, const char* name, const char* value) {
    onnx::AttributeProto& attribute = *node.add_attribute();
    attribute.set_name(name);
    attribute.set_type(onnx::AttributeProto::STRING);
    attribute.set_s(value);
  }
  void AddTensor(const std::string& name, std::initializer_list<int64_t> dims,
                 const std::vector<float>& values) {
    onnx::TensorProto& tensor = *graph_->add_initializer();
    tensor.set_name(name);
    tensor.set_data_type(onnx::TensorProto::FLOAT);
    for (const int64_t d : dims) tensor.add_dims(d);
    tensor.set_raw_data(std::string(reinterpret_cast<const char*>(values.data()), 4 * values.size()));
  }
  static void Describe(onnx::ValueInfoProto& info, const char* name, int channels) {
    info.set_name(name);
    onnx::TypeProto::Tensor& type = *info.mutable_type()->mutable_tensor_type();
    type.set_elem_type(onnx::TensorProto::FLOAT);
    onnx::TensorShapeProto& shape = *type.mutable_shape();
    shape.add_dim()->set_dim_value(1);
    shape.add_dim()->set_dim_value(channels);
    shape.add_dim()->set_dim_param("height");
    shape.add_dim()->set_dim_param("width");
  }

  onnx::ModelProto model_;
  onnx::GraphProto* graph_ = nullptr;
  int names_ = 0;
};

}  // namespace

std::string UNetToOnnx(const std::vector<ConvWeights>& layers, int levels, float leak) {
  Graph graph;
  size_t layer = 0;
  std::string x = "image";
  const auto next = [&] { x = graph.Leaky(graph.Conv(x, layers[layer++]), leak); };
  std::vector<std::string> skips;
  for (int level = 0; level < levels; ++level) {
    if (level > 0) x = graph.Halve(x);
    next(), next();
    if (level + 1 < levels) skips.push_back(x);
  }
  for (int level = levels - 1; level-- > 0;) {
    x = graph.Join(graph.Double(x), skips[static_cast<size_t>(level)]);
    next(), next();
  }
  x = graph.Conv(x, layers[layer]);
  return graph.Finish(x, layers.front().from, layers[layer].to);
}

}  // namespace weft::learning
