// Binary glTF, read back by tinygltf.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <array>

#include "tests/services/results/export/small_result.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class GlbWriterTest : public ::testing::Test {
 protected:
  // The file of these attributes, read back.
  tinygltf::Model Read(const std::vector<ExportAttribute>& attributes) {
    result_.request.unit = LengthUnit::kMetre;
    auto source = result_.Source();
    EXPECT_TRUE(source.ok()) << source.status();
    const ExportPlan plan = PlanOf(*source, ExportFormat::kGlb, attributes);
    const auto writer = MakeGlbWriter(plan);
    const std::string bytes = Written(*writer, plan, result_.folder / "garment.glb");
    EXPECT_LE(bytes.size(), writer->MaxFileBytes());
    tinygltf::Model model;
    tinygltf::TinyGLTF reader;
    std::string errors, warnings;
    EXPECT_TRUE(reader.LoadBinaryFromMemory(&model, &errors, &warnings,
                                            reinterpret_cast<const unsigned char*>(bytes.data()),
                                            static_cast<unsigned>(bytes.size())))
        << errors;
    return model;
  }
  // All floats of an accessor.
  static std::vector<float> FloatsOf(const tinygltf::Model& model, int number) {
    const tinygltf::Accessor& accessor = model.accessors.at(static_cast<size_t>(number));
    EXPECT_EQ(accessor.componentType, TINYGLTF_COMPONENT_TYPE_FLOAT);
    const tinygltf::BufferView& view = model.bufferViews.at(static_cast<size_t>(accessor.bufferView));
    const std::vector<unsigned char>& bytes = model.buffers.at(static_cast<size_t>(view.buffer)).data;
    const auto* first = reinterpret_cast<const float*>(bytes.data() + view.byteOffset + accessor.byteOffset);
    return {first, first + accessor.count * static_cast<size_t>(tinygltf::GetNumComponentsInType(
                                                static_cast<uint32_t>(accessor.type)))};
  }

  SmallResult result_;
};

TEST_F(GlbWriterTest, TheFirstFrameIsTheMeshAndOthersAreWhatIsAddedToIt) {
  const tinygltf::Model model = Read({});
  ASSERT_EQ(model.meshes.size(), 1u);
  const tinygltf::Primitive& primitive = model.meshes[0].primitives.at(0);
  EXPECT_THAT(FloatsOf(model, primitive.attributes.at("POSITION")),
              ElementsAre(0, 0, 0, 0.1F, 0, 0, 0.1F, 0.05F, 0, 0, 0.05F, 0));
  ASSERT_EQ(primitive.targets.size(), 2u);
  EXPECT_THAT(FloatsOf(model, primitive.targets[0].at("POSITION")),
              ElementsAre(0, 0, 0.01F, 0, 0, 0.01F, 0, 0, 0.01F, 0, 0, 0.01F));
  EXPECT_THAT(FloatsOf(model, primitive.targets[1].at("POSITION")),
              ElementsAre(0, 0, 0.02F, 0, 0, 0.02F, 0, 0, 0.02F, 0, 0, 0.02F));
  EXPECT_THAT(model.meshes[0].weights, ElementsAre(0, 0));
  const tinygltf::Value& names = model.meshes[0].extras.Get("targetNames");
  EXPECT_EQ(names.Get(0).Get<std::string>(), "0001");
  EXPECT_EQ(names.Get(1).Get<std::string>(), "0002");
}

TEST_F(GlbWriterTest, BoundsOfPositionsAreThoseOfTheMesh) {
  const tinygltf::Model model = Read({});
  const tinygltf::Accessor& positions =
      model.accessors.at(static_cast<size_t>(model.meshes[0].primitives[0].attributes.at("POSITION")));
  EXPECT_THAT(positions.minValues, ElementsAre(0, 0, 0));
  ASSERT_EQ(positions.maxValues.size(), 3u);
  EXPECT_FLOAT_EQ(static_cast<float>(positions.maxValues[0]), 0.1F);
  EXPECT_FLOAT_EQ(static_cast<float>(positions.maxValues[1]), 0.05F);
  EXPECT_EQ(positions.maxValues[2], 0);
}

