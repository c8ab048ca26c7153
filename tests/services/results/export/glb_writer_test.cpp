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
