// What export.json says of each export, and what an export refuses or leaves out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include "services/results/export/export_result.h"
#include "tests/services/results/export/filmed_result.h"
#include "tests/services/results/report/proto_text.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

v1::Export ManifestOfExport(const ExportRequest& request, const ExportProgress& progress = nullptr) {
  const auto outcome = ExportResult(request, progress, {});
  EXPECT_TRUE(outcome.ok()) << outcome.status();
  if (!outcome.ok()) return {};
  v1::Export written;
  EXPECT_TRUE(ReadJsonFile(request.out + "/export.json", written).ok());
  EXPECT_EQ(written.DebugString(), outcome->manifest.DebugString());
  return written;
}

TEST(ExportManifestTest, HoldsEverythingOfTheExport) {
  SmallResult result;
  v1::FrameReport failed;
  failed.set_state(v1::FRAME_STATE_FAILED), failed.set_reason("too dark");
  result.WriteReport(1, failed);
  result.request.up = UpAxis::kZ, result.request.unit = LengthUnit::kCentimetre;
  std::vector<std::string> steps;
  v1::Export manifest = ManifestOfExport(result.request, [&](ExportStep step, size_t done, size_t all) {
    steps.push_back(absl::StrCat(step == ExportStep::kCheck ? "check " : "write ", done, "/", all));
  });
  EXPECT_THAT(steps, ElementsAre("check 1/2", "check 2/2", "write 1/2", "write 2/2"));
  EXPECT_NE(manifest.weft_version(), "");
  manifest.clear_weft_version();
  EXPECT_EQ(manifest.DebugString(), TextOf<v1::Export>(
                                        R"(format: "ply"
 transform {
 export_from_world: 0.1
 export_from_world: 0
 export_from_world: 0
 export_from_world: 0
 export_from_world: 0
 export_from_world: 0
 export_from_world: -0.1
 export_from_world: 0
 export_from_world: 0
 export_from_world: 0.1
 export_from_world: 0
 export_from_world: 0
 export_from_world: 0
 export_from_world: 0
 export_from_world: 0
 export_from_world: 1
 up: "z"
 unit: "cm"
 }
 fps: 10
 fps_source: "--fps"
 vertices: 4
 faces: 2
 attributes: "uv"
 attributes: "velocity"
 attributes: "state"
 attributes: "sigma"
 attributes: "views"
 attributes: "coverage"
 frames { frame: "0000" time_s: 0 state: FRAME_STATE_DONE file: "0000.ply" }
 frames {
 frame: "0001"
 index: 1
 time_s: 0.1
 state: FRAME_STATE_FAILED
 missing_because: "too dark"
 }
 frames { frame: "0002" index: 2 time_s: 0.2 state: FRAME_STATE_DONE file: "0002.ply" }
 job_id: "job"
 inputs {}
 notes: "Frame 0001 has no mesh: too dark.")"));
}

TEST(ExportManifestTest, FilesAndAttributesAreThoseOfTheFormat) {
  std::string lines;
  for (const FormatTraits& traits : ExportFormats()) {
    SmallResult result;
    result.request.format = traits.format;
    if (traits.fixed_axes) result.request.unit = LengthUnit::kMetre;
    const v1::Export manifest = ManifestOfExport(result.request);
    absl::StrAppend(&lines, manifest.format(), ":");
    for (const std::string& file : manifest.files()) absl::StrAppend(&lines, " ", file);
    absl::StrAppend(&lines, " ", manifest.frames(1).file(), ";");
    for (const std::string& attribute : manifest.attributes()) absl::StrAppend(&lines, " ", attribute);
    absl::StrAppend(&lines, "\n");
    for (const std::string& file : manifest.files())
      EXPECT_NE(ReadBytes(result.request.out + "/" + file), "") << file;
    EXPECT_FALSE(std::filesystem::exists(result.request.out + "/.unfinished"));
  }
  EXPECT_EQ(lines, R"(ply: 0001.ply; uv velocity state sigma views coverage
obj: 0001.obj; uv
glb: garment.glb ; uv state sigma coverage
mdd: garment.mdd garment.obj ; uv
pc2: garment.pc2 garment.obj ; uv
usda: garment.usda ; uv velocity state sigma views coverage
npz: garment.npz ; uv velocity state sigma views coverage
)");
}

TEST(ExportManifestTest, WhatTheResultCannotGiveIsLeftOutAndTold) {
  const SmallResult result;
  ExportRequest request = result.request;
  request.fps = 0;
  for (int frame = 0; frame < SmallResult::kFrames; ++frame)
    ASSERT_TRUE(
        WriteMesh(result.MeshFile(frame), {SmallResult::MeshAt(frame).vertices_mm, SmallResult::Faces()})
            .ok());
  const std::string rate = "Velocities are left out: nothing tells the frame rate; give it with --fps.",
                    places = "Texture coordinates are left out: the template has none.",
                    measured =
                        "States, sigmas, views and coverage are left out: the meshes were not measured.";
  v1::Export manifest = ManifestOfExport(request);
  EXPECT_THAT(manifest.notes(), ElementsAre(rate, places, measured));
  EXPECT_THAT(manifest.attributes(), IsEmpty());
  EXPECT_EQ(manifest.fps_source(), "");
  using enum ExportAttribute;
  for (const auto& [attribute, note] : {std::pair{kVelocity, rate},
                                        {kUv, places},
                                        {kState, measured},
                                        {kSigma, measured},
                                        {kViews, measured},
                                        {kCoverage, measured}}) {
    request.has_attributes_named = true, request.attributes = {attribute};
    request.out = result.folder / ("out " + std::string(NameOf(attribute)));
    manifest = ManifestOfExport(request);
    EXPECT_THAT(manifest.notes(), ElementsAre(note));
    EXPECT_THAT(manifest.attributes(), IsEmpty());
  }
  request.attributes.clear(), request.out = result.folder / "out none";
  EXPECT_THAT(ManifestOfExport(request).notes(), IsEmpty());
}

class PicturedExportTest : public testing::Test {
 protected:
  PicturedExportTest() {
    filmed_.request.format = ExportFormat::kGlb, filmed_.request.unit = LengthUnit::kMetre;
    filmed_.request.recording = filmed_.recording;
  }
  tinygltf::Model Read() const {
    tinygltf::Model model;
    tinygltf::TinyGLTF reader;
    std::string errors, warnings;
    EXPECT_TRUE(reader.LoadBinaryFromFile(&model, &errors, &warnings, filmed_.request.out + "/garment.glb"))
        << errors;
    return model;
  }

  FilmedResult filmed_;
};

TEST_F(PicturedExportTest, AGlbHasTheTextureOfItsFrames) {
  filmed_.request.texture_px = 16, filmed_.request.texture_frames = 2;
  std::vector<std::string> steps;
  const v1::Export manifest =
      ManifestOfExport(filmed_.request, [&](ExportStep step, size_t done, size_t all) {
        if (step == ExportStep::kTexture) steps.push_back(absl::StrCat(done, "/", all));
      });
  EXPECT_THAT(steps, ElementsAre("1/2", "2/2"));
  EXPECT_THAT(manifest.texture_frames(), ElementsAre("0000", "0001"));
  EXPECT_EQ(manifest.texture_px(), 16);
  const tinygltf::Model model = Read();
  ASSERT_EQ(model.images.size(), 1u);
  EXPECT_EQ(model.images[0].width, 16);
  EXPECT_EQ(model.images[0].name, "albedo");
  for (size_t channel = 0; channel < 3; ++channel)
    EXPECT_NEAR(model.images[0].image[4 * (12 * 16 + 8) + channel], FilmedResult::kColor[channel], 1);
  const tinygltf::Material& cloth = model.materials.at(0);
  EXPECT_EQ(cloth.pbrMetallicRoughness.baseColorTexture.index, 0);
  EXPECT_EQ(cloth.normalTexture.index, -1);
}

TEST_F(PicturedExportTest, AStoppedExportKeepsItsTexture) {
  filmed_.request.texture_px = 16;
  std::stop_source stop;
  EXPECT_FALSE(ExportResult(
                   filmed_.request,
                   [&](ExportStep step, size_t, size_t) {
                     if (step == ExportStep::kWrite) stop.request_stop();
                   },
                   stop.get_token())
                   .ok());
  EXPECT_NE(ReadBytes(filmed_.request.out + "/.unfinished/albedo.png"), "");
  size_t textures = 0;
  ManifestOfExport(filmed_.request,
                   [&](ExportStep step, size_t, size_t) { textures += step == ExportStep::kTexture; });
  EXPECT_EQ(textures, 0u) << "it is not made anew";
  EXPECT_EQ(Read().images.size(), 1u);
}

TEST_F(PicturedExportTest, PicturesThatDoNotFitAreRefused) {
  ExportRequest& request = filmed_.request;
  const auto refusal = [&] { return std::string(ExportResult(request, nullptr, {}).status().message()); };
  request.has_attributes_named = true, request.attributes = {ExportAttribute::kState};
  request.texture_px = 16;
  EXPECT_EQ(refusal(), "--attributes: --texture needs uv; add it, or leave --texture out");
  request.texture_px = 0, request.normal_map_px = 16, request.max_vertices = 3;
  EXPECT_EQ(refusal(), "--attributes: --normal-map needs uv; add it, or leave --normal-map out");
  request.has_attributes_named = false;
  EXPECT_EQ(
      refusal(),
      "--normal-map: has the folds of one frame, and a glb holds one map for its 3 frames; choose one with "
      "--frames, or write a map for each with --format png");
  for (int frame = 0; frame < SmallResult::kFrames; ++frame)
    ASSERT_TRUE(
        WriteRegisteredMesh(filmed_.MeshFile(frame), SmallResult::MeshAt(frame), SmallResult::Faces()).ok());
  EXPECT_EQ(refusal(),
            "--normal-map: the meshes have no texture coordinates; register with a template that `weft "
            "template build` "
            "made, or one with its board");
}

}  // namespace
}  // namespace weft
