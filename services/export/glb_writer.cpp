// Binary glTF 2.0: the first frame as the mesh, a morph target for each other frame, and an animation of
// their weights. The JSON part comes first in the file and is known last; room for it is left at the
// beginning.
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "services/export/sequence_writer.h"
#include "services/export/split_vertices.h"

namespace weft {
namespace {

constexpr uint64_t kMaxGlbBytes = std::numeric_limits<uint32_t>::max();
constexpr size_t kChunkHeader = 8, kGlbHeader = 12;
constexpr double kLongestDouble = -1.2345678901234567e-300;
// What tinygltf makes of a buffer whose bytes it does not hold.
constexpr char kEmptyBuffer[] = R"({"byteLength":0,"uri":"data:application/octet-stream;base64,"})";

void AppendWord(std::string& bytes, uint64_t value) {
  const auto word = static_cast<uint32_t>(value);
  bytes.append(reinterpret_cast<const char*>(&word), sizeof word);
}

// Collects the views and accessors of the binary part, one after another.
class GltfLayout {
 public:
  // The number of the accessor. `bounds`: least and greatest value of each component, or empty.
  int Add(int type, int component, size_t count, int target, std::vector<double> least = {},
          std::vector<double> greatest = {}) {
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = bytes_;
    view.byteLength = count * static_cast<size_t>(tinygltf::GetComponentSizeInBytes(component)) *
                      static_cast<size_t>(tinygltf::GetNumComponentsInType(type));
    view.target = target;
    tinygltf::Accessor accessor;
    accessor.bufferView = static_cast<int>(model.bufferViews.size());
    accessor.componentType = component;
    accessor.count = count;
    accessor.type = type;
    accessor.minValues = std::move(least);
    accessor.maxValues = std::move(greatest);
    bytes_ += view.byteLength;
    model.bufferViews.push_back(std::move(view));
    model.accessors.push_back(std::move(accessor));
    return static_cast<int>(model.accessors.size()) - 1;
  }
  uint64_t bytes() const { return bytes_; }

  tinygltf::Model model;

 private:
  uint64_t bytes_ = 0;
};

class GlbWriter : public SequenceWriter {
 public:
  explicit GlbWriter(const ExportPlan& plan)
      : plan_(plan),
        split_(
            SplitAtSeams(plan.source.topology().vertices, plan.source.topology().faces,
                         plan.Has(ExportAttribute::kUv) ? plan.source.topology().texture : MeshTexture{})) {
    const auto longest = Eigen::Vector3d::Constant(kLongestDouble);
    const std::vector<Bounds> widest(plan.samples.size(), Bounds{longest, longest});
    const GltfLayout layout = Layout(widest);
    binary_bytes_ = layout.bytes();
    json_bytes_ = (Json(layout).size() + 3) / 4 * 4;
  }

  absl::Status Begin(ExportStream& out) override {
    if (MaxFileBytes() > kMaxGlbBytes) {
      return absl::InvalidArgumentError(
          absl::StrCat("--format: a glb holds up to ", kMaxGlbBytes, " bytes, these ", plan_.samples.size(),
                       " frames need ", MaxFileBytes(), "; export fewer of them (--frames), or as usda"));
    }
    out.Append(std::string(kGlbHeader + kChunkHeader + json_bytes_, ' '));
    std::string chunk;
    AppendWord(chunk, binary_bytes_);
    chunk += std::string("BIN\0", 4);
    out.Append(chunk);
    for (const Face& face : split_.faces) out.AppendValues(face.data(), face.size());
    for (const Eigen::Vector2f& uv : split_.uv) {
      const std::array<float, 2> down = {uv.x(), 1 - uv.y()};  // glTF's v points downwards
      out.AppendValues(down.data(), down.size());
    }
    if (HasCopies())
      for (const int vertex : split_.origin) Append(static_cast<float>(vertex), out);
    if (plan_.Has(ExportAttribute::kCoverage))
      for (const int vertex : split_.origin) Append(plan_.source.topology().coverage[vertex], out);
    if (!IsAnimated()) return out.status();
    for (const ExportSample& sample : plan_.samples) Append(static_cast<float>(sample.time_s), out);
    const size_t targets = plan_.samples.size() - 1;
    for (size_t sample = 0; sample <= targets; ++sample) {
      std::vector<float> weights(targets);
      if (sample > 0) weights[sample - 1] = 1;
      out.AppendValues(weights.data(), weights.size());
    }
    return out.status();
  }

