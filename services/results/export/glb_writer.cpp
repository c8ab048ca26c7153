// Binary glTF 2.0: the first frame as the mesh, a morph target for each other frame, and an animation of
// their weights. The JSON part comes first in the file and is known last; room for it is left at the
// beginning.
#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/vertex_normals.h"
#include "base/status_macros.h"
#include "services/results/export/garment_texture.h"
#include "services/results/export/gltf_layout.h"
#include "services/results/export/sequence_writer.h"
#include "services/results/export/split_vertices.h"

namespace weft {
namespace {

constexpr uint64_t kMaxGlbBytes = std::numeric_limits<uint32_t>::max();
constexpr size_t kChunkHeader = 8, kGlbHeader = 12;
constexpr double kLongestDouble = -1.2345678901234567e-300;

void AppendWord(std::string& bytes, uint64_t value) {
  const auto word = static_cast<uint32_t>(value);
  bytes.append(reinterpret_cast<const char*>(&word), sizeof word);
}

class GlbWriter : public SequenceWriter {
 public:
  explicit GlbWriter(const ExportPlan& plan)
      : plan_(plan),
        storage_(plan.meshopt ? GltfStorage::kMeshopt : GltfStorage::kPlain),
        split_(
            SplitAtSeams(plan.source.topology().vertices, plan.source.topology().faces,
                         plan.Has(ExportAttribute::kUv) ? plan.source.topology().texture : MeshTexture{})) {
    const auto longest = Eigen::Vector3d::Constant(kLongestDouble);
    const std::vector<Bounds> widest(plan.samples.size(), Bounds{longest, longest});
    GltfLayout layout = Layout(widest);
    max_binary_bytes_ = layout.MaxStoredBytes();
    json_bytes_ = (layout.Json(kMaxGlbBytes).size() + 3) / 4 * 4;
  }

  absl::Status Begin(ExportStream& out) override {
    if (MaxFileBytes() > kMaxGlbBytes) {
      return absl::InvalidArgumentError(absl::StrCat(
          "--format: a glb holds up to ", kMaxGlbBytes, " bytes, these ", plan_.samples.size(),
          " frames need up to ", MaxFileBytes(), "; export fewer of them (--frames), or as usda"));
    }
    out.Append(std::string(HeadBytes(), ' '));
    for (const std::string& picture : {plan_.pictures.albedo_png, plan_.pictures.normal_png}) {
      out.Append(picture);
      out.Append(std::string((4 - picture.size() % 4) % 4, '\0'));
    }
    PutFaces(out);
    if (!split_.uv.empty()) {
      std::vector<std::array<float, 2>> down;  // glTF's v points downwards
      for (const Eigen::Vector2f& uv : split_.uv) down.push_back({uv.x(), 1 - uv.y()});
      Put(down, out);
    }
    std::vector<float> values;
    if (NamesVertices()) {
      values.clear();
      const std::optional<ReducedMesh>& reduced = plan_.source.reduced();
      for (const int vertex : split_.origin)
        values.push_back(static_cast<float>(reduced ? reduced->vertices[vertex] : vertex));
      Put(values, out);
    }
    for (const auto& [name, of_vertex] : StillAttributes()) {
      values.clear();
      for (const int vertex : split_.origin) values.push_back(of_vertex[vertex]);
      Put(values, out);
    }
    if (plan_.normal_map_px > 0) Put(plan_.pictures.tangents, out);
    if (!IsAnimated()) return out.status();
    values.clear();
    for (const ExportSample& sample : plan_.samples) values.push_back(static_cast<float>(sample.time_s));
    Put(values, out);
    PutWeights(out);
    return out.status();
  }

  absl::Status Add(int, size_t sample, const ExportMesh& mesh, ExportStream& out) override {
    if (sample == 0) KeepBase(mesh);
    std::vector<float> values = Differences(sample, mesh.positions, base_);
    PutVectors(sample, values, out);
    Bounds& bounds = bounds_.emplace_back();
    for (size_t i = 0; i < values.size(); i += 3) bounds.extend(Eigen::Vector3f(&values[i]).cast<double>());
    if (plan_.Has(ExportAttribute::kNormal)) {
      values = Differences(sample, NormalsOf(mesh), base_normals_);
      PutVectors(sample, values, out);
    }
    return out.status();
  }