TEST_F(GlbWriterTest, EachKeyOfTheAnimationShowsItsFrameAlone) {
  const tinygltf::Model model = Read({});
  ASSERT_EQ(model.animations.size(), 1u);
  const tinygltf::Animation& animation = model.animations[0];
  EXPECT_EQ(animation.channels.at(0).target_path, "weights");
  EXPECT_THAT(FloatsOf(model, animation.samplers.at(0).input), ElementsAre(0, 0.1F, 0.2F));
  EXPECT_THAT(FloatsOf(model, animation.samplers.at(0).output), ElementsAre(0, 0, 1, 0, 0, 1));
}

// glTF's v points downwards, ours upwards.
TEST_F(GlbWriterTest, PlacesAreTurnedDownwards) {
  const tinygltf::Model model = Read({ExportAttribute::kUv});
  const tinygltf::Primitive& primitive = model.meshes.at(0).primitives.at(0);
  EXPECT_THAT(FloatsOf(model, primitive.attributes.at("TEXCOORD_0")),
              ElementsAre(0, 1, 1, 1, 1, 0.5F, 0, 0.5F));
}

TEST_F(GlbWriterTest, NormalsPointOutOfTheFaces) {
  const tinygltf::Model model = Read({ExportAttribute::kNormal});
  const tinygltf::Primitive& primitive = model.meshes.at(0).primitives.at(0);
  // Faces turn counterclockwise seen from +z, and the square only moves: no target changes a normal.
  EXPECT_THAT(FloatsOf(model, primitive.attributes.at("NORMAL")),
              ElementsAre(0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1));
  EXPECT_THAT(FloatsOf(model, primitive.targets.at(0).at("NORMAL")), ::testing::Each(0.0F));
}

TEST_F(GlbWriterTest, AttributesThatCannotMoveAreThoseOfMostFrames) {
  const tinygltf::Model model =
      Read({ExportAttribute::kState, ExportAttribute::kSigma, ExportAttribute::kCoverage});
  const tinygltf::Primitive& primitive = model.meshes.at(0).primitives.at(0);
  EXPECT_THAT(FloatsOf(model, primitive.attributes.at("_STATE")), ElementsAre(0, 2, 1, 1));
  EXPECT_THAT(FloatsOf(model, primitive.attributes.at("_SIGMA_MM")), ElementsAre(1.5F, 0.5F, 0.25F, 0.25F));
  EXPECT_THAT(FloatsOf(model, primitive.attributes.at("_COVERAGE")), ElementsAre(0, 1, 1, 1));
}

TEST_F(GlbWriterTest, OneFrameHasNoAnimation) {
  result_.request.frames = "0001";
  const tinygltf::Model model = Read({});
  EXPECT_TRUE(model.animations.empty());
  EXPECT_TRUE(model.meshes.at(0).primitives.at(0).targets.empty());
  EXPECT_TRUE(model.meshes[0].weights.empty());
}

// The JSON of a file of all attributes with both pictures, without its spaces and the version.
std::string JsonWithPictures(SmallResult& result, bool meshopt) {
  result.request.unit = LengthUnit::kMetre, result.request.frames = "0000:0002";
  auto source = result.Source();
  EXPECT_TRUE(source.ok()) << source.status();
  ExportPlan plan = PlanOf(*source, ExportFormat::kGlb,
                           {ExportAttribute::kUv, ExportAttribute::kState, ExportAttribute::kSigma,
                            ExportAttribute::kCoverage, ExportAttribute::kNormal});
  plan.meshopt = meshopt;
  plan.texture_px = 2, plan.normal_map_px = 4;
  plan.pictures = {"albedo", "the normals", {4, Eigen::Vector4f(1, 0, 0, 1)}};
  const auto writer = MakeGlbWriter(plan);
  const std::string bytes = Written(*writer, plan, result.folder / "garment.glb");
  EXPECT_LE(bytes.size(), writer->MaxFileBytes());
  EXPECT_EQ(ValueAt<uint32_t>(bytes, 8), bytes.size());
  const auto json_bytes = ValueAt<uint32_t>(bytes, 12);
  EXPECT_EQ(bytes.substr(20 + json_bytes + 4, 4), std::string("BIN\0", 4));
  EXPECT_EQ(ValueAt<uint32_t>(bytes, 20 + json_bytes) + 28 + json_bytes, bytes.size());
  EXPECT_EQ(bytes.substr(28 + json_bytes, 20), std::string("albedo\0\0the normals\0", 20));
  std::string json = bytes.substr(20, json_bytes);
  std::erase(json, ' ');
  const std::string generator = "\"generator\":\"Weft";
  const size_t version = json.find(generator) + generator.size();
  EXPECT_GT(json.find('"', version), version) << "it has a version";
  return json.erase(version, json.find('"', version) - version);
}