  absl::Status Add(int, size_t sample, const ExportMesh& mesh, ExportStream& out) override {
    if (sample == 0) {
      base_ = mesh.positions;
    }
    Bounds& bounds = bounds_.emplace_back();
    std::vector<Eigen::Vector3f> values;
    values.reserve(split_.origin.size());
    for (const int vertex : split_.origin) {
      values.push_back(sample == 0 ? base_[vertex] : Eigen::Vector3f(mesh.positions[vertex] - base_[vertex]));
      bounds.extend(values.back().cast<double>());
    }
    out.AppendValues(values.data(), values.size());
    return out.status();
  }

  absl::Status Finish(ExportStream& out) override {
    std::string json = Json(Layout(bounds_));
    if (json.size() > json_bytes_ || out.size() != FileBytes())
      return absl::InternalError(absl::StrCat("glb: ", json.size(), " bytes of JSON in ", json_bytes_, ", ",
                                              out.size(), " bytes instead of ", FileBytes()));
    json.resize(json_bytes_, ' ');
    std::string head = "glTF";
    AppendWord(head, 2);
    AppendWord(head, out.size());
    AppendWord(head, json_bytes_);
    head += "JSON";
    out.Overwrite(0, head + json);
    return out.status();
  }

  std::vector<double> State() const override {
    std::vector<double> state;
    for (const Bounds& bounds : bounds_) {
      state.insert(state.end(), bounds.min().begin(), bounds.min().end());
      state.insert(state.end(), bounds.max().begin(), bounds.max().end());
    }
    return state;
  }
  absl::Status Restore(const std::vector<double>& state) override {
    constexpr size_t kBoundNumbers = 6;
    if (state.empty() || state.size() % kBoundNumbers != 0)
      return absl::DataLossError("the bounds of the morph targets are incomplete");
    bounds_.clear();
    for (size_t i = 0; i < state.size(); i += kBoundNumbers)
      bounds_.emplace_back(Eigen::Vector3d(&state[i]), Eigen::Vector3d(&state[i + 3]));
    absl::StatusOr<ExportMesh> first =
        plan_.source.Read(plan_.samples.front().mesh, ExportSource::Velocities::kLeftOut);
    if (!first.ok()) return first.status();
    base_ = std::move(first->positions);
    return absl::OkStatus();
  }

  uint64_t MaxFileBytes() const override { return FileBytes(); }
  size_t VerticesInFile(const ExportPlan&) const override { return split_.origin.size(); }

 private:
  using Bounds = Eigen::AlignedBox3d;

  bool IsAnimated() const { return plan_.samples.size() > 1; }
  bool HasCopies() const { return split_.origin.size() > plan_.source.topology().vertices; }
  uint64_t FileBytes() const { return kGlbHeader + 2 * kChunkHeader + json_bytes_ + binary_bytes_; }

  static void Append(float value, ExportStream& out) { out.AppendValues(&value, 1); }

  static std::vector<double> Numbers(const Eigen::Vector3d& vector) { return {vector.begin(), vector.end()}; }