  absl::Status Finish(ExportStream& out) override {
    const uint64_t binary_bytes = out.size() - HeadBytes();
    GltfLayout layout = Layout(bounds_);
    std::string json = layout.Json(binary_bytes);
    if (json.size() > json_bytes_ ||
        (storage_ == GltfStorage::kPlain && binary_bytes != layout.plain_bytes()))
      return absl::InternalError(absl::StrCat("glb: ", json.size(), " bytes of JSON in ", json_bytes_, ", ",
                                              binary_bytes, " binary ones instead of ",
                                              layout.plain_bytes()));
    json.resize(json_bytes_, ' ');
    std::string head = "glTF";
    AppendWord(head, 2);
    AppendWord(head, out.size());
    AppendWord(head, json_bytes_);
    head += "JSON" + json;
    AppendWord(head, binary_bytes);
    head += std::string("BIN\0", 4);
    out.Overwrite(0, head);
    return out.status();
  }

  // The number of compressed blocks, their sizes, and six numbers for the bounds of each sample.
  std::vector<double> State() const override {
    std::vector<double> state = {static_cast<double>(block_bytes_.size())};
    state.insert(state.end(), block_bytes_.begin(), block_bytes_.end());
    for (const Bounds& bounds : bounds_) {
      state.insert(state.end(), bounds.min().begin(), bounds.min().end());
      state.insert(state.end(), bounds.max().begin(), bounds.max().end());
    }
    return state;
  }
  absl::Status Restore(const std::vector<double>& state) override {
    constexpr size_t kBoundNumbers = 6;
    const size_t blocks = state.empty() ? 0 : static_cast<size_t>(state.front());
    if (state.size() <= blocks + 1 || (state.size() - blocks - 1) % kBoundNumbers != 0)
      return absl::DataLossError("the bounds of the morph targets are incomplete");
    block_bytes_.clear();
    for (size_t i = 1; i <= blocks; ++i) block_bytes_.push_back(static_cast<uint64_t>(state[i]));
    bounds_.clear();
    for (size_t i = blocks + 1; i < state.size(); i += kBoundNumbers)
      bounds_.emplace_back(Eigen::Vector3d(&state[i]), Eigen::Vector3d(&state[i + 3]));
    WEFT_ASSIGN_OR_RETURN(ExportMesh first,
                          plan_.source.Read(plan_.samples.front().mesh, ExportSource::Velocities::kLeftOut));
    KeepBase(first);
    return absl::OkStatus();
  }

  uint64_t MaxFileBytes() const override { return HeadBytes() + max_binary_bytes_; }
  size_t VerticesInFile(const ExportPlan&) const override { return split_.origin.size(); }

 private:
  using Bounds = Eigen::AlignedBox3d;

  bool IsAnimated() const { return plan_.samples.size() > 1; }
  bool NamesVertices() const {
    return split_.origin.size() > plan_.source.topology().vertices || plan_.source.reduced();
  }
  // All before the first binary value.
  uint64_t HeadBytes() const { return kGlbHeader + 2 * kChunkHeader + json_bytes_; }