std::string Packed(std::string json) {
  std::erase_if(json, [](char c) { return c == ' ' || c == '\n'; });
  return json;
}

TEST(GlbJson, NamesEveryPartOfTheFile) {
  SmallResult result;
  EXPECT_EQ(JsonWithPictures(result, false),
            Packed(R"json({"accessors":[{"bufferView":2,"componentType":5125,"count":6,"type":"SCALAR"},
{"bufferView":3,"componentType":5126,"count":4,"type":"VEC2"},
{"bufferView":4,"componentType":5126,"count":4,"type":"SCALAR"},
{"bufferView":5,"componentType":5126,"count":4,"type":"SCALAR"},
{"bufferView":6,"componentType":5126,"count":4,"type":"SCALAR"},
{"bufferView":7,"componentType":5126,"count":4,"type":"VEC4"},
{"bufferView":8,"componentType":5126,"count":2,"max":[0.10000000149011612],"min":[0.0],"type":"SCALAR"},
{"bufferView":9,"componentType":5126,"count":2,"type":"SCALAR"},
{"bufferView":10,"componentType":5126,"count":4,"max":[0.10000000149011612,0.05000000074505806,0.0],
"min":[0.0,0.0,0.0],"type":"VEC3"},
{"bufferView":11,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":12,"componentType":5126,"count":4,"max":[0.0,0.0,0.009999999776482582],"min":[0.0,0.0,
0.009999999776482582],"type":"VEC3"},
{"bufferView":13,"componentType":5126,"count":4,"type":"VEC3"}],"animations":[{"channels":[{"sampler":0,
"target":{"node":0,"path":"weights"}}],"name":"capture","samplers":[{"input":6,"interpolation":"LINEAR",
"output":7}]}],"asset":{"generator":"Weft","version":"2.0"},"bufferViews":[{"buffer":0,"byteLength":6},
{"buffer":0,"byteLength":11,"byteOffset":8},
{"buffer":0,"byteLength":24,"byteOffset":20,"target":34963},
{"buffer":0,"byteLength":32,"byteOffset":44,"target":34962},
{"buffer":0,"byteLength":16,"byteOffset":76,"target":34962},
{"buffer":0,"byteLength":16,"byteOffset":92,"target":34962},
{"buffer":0,"byteLength":16,"byteOffset":108,"target":34962},
{"buffer":0,"byteLength":64,"byteOffset":124,"target":34962},
{"buffer":0,"byteLength":8,"byteOffset":188},
{"buffer":0,"byteLength":8,"byteOffset":196},
{"buffer":0,"byteLength":48,"byteOffset":204,"target":34962},
{"buffer":0,"byteLength":48,"byteOffset":252,"target":34962},
{"buffer":0,"byteLength":48,"byteOffset":300,"target":34962},
{"buffer":0,"byteLength":48,"byteOffset":348,"target":34962}],"buffers":[{"byteLength":396}],
"images":[{"bufferView":0,"mimeType":"image/png","name":"albedo"},
{"bufferView":1,"mimeType":"image/png","name":"normal"}],"materials":[{"doubleSided":true,
"name":"cloth","normalTexture":{"index":1},"pbrMetallicRoughness":{"baseColorTexture":{"index":0},
"metallicFactor":0.0,"roughnessFactor":0.9}}],"meshes":[{"extras":{"targetNames":["0001"]},
"name":"garment","primitives":[{"attributes":{"NORMAL":9,"POSITION":8,"TANGENT":5,"TEXCOORD_0":1,
"_COVERAGE":4,"_SIGMA_MM":3,"_STATE":2},"indices":0,"material":0,"mode":4,"targets":[{"NORMAL":11,
"POSITION":10}]}],"weights":[0.0]}],"nodes":[{"mesh":0,"name":"garment"}],"samplers":[{"magFilter":9729,
"minFilter":9987,"wrapS":33071,"wrapT":33071}],"scene":0,"scenes":[{"nodes":[0]}],
"textures":[{"sampler":0,"source":0},
{"sampler":0,"source":1}]})json"));
}