  // `bounds` [samples]. The order is that in which Begin and Add write.
  GltfLayout Layout(const std::vector<Bounds>& bounds) const {
    GltfLayout layout;
    const size_t vertices = split_.origin.size();
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.material = 0;
    primitive.indices = layout.Add(TINYGLTF_TYPE_SCALAR, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                                   3 * split_.faces.size(), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    const auto add_attribute = [&](const char* name, int type) {
      primitive.attributes[name] =
          layout.Add(type, TINYGLTF_COMPONENT_TYPE_FLOAT, vertices, TINYGLTF_TARGET_ARRAY_BUFFER);
    };
    if (!split_.uv.empty()) add_attribute("TEXCOORD_0", TINYGLTF_TYPE_VEC2);
    if (HasCopies()) add_attribute("_VERTEX", TINYGLTF_TYPE_SCALAR);
    if (plan_.Has(ExportAttribute::kCoverage)) add_attribute("_COVERAGE", TINYGLTF_TYPE_SCALAR);
    if (IsAnimated()) AddAnimation(layout);
    for (size_t sample = 0; sample < bounds.size(); ++sample) {
      const int positions = layout.Add(TINYGLTF_TYPE_VEC3, TINYGLTF_COMPONENT_TYPE_FLOAT, vertices,
                                       TINYGLTF_TARGET_ARRAY_BUFFER, Numbers(bounds[sample].min()),
                                       Numbers(bounds[sample].max()));
      if (sample == 0) {
        primitive.attributes["POSITION"] = positions;
      } else {
        primitive.targets.push_back({{"POSITION", positions}});
      }
    }
    AddScene(std::move(primitive), layout.model);
    return layout;
  }

  void AddAnimation(GltfLayout& layout) const {
    const size_t keys = plan_.samples.size();
    tinygltf::AnimationSampler sampler;
    sampler.interpolation = "LINEAR";
    sampler.input = layout.Add(TINYGLTF_TYPE_SCALAR, TINYGLTF_COMPONENT_TYPE_FLOAT, keys, 0,
                               {static_cast<float>(plan_.samples.front().time_s)},
                               {static_cast<float>(plan_.samples.back().time_s)});
    sampler.output = layout.Add(TINYGLTF_TYPE_SCALAR, TINYGLTF_COMPONENT_TYPE_FLOAT, keys * (keys - 1), 0);
    tinygltf::AnimationChannel channel;
    channel.sampler = 0;
    channel.target_node = 0;
    channel.target_path = "weights";
    tinygltf::Animation animation;
    animation.name = "capture";
    animation.samplers.push_back(std::move(sampler));
    animation.channels.push_back(std::move(channel));
    layout.model.animations.push_back(std::move(animation));
  }

  void AddScene(tinygltf::Primitive primitive, tinygltf::Model& model) const {
    model.asset.generator = absl::StrCat("Weft ", WEFT_VERSION);
    tinygltf::Material cloth;
    cloth.name = "cloth";
    cloth.doubleSided = true;
    cloth.pbrMetallicRoughness.metallicFactor = 0;
    cloth.pbrMetallicRoughness.roughnessFactor = 0.9;
    model.materials.push_back(std::move(cloth));
    tinygltf::Mesh mesh;
    mesh.name = "garment";
    mesh.primitives.push_back(std::move(primitive));
    if (IsAnimated()) {
      mesh.weights.assign(plan_.samples.size() - 1, 0);
      tinygltf::Value::Array names;
      for (size_t sample = 1; sample < plan_.samples.size(); ++sample)
        names.emplace_back(plan_.samples[sample].frame);
      tinygltf::Value::Object extras;
      extras["targetNames"] = tinygltf::Value(std::move(names));
      mesh.extras = tinygltf::Value(std::move(extras));
    }
    model.meshes.push_back(std::move(mesh));
    tinygltf::Node node;
    node.name = "garment";
    node.mesh = 0;
    model.nodes.push_back(std::move(node));
    tinygltf::Scene scene;
    scene.nodes = {0};
    model.scenes.push_back(std::move(scene));
    model.defaultScene = 0;
    model.buffers.emplace_back();
  }

  std::string Json(const GltfLayout& layout) const {
    std::ostringstream text;
    tinygltf::TinyGLTF().WriteGltfSceneToStream(&layout.model, text, false, false);
    const std::string real = absl::StrCat("{\"byteLength\":", layout.bytes(), "}");
    std::string json = absl::StrReplaceAll(text.str(), {{kEmptyBuffer, real}});
    while (!json.empty() && json.back() == '\n') json.pop_back();
    return json;
  }

  const ExportPlan& plan_;
  SplitMesh split_;
  uint64_t binary_bytes_ = 0, json_bytes_ = 0;
  std::vector<Eigen::Vector3f> base_;  // of the first sample
  std::vector<Bounds> bounds_;         // [samples so far]
};

}  // namespace

std::unique_ptr<SequenceWriter> MakeGlbWriter(const ExportPlan& plan) {
  return std::make_unique<GlbWriter>(plan);
}

}  // namespace weft