  void PutBlock(const std::string& block, ExportStream& out) {
    out.Append(block);
    out.Append(std::string((4 - block.size() % 4) % 4, '\0'));
    block_bytes_.push_back(block.size());
  }
  void KeepBase(const ExportMesh& mesh) {
    base_ = mesh.positions;
    if (plan_.Has(ExportAttribute::kNormal)) base_normals_ = NormalsOf(mesh);
  }
  std::vector<Eigen::Vector3f> NormalsOf(const ExportMesh& mesh) const {
    std::vector<Eigen::Vector3d> positions;
    for (const Eigen::Vector3f& position : mesh.positions) positions.push_back(position.cast<double>());
    std::vector<Eigen::Vector3f> normals;
    for (const Eigen::Vector3d& normal : VertexNormals(positions, plan_.source.topology().faces))
      // Vertices without a face have none, and glTF wants one.
      normals.emplace_back(normal.norm() > 0 ? Eigen::Vector3f(normal.normalized().cast<float>())
                                             : Eigen::Vector3f(0, 1, 0));
    return normals;
  }
  // Of the first sample `now` itself, else its difference to `base`; of the file's vertices.
  std::vector<float> Differences(size_t sample, const std::vector<Eigen::Vector3f>& now,
                                 const std::vector<Eigen::Vector3f>& base) const {
    std::vector<float> values;
    values.reserve(3 * split_.origin.size());
    for (const int vertex : split_.origin) {
      const Eigen::Vector3f value = sample == 0 ? now[vertex] : Eigen::Vector3f(now[vertex] - base[vertex]);
      values.insert(values.end(), value.begin(), value.end());
    }
    return values;
  }
  // With meshopt `values` become what readers decode.
  void PutVectors(size_t sample, std::vector<float>& values, ExportStream& out) {
    constexpr size_t kStride = 3 * sizeof(float);
    if (storage_ == GltfStorage::kPlain) {
      out.AppendValues(values.data(), values.size());
    } else if (sample == 0) {
      PutBlock(CompressValues(values.data(), values.size() / 3, kStride), out);
    } else {
      const std::vector<uint32_t> filtered = RoundForMeshopt(values);
      PutBlock(CompressValues(filtered.data(), filtered.size() / 3, kStride), out);
    }
  }
  template <typename Value>
  void Put(const std::vector<Value>& values, ExportStream& out) {
    if (storage_ == GltfStorage::kPlain) {
      out.AppendValues(values.data(), values.size());
    } else {
      PutBlock(CompressValues(values.data(), values.size(), sizeof(Value)), out);
    }
  }
  void PutFaces(ExportStream& out) {
    std::vector<uint32_t> indices;
    for (const Face& face : split_.faces) indices.insert(indices.end(), face.begin(), face.end());
    if (storage_ == GltfStorage::kPlain) {
      out.AppendValues(indices.data(), indices.size());
    } else {
      PutBlock(CompressIndices(indices, split_.origin.size()), out);
    }
  }
  // What glTF cannot animate: attributes of its readers are those of the mesh, not of its targets. [vertices]
  std::vector<std::pair<const char*, std::vector<float>>> StillAttributes() const {
    const ExportTopology& topology = plan_.source.topology();
    std::vector<std::pair<const char*, std::vector<float>>> still;
    if (plan_.Has(ExportAttribute::kState))
      still.emplace_back("_STATE",
                         std::vector<float>(topology.usual_state.begin(), topology.usual_state.end()));
    if (plan_.Has(ExportAttribute::kSigma)) still.emplace_back("_SIGMA_MM", topology.mean_sigma_mm);
    if (plan_.Has(ExportAttribute::kCoverage)) still.emplace_back("_COVERAGE", topology.coverage);
    return still;
  }
  // A key per sample, at which its own target has the weight 1.
  void PutWeights(ExportStream& out) {
    const size_t targets = plan_.samples.size() - 1;
    std::vector<float> all;
    for (size_t sample = 0; sample <= targets; ++sample) {
      std::vector<float> weights(targets);
      if (sample > 0) weights[sample - 1] = 1;
      if (storage_ == GltfStorage::kPlain) {
        out.AppendValues(weights.data(), weights.size());
      } else {
        all.insert(all.end(), weights.begin(), weights.end());
      }
    }
    if (storage_ == GltfStorage::kMeshopt) Put(all, out);
  }

  static std::vector<double> Numbers(const Eigen::Vector3d& vector) { return {vector.begin(), vector.end()}; }