TEST(GlbJson, WithMeshoptViewsSayHowTheyAreCompressed) {
  SmallResult result;
  EXPECT_EQ(JsonWithPictures(result, true),
            Packed(R"json({"accessors":[{"bufferView":2,"componentType":5125,"count":6,"type":"SCALAR"},
{"bufferView":3,"componentType":5126,"count":4,"type":"VEC2"},
{"bufferView":4,"componentType":5126,"count":4,"type":"SCALAR"},
{"bufferView":5,"componentType":5126,"count":4,"type":"SCALAR"},
{"bufferView":6,"componentType":5126,"count":4,"type":"SCALAR"},
{"bufferView":7,"componentType":5126,"count":4,"type":"VEC4"},
{"bufferView":8,"componentType":5126,"count":2,"max":[0.10000000149011612],"min":[0.0],"type":"SCALAR"},
{"bufferView":9,"componentType":5126,"count":2,"type":"SCALAR"},
{"bufferView":10,"componentType":5126,"count":4,"max":[0.10000000149011612,0.05000000074505806,0.0],
"min":[0.0,0.0,0.0],"type":"VEC3"},
{"bufferView":11,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":12,"componentType":5126,"count":4,"max":[0.0,0.0,0.0099945068359375],"min":[0.0,0.0,
0.0099945068359375],"type":"VEC3"},
{"bufferView":13,"componentType":5126,"count":4,"type":"VEC3"}],"animations":[{"channels":[{"sampler":0,
"target":{"node":0,"path":"weights"}}],"name":"capture","samplers":[{"input":6,"interpolation":"LINEAR",
"output":7}]}],"asset":{"generator":"Weft","version":"2.0"},"bufferViews":[{"buffer":0,"byteLength":6},
{"buffer":0,"byteLength":11,"byteOffset":8},
{"buffer":1,"byteLength":24,"extensions":{"EXT_meshopt_compression":{"buffer":0,"byteLength":19,
"byteOffset":20,"byteStride":4,"count":6,"mode":"TRIANGLES"}},"target":34963},
{"buffer":1,"byteLength":32,"byteOffset":24,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":58,"byteOffset":40,"byteStride":8,"count":4,"mode":"ATTRIBUTES"}},"target":34962},
{"buffer":1,"byteLength":16,"byteOffset":56,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":47,"byteOffset":100,"byteStride":4,"count":4,"mode":"ATTRIBUTES"}},"target":34962},
{"buffer":1,"byteLength":16,"byteOffset":72,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":47,"byteOffset":148,"byteStride":4,"count":4,"mode":"ATTRIBUTES"}},"target":34962},
{"buffer":1,"byteLength":16,"byteOffset":88,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":47,"byteOffset":196,"byteStride":4,"count":4,"mode":"ATTRIBUTES"}},"target":34962},
{"buffer":1,"byteLength":64,"byteOffset":104,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":49,"byteOffset":244,"byteStride":16,"count":4,"mode":"ATTRIBUTES"}},"target":34962},
{"buffer":1,"byteLength":8,"byteOffset":168,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":57,"byteOffset":296,"byteStride":4,"count":2,"mode":"ATTRIBUTES"}}},
{"buffer":1,"byteLength":8,"byteOffset":176,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":47,"byteOffset":356,"byteStride":4,"count":2,"mode":"ATTRIBUTES"}}},
{"buffer":1,"byteLength":48,"byteOffset":184,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":89,"byteOffset":404,"byteStride":12,"count":4,"mode":"ATTRIBUTES"}},"target":34962},
{"buffer":1,"byteLength":48,"byteOffset":232,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":45,"byteOffset":496,"byteStride":12,"count":4,"mode":"ATTRIBUTES"}},"target":34962},
{"buffer":1,"byteLength":48,"byteOffset":280,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":45,"byteOffset":544,"byteStride":12,"count":4,"filter":"EXPONENTIAL","mode":"ATTRIBUTES"}},
"target":34962},
{"buffer":1,"byteLength":48,"byteOffset":328,"extensions":{"EXT_meshopt_compression":{"buffer":0,
"byteLength":45,"byteOffset":592,"byteStride":12,"count":4,"filter":"EXPONENTIAL","mode":"ATTRIBUTES"}},
"target":34962}],"buffers":[{"byteLength":640},
{"byteLength":376,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}],
"extensionsRequired":["EXT_meshopt_compression"],"extensionsUsed":["EXT_meshopt_compression"],
"images":[{"bufferView":0,"mimeType":"image/png","name":"albedo"},
{"bufferView":1,"mimeType":"image/png","name":"normal"}],"materials":[{"doubleSided":true,
"name":"cloth","normalTexture":{"index":1},"pbrMetallicRoughness":{"baseColorTexture":{"index":0},
"metallicFactor":0.0,"roughnessFactor":0.9}}],"meshes":[{"extras":{"targetNames":["0001"]},
"name":"garment","primitives":[{"attributes":{"NORMAL":9,"POSITION":8,"TANGENT":5,"TEXCOORD_0":1,
"_COVERAGE":4,"_SIGMA_MM":3,"_STATE":2},"indices":0,"material":0,"mode":4,"targets":[{"NORMAL":11,
"POSITION":10}]}],"weights":[0.0]}],"nodes":[{"mesh":0,"name":"garment"}],"samplers":[{"magFilter":9729,
"minFilter":9987,"wrapS":33071,"wrapT":33071}],"scene":0,"scenes":[{"nodes":[0]}],
"textures":[{"sampler":0,"source":0},
{"sampler":0,"source":1}]})json"));
}

TEST_F(GlbWriterTest, VerticesOnSeamsNameTheTemplatesOwn) {
  MeshTexture texture = SmallResult::Texture();
  texture.of_corner = {{Eigen::Vector2f(0, 0), {1, 0}, {1, 0.5F}},
                       {Eigen::Vector2f(0, 0.75F), {1, 0.5F}, {0, 0.5F}}};
  for (int frame = 0; frame < SmallResult::kFrames; ++frame)
    ASSERT_TRUE(WriteRegisteredMesh(result_.MeshFile(frame), SmallResult::MeshAt(frame), SmallResult::Faces(),
                                    texture)
                    .ok());
  const tinygltf::Model model = Read({ExportAttribute::kUv});
  const tinygltf::Primitive& primitive = model.meshes.at(0).primitives.at(0);
  EXPECT_THAT(FloatsOf(model, primitive.attributes.at("_VERTEX")), ElementsAre(0, 1, 2, 3, 0));
  EXPECT_THAT(FloatsOf(model, primitive.attributes.at("TEXCOORD_0")),
              ElementsAre(0, 1, 1, 1, 1, 0.5F, 0, 0.5F, 0, 0.25F));
}

TEST_F(GlbWriterTest, RefusesBoundsThatAreCutShort) {
  auto source = result_.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kGlb, {});
  const auto writer = MakeGlbWriter(plan);
  Written(*writer, plan, result_.folder / "garment.glb");
  std::vector<double> state = writer->State();
  EXPECT_EQ(state.size(), 1u + 3 * 6);
  const auto other = MakeGlbWriter(plan);
  EXPECT_TRUE(other->Restore(state).ok());
  EXPECT_EQ(other->State(), state);
  state.pop_back();
  const absl::Status cut = other->Restore(state);
  EXPECT_EQ(cut.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(cut.message(), HasSubstr("bounds of the morph targets"));
}

}  // namespace
}  // namespace weft
