#include "nets/net_model_fields.h"

#include <google/protobuf/io/coded_stream.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "nets/wire_fields.h"

namespace weft {
namespace {

using Kind = WireField::Kind;

absl::Status Bad(const std::string& what) { return absl::InvalidArgumentError(what); }
absl::Status Unknown(const char* message, const WireField& field) {
  return Bad(absl::StrCat(message, " has field ", field.number, ", which our nets do not have"));
}

// Numbers of fields in onnx.proto of ONNX 1.12.
namespace model_field {
constexpr int kIrVersion = 1, kProducer = 2, kProducerVersion = 3, kDomain = 4, kVersion = 5, kDoc = 6,
              kGraph = 7, kOpset = 8;
}
namespace opset_field {
constexpr int kDomain = 1, kVersion = 2;
}
namespace graph_field {
constexpr int kNode = 1, kName = 2, kInitializer = 5, kDoc = 10, kInput = 11, kOutput = 12;
}
namespace node_field {
constexpr int kInput = 1, kOutput = 2, kName = 3, kOperator = 4, kAttribute = 5, kDoc = 6, kDomain = 7;
}
namespace attribute_field {
constexpr int kName = 1, kFloat = 2, kInt = 3, kText = 4, kInts = 8, kDoc = 13, kType = 20;
}
namespace tensor_field {
constexpr int kDims = 1, kType = 2, kFloats = 4, kName = 8, kRaw = 9, kDoc = 12;
}
constexpr int kFloatType = 1;  // TensorProto.FLOAT
constexpr int kTextType = 3, kFloatAttribute = 1, kIntAttribute = 2, kIntsAttribute = 7;
constexpr uint64_t kOldestOpset = 11, kNewestOpset = 13;  // in which the operators mean the same

const std::map<std::string_view, NetOperator>& Operators() {
  static const std::map<std::string_view, NetOperator> operators = {
      {"Conv", NetOperator::kConv},
      {"LeakyRelu", NetOperator::kLeakyRelu},
      {"AveragePool", NetOperator::kAveragePool},
      {"Resize", NetOperator::kResize},
      {"Concat", NetOperator::kConcat}};
  return operators;
}

absl::Status ReadName(const WireField& field, std::string& name) {
  if (field.kind != Kind::kBytes || field.bytes.size() > kMostNameBytes)
    return Bad(absl::StrCat("a name is no text of up to ", kMostNameBytes, " bytes"));
  if (!std::all_of(field.bytes.begin(), field.bytes.end(), absl::ascii_isprint))
    return Bad("a name has other characters than printable ones of ASCII");
  name = field.bytes;
  return absl::OkStatus();
}

// Whole numbers, one by one or packed.
absl::Status ReadInts(const WireField& field, size_t most, std::vector<int64_t>& values) {
  if (field.kind == Kind::kNumber) {
    values.push_back(static_cast<int64_t>(field.value));
  } else if (field.kind == Kind::kBytes && field.bytes.size() <= 10 * most) {
    google::protobuf::io::CodedInputStream in(reinterpret_cast<const uint8_t*>(field.bytes.data()),
                                              static_cast<int>(field.bytes.size()));
    for (uint64_t value = 0; in.ReadVarint64(&value);) values.push_back(static_cast<int64_t>(value));
    if (static_cast<size_t>(in.CurrentPosition()) != field.bytes.size())
      return Bad("packed numbers are damaged");
  } else {
    return Bad("a whole number is of another kind");
  }
  return values.size() <= most ? absl::OkStatus() : Bad(absl::StrCat("more than ", most, " numbers"));
}

// 4 bytes each, the least significant first.
absl::Status ReadFloats(std::string_view bytes, std::vector<float>& values) {
  if (bytes.size() % sizeof(float) != 0 || bytes.size() / sizeof(float) > kMostNetValues)
    return Bad("its data is no whole number of floats");
  static_assert(std::endian::native == std::endian::little);
  const size_t before = values.size();
  values.resize(before + bytes.size() / sizeof(float));
  if (!bytes.empty()) std::memcpy(values.data() + before, bytes.data(), bytes.size());
  return absl::OkStatus();
}

absl::StatusOr<NetTensor> ReadTensor(std::string_view bytes) {
  NetTensor tensor;
  bool is_float = false, is_raw = false, is_listed = false;
  absl::Status status = VisitFields(bytes, [&](const WireField& field) -> absl::Status {
    switch (field.number) {
      case tensor_field::kDims:
        return ReadInts(field, 4, tensor.dims);
      case tensor_field::kType:
        is_float = field.kind == Kind::kNumber && field.value == kFloatType;
        return is_float ? absl::OkStatus() : Bad("a tensor holds other numbers than floats");
      case tensor_field::kName:
        return ReadName(field, tensor.name);
      case tensor_field::kRaw:
        if (field.kind != Kind::kBytes || is_raw || is_listed) return Bad("a tensor's data stands twice");
        is_raw = true;
        return ReadFloats(field.bytes, tensor.values);
      case tensor_field::kFloats: {
        if (is_raw) return Bad("a tensor's data stands twice");
        is_listed = true;
        if (field.kind == Kind::kBytes) return ReadFloats(field.bytes, tensor.values);
        if (field.kind != Kind::kFourBytes) return Bad("a float is of another kind");
        tensor.values.push_back(std::bit_cast<float>(static_cast<uint32_t>(field.value)));
        return absl::OkStatus();
      }
      case tensor_field::kDoc:
        return absl::OkStatus();
      default:
        return Unknown("a tensor", field);
    }
  });
  if (status.ok() && !is_float) status = Bad("a tensor does not say that it holds floats");
  return status.ok() ? absl::StatusOr<NetTensor>(std::move(tensor)) : status;
}

struct Attribute {
  std::string name, text;
  float number = 0;
  int64_t whole = 0;
  std::vector<int64_t> wholes;
  uint64_t type = 0;
};

absl::StatusOr<Attribute> ReadAttribute(std::string_view bytes) {
  Attribute read;
  std::set<uint64_t> held;
  absl::Status status = VisitFields(bytes, [&](const WireField& field) -> absl::Status {
    switch (field.number) {
      case attribute_field::kName:
        return ReadName(field, read.name);
      case attribute_field::kFloat:
        held.insert(kFloatAttribute);
        read.number = std::bit_cast<float>(static_cast<uint32_t>(field.value));
        return field.kind == Kind::kFourBytes ? absl::OkStatus()
                                              : Bad("an attribute's float is of another kind");
      case attribute_field::kInt:
        held.insert(kIntAttribute);
        read.whole = static_cast<int64_t>(field.value);
        return field.kind == Kind::kNumber ? absl::OkStatus()
                                           : Bad("an attribute's number is of another kind");
      case attribute_field::kText:
        held.insert(kTextType);
        return ReadName(field, read.text);
      case attribute_field::kInts:
        held.insert(kIntsAttribute);
        return ReadInts(field, 4, read.wholes);
      case attribute_field::kType:
        read.type = field.value;
        return field.kind == Kind::kNumber ? absl::OkStatus() : Bad("an attribute's type is no number");
      case attribute_field::kDoc:
        return absl::OkStatus();
      default:
        return Unknown("an attribute", field);
    }
  });
  if (status.ok() && held != std::set<uint64_t>{read.type})
    status = Bad(absl::StrCat("attribute \"", read.name, "\" does not hold what its type says"));
  return status.ok() ? absl::StatusOr<Attribute>(std::move(read)) : status;
}

// Two numbers, or of pads two at either end, which must be alike.
absl::Status TakeAxes(const Attribute& attribute, size_t count, std::array<int64_t, 2>& axes) {
  const std::vector<int64_t>& values = attribute.wholes;
  if (attribute.type != kIntsAttribute || values.size() != count)
    return Bad(absl::StrCat(attribute.name, " has not ", count, " whole numbers"));
  axes = {values[0], values[1]};
  if (count == 4 && (values[2] != values[0] || values[3] != values[1]))
    return Bad("pads differ between beginning and end");
  return absl::OkStatus();
}

// The attributes that our nets have, by their operator; others may only say what is so without them.
absl::Status TakeAttribute(const Attribute& attribute, NetNode& node) {
  const std::string& name = attribute.name;
  const bool is_conv = node.kind == NetOperator::kConv, is_pool = node.kind == NetOperator::kAveragePool;
  const auto is_int = [&](int64_t value) {
    return attribute.type == kIntAttribute && attribute.whole == value;
  };
  const auto is_text = [&](std::string_view text) {
    return attribute.type == kTextType && attribute.text == text;
  };
  if (is_conv || is_pool) {
    if (name == "kernel_shape") return TakeAxes(attribute, 2, node.kernel);
    if (name == "strides") return TakeAxes(attribute, 2, node.strides);
    if (name == "pads") return TakeAxes(attribute, 4, node.pads);
    if (name == "auto_pad" && is_text("NOTSET")) return absl::OkStatus();
  }
  if (is_conv && name == "dilations") return TakeAxes(attribute, 2, node.dilations);
  if (is_conv && name == "group" && attribute.type == kIntAttribute) {
    node.group = attribute.whole;
    return absl::OkStatus();
  }
  if (is_pool && (name == "ceil_mode" || name == "count_include_pad") && is_int(0)) return absl::OkStatus();
  if (node.kind == NetOperator::kLeakyRelu && name == "alpha" && attribute.type == kFloatAttribute) {
    node.alpha = attribute.number;
    return absl::OkStatus();
  }
  if (node.kind == NetOperator::kConcat && name == "axis" && is_int(1)) return absl::OkStatus();
  if (node.kind == NetOperator::kResize &&
      ((name == "mode" && is_text("nearest")) || (name == "nearest_mode" && is_text("floor")) ||
       (name == "coordinate_transformation_mode" && is_text("asymmetric"))))
    return absl::OkStatus();
  return Bad(absl::StrCat("attribute \"", name, "\" is unknown, or has a value that our nets do not have"));
}

// Attributes without which the node would mean something else.
absl::Status CheckGiven(NetOperator kind, const std::set<std::string>& given) {
  static const std::map<NetOperator, std::vector<const char*>> needed = {
      {NetOperator::kConv, {"kernel_shape"}},
      {NetOperator::kLeakyRelu, {}},
      {NetOperator::kAveragePool, {"kernel_shape"}},
      {NetOperator::kResize, {"mode", "nearest_mode", "coordinate_transformation_mode"}},
      {NetOperator::kConcat, {"axis"}}};
  for (const char* name : needed.at(kind)) {
    if (!given.contains(name)) return Bad(absl::StrCat("attribute \"", name, "\" is missing"));
  }
  return absl::OkStatus();
}

absl::StatusOr<NetNode> ReadNode(std::string_view bytes) {
  NetNode node;
  std::string kind, ignored;
  std::vector<Attribute> attributes;
  WEFT_RETURN_IF_ERROR(VisitFields(bytes, [&](const WireField& field) -> absl::Status {
    switch (field.number) {
      case node_field::kInput:
        if (node.inputs.size() >= kMostInputs) return Bad(absl::StrCat("more than ", kMostInputs, " inputs"));
        return ReadName(field, node.inputs.emplace_back());
      case node_field::kOutput:
        if (!node.output.empty()) return Bad("a node has two outputs");
        return ReadName(field, node.output);
      case node_field::kOperator:
        return ReadName(field, kind);
      case node_field::kDomain:
        WEFT_RETURN_IF_ERROR(ReadName(field, ignored));
        return ignored.empty() ? absl::OkStatus()
                               : Bad(absl::StrCat("operators of domain \"", ignored, "\""));
      case node_field::kAttribute: {
        if (attributes.size() >= kMostInputs)
          return Bad(absl::StrCat("more than ", kMostInputs, " attributes"));
        absl::StatusOr<Attribute> attribute =
            field.kind == Kind::kBytes ? ReadAttribute(field.bytes) : Unknown("a node", field);
        if (attribute.ok()) attributes.push_back(*std::move(attribute));
        return attribute.status();
      }
      case node_field::kName:
      case node_field::kDoc:
        return absl::OkStatus();
      default:
        return Unknown("a node", field);
    }
  }));
  const auto found = Operators().find(kind);
  if (found == Operators().end())
    return Bad(
        absl::StrCat("operator \"", kind, "\"; our nets have Conv, LeakyRelu, AveragePool, Resize, Concat"));
  node.kind = found->second;
  std::set<std::string> given;
  for (const Attribute& attribute : attributes) {
    if (!given.insert(attribute.name).second)
      return Bad(absl::StrCat("attribute \"", attribute.name, "\" stands twice"));
    WEFT_RETURN_IF_ERROR(TakeAttribute(attribute, node));
  }
  WEFT_RETURN_IF_ERROR(CheckGiven(node.kind, given));
  return node;
}

// An input or an output: [1][channels][height][width] of floats.
absl::StatusOr<NamedShape> ReadNamedShape(std::string_view bytes) {
  NamedShape out;
  std::vector<int64_t> dims;
  const auto read_dim = [&](const WireField& dim) -> absl::Status {
    if (dim.number != 1 || dim.kind != Kind::kBytes || dims.size() >= 4) return Unknown("a shape", dim);
    int64_t& side = dims.emplace_back(kAnySize);
    return VisitFields(dim.bytes, [&](const WireField& field) -> absl::Status {
      if (field.number == 1 && field.kind == Kind::kNumber) side = static_cast<int64_t>(field.value);
      return field.number <= 3 ? absl::OkStatus() : Unknown("a dimension", field);
    });
  };
  const auto read_tensor_type = [&](const WireField& part) -> absl::Status {
    if (part.number == 1 && part.kind == Kind::kNumber)
      return part.value == kFloatType ? absl::OkStatus() : Bad("an image holds other numbers than floats");
    if (part.number == 2 && part.kind == Kind::kBytes) return VisitFields(part.bytes, read_dim);
    return Unknown("a tensor's type", part);
  };
  WEFT_RETURN_IF_ERROR(VisitFields(bytes, [&](const WireField& field) -> absl::Status {
    if (field.number == 1) return ReadName(field, out.name);
    if (field.number == 3) return absl::OkStatus();  // words
    if (field.number != 2 || field.kind != Kind::kBytes) return Unknown("an image", field);
    return VisitFields(field.bytes, [&](const WireField& type) -> absl::Status {
      if (type.number == 6) return absl::OkStatus();  // words
      if (type.number != 1 || type.kind != Kind::kBytes) return Unknown("a type", type);
      return VisitFields(type.bytes, read_tensor_type);
    });
  }));
  if (dims.size() != 4 || dims[0] > 1 || dims[0] == 0)
    return Bad(absl::StrCat("\"", out.name, "\" is no image of 1 x channels x height x width"));
  out.shape = {dims[1], dims[2], dims[3]};
  return out;
}

absl::Status AddNamedShape(const WireField& field, size_t most, std::vector<NamedShape>& shapes) {
  if (shapes.size() >= most) return Bad(absl::StrCat("more than ", most, " inputs or outputs"));
  WEFT_ASSIGN_OR_RETURN(NamedShape shape, ReadNamedShape(field.bytes));
  shapes.push_back(std::move(shape));
  return absl::OkStatus();
}

absl::Status ReadGraph(std::string_view bytes, NetModel& model) {
  WEFT_RETURN_IF_ERROR(VisitFields(bytes, [&](const WireField& field) -> absl::Status {
    if (field.kind != Kind::kBytes) return Unknown("the graph", field);
    switch (field.number) {
      case graph_field::kNode: {
        if (model.nodes.size() >= kMostNodes) return Bad(absl::StrCat("more than ", kMostNodes, " nodes"));
        absl::StatusOr<NetNode> node = ReadNode(field.bytes);
        if (node.ok()) model.nodes.push_back(*std::move(node));
        return node.ok() ? absl::OkStatus()
                         : Bad(absl::StrCat("node ", model.nodes.size(), ": ", node.status().message()));
      }
      case graph_field::kInitializer: {
        if (model.tensors.size() >= kMostTensors)
          return Bad(absl::StrCat("more than ", kMostTensors, " tensors"));
        absl::StatusOr<NetTensor> tensor = ReadTensor(field.bytes);
        if (tensor.ok()) model.tensors.push_back(*std::move(tensor));
        return tensor.status();
      }
      case graph_field::kInput:
        return AddNamedShape(field, kMostInputs, model.inputs);
      case graph_field::kOutput:
        return AddNamedShape(field, kMostOutputs, model.outputs);
      case graph_field::kName:
      case graph_field::kDoc:
        return absl::OkStatus();
      default:
        return Unknown("the graph", field);
    }
  }));
  return !model.inputs.empty() && !model.outputs.empty() ? absl::OkStatus()
                                                         : Bad("it has no inputs, or no outputs");
}

absl::Status ReadOpset(std::string_view bytes) {
  uint64_t version = 0;
  std::string domain;
  WEFT_RETURN_IF_ERROR(VisitFields(bytes, [&](const WireField& field) -> absl::Status {
    if (field.number == opset_field::kVersion && field.kind == Kind::kNumber) version = field.value;
    if (field.number == opset_field::kDomain) return ReadName(field, domain);
    return field.number == opset_field::kVersion ? absl::OkStatus() : Unknown("an opset", field);
  }));
  if (domain.empty() && version >= kOldestOpset && version <= kNewestOpset) return absl::OkStatus();
  return Bad(absl::StrCat("opset ", version, domain.empty() ? "" : " of domain ", domain, ", expected ",
                          kOldestOpset, " to ", kNewestOpset));
}

}  // namespace

absl::StatusOr<NetModel> ReadNetFields(std::string_view onnx) {
  NetModel model;
  int graphs = 0, opsets = 0;
  WEFT_RETURN_IF_ERROR(VisitFields(onnx, [&](const WireField& field) -> absl::Status {
    switch (field.number) {
      case model_field::kGraph:
        if (field.kind != Kind::kBytes || ++graphs > 1) return Bad("it has two graphs");
        return ReadGraph(field.bytes, model);
      case model_field::kOpset:
        if (field.kind != Kind::kBytes || ++opsets > 1) return Bad("it has two opsets");
        return ReadOpset(field.bytes);
      case model_field::kIrVersion:
      case model_field::kProducer:
      case model_field::kProducerVersion:
      case model_field::kDomain:
      case model_field::kVersion:
      case model_field::kDoc:
        return absl::OkStatus();  // words; the opset says what the file means
      default:
        return Unknown("the model", field);
    }
  }));
  if (graphs == 0 || opsets == 0) return Bad("it has no graph, or no opset");
  return model;
}

}  // namespace weft