  // `bounds` [samples]. The order is that in which Begin and Add write.
  GltfLayout Layout(const std::vector<Bounds>& bounds) const {
    GltfLayout layout(storage_, block_bytes_);
    const size_t vertices = split_.origin.size();
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.material = 0;
    tinygltf::Material cloth = Cloth(layout);
    primitive.indices = layout.Add({.component = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                                    .count = 3 * split_.faces.size(),
                                    .target = TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER});
    const auto add_attribute = [&](const char* name, int type) {
      primitive.attributes[name] =
          layout.Add({.type = type, .count = vertices, .target = TINYGLTF_TARGET_ARRAY_BUFFER});
    };
    if (!split_.uv.empty()) add_attribute("TEXCOORD_0", TINYGLTF_TYPE_VEC2);
    if (NamesVertices()) add_attribute("_VERTEX", TINYGLTF_TYPE_SCALAR);
    for (const auto& [name, of_vertex] : StillAttributes()) add_attribute(name, TINYGLTF_TYPE_SCALAR);
    if (plan_.normal_map_px > 0) add_attribute("TANGENT", TINYGLTF_TYPE_VEC4);
    if (IsAnimated()) AddAnimation(layout);
    for (size_t sample = 0; sample < bounds.size(); ++sample) {
      const int positions = layout.Add({.type = TINYGLTF_TYPE_VEC3,
                                        .count = vertices,
                                        .target = TINYGLTF_TARGET_ARRAY_BUFFER,
                                        .is_rounded = sample > 0,
                                        .least = Numbers(bounds[sample].min()),
                                        .greatest = Numbers(bounds[sample].max())});
      std::map<std::string, int> of_sample = {{"POSITION", positions}};
      if (plan_.Has(ExportAttribute::kNormal))
        of_sample["NORMAL"] = layout.Add({.type = TINYGLTF_TYPE_VEC3,
                                          .count = vertices,
                                          .target = TINYGLTF_TARGET_ARRAY_BUFFER,
                                          .is_rounded = sample > 0});
      if (sample == 0) {
        primitive.attributes.merge(of_sample);
      } else {
        primitive.targets.push_back(std::move(of_sample));
      }
    }
    layout.model.materials.push_back(std::move(cloth));
    AddScene(std::move(primitive), layout.model);
    return layout;
  }

  tinygltf::Material Cloth(GltfLayout& layout) const {
    tinygltf::Material cloth;
    cloth.name = "cloth";
    cloth.doubleSided = true;
    cloth.pbrMetallicRoughness.metallicFactor = 0;
    cloth.pbrMetallicRoughness.roughnessFactor = 0.9;
    const GlbPictures& pictures = plan_.pictures;
    if (plan_.texture_px > 0)
      cloth.pbrMetallicRoughness.baseColorTexture.index =
          AddTexture("albedo", pictures.albedo_png, plan_.texture_px, layout);
    if (plan_.normal_map_px > 0)
      cloth.normalTexture.index = AddTexture("normal", pictures.normal_png, plan_.normal_map_px, layout);
    return cloth;
  }

  // The number of the texture. Where there is no picture yet, of one as large as it may become.
  static int AddTexture(const char* name, const std::string& png, int size_px, GltfLayout& layout) {
    tinygltf::Model& model = layout.model;
    if (model.samplers.empty()) {
      tinygltf::Sampler& sampler = model.samplers.emplace_back();
      sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
      sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
      sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    }
    tinygltf::Texture& texture = model.textures.emplace_back();
    texture.sampler = 0;
    texture.source = layout.AddPicture(name, png.empty() ? MaxPngBytes(size_px) : png.size());
    return static_cast<int>(model.textures.size()) - 1;
  }

  void AddAnimation(GltfLayout& layout) const {
    const size_t keys = plan_.samples.size();
    tinygltf::AnimationSampler sampler;
    sampler.interpolation = "LINEAR";
    sampler.input = layout.Add({.count = keys,
                                .least = {static_cast<float>(plan_.samples.front().time_s)},
                                .greatest = {static_cast<float>(plan_.samples.back().time_s)}});
    sampler.output = layout.Add({.count = keys * (keys - 1)});
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
  }

  const ExportPlan& plan_;
  GltfStorage storage_;
  SplitMesh split_;
  uint64_t max_binary_bytes_ = 0, json_bytes_ = 0;
  std::vector<uint64_t> block_bytes_;                 // with meshopt, of the views so far
  std::vector<Eigen::Vector3f> base_, base_normals_;  // of the first sample
  std::vector<Bounds> bounds_;                        // [samples so far]
};

}  // namespace

std::unique_ptr<SequenceWriter> MakeGlbWriter(const ExportPlan& plan) {
  return std::make_unique<GlbWriter>(plan);
}

}  // namespace weft
