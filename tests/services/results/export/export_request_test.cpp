#include "services/results/export/export_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::StartsWith;

ExportRequest RequestOf(ExportFormat format) {
  ExportRequest request;
  request.result = "result";
  request.out = "out";
  request.format = format;
  return request;
}

std::string RequestFault(const ExportRequest& request) { return std::string(request.Validate().message()); }

TEST(ExportRequest, ErrorsNameTheOption) {
  ExportRequest request = RequestOf(ExportFormat::kPly);
  EXPECT_EQ(RequestFault(request), "");
  request.fps = -1;
  EXPECT_THAT(RequestFault(request), StartsWith("--fps: "));
  request.fps = 0, request.texture_px = 64;
  EXPECT_THAT(RequestFault(request), StartsWith("--texture: "));
  request.texture_px = 0, request.meshopt = true;
  EXPECT_THAT(RequestFault(request), StartsWith("--meshopt: "));
  request.meshopt = false, request.texture_frames = 0;
  EXPECT_THAT(RequestFault(request), StartsWith("--texture-frames: "));
  request.out = "";
  EXPECT_THAT(RequestFault(request), StartsWith("--out: "));
}

// glTF 2.0, section 3.4: y is up and lengths are metres.
TEST(ExportRequest, GltfHasItsAxesAndUnitBySpecification) {
  ExportRequest request = RequestOf(ExportFormat::kGlb);
  request.unit = LengthUnit::kMillimetre;
  EXPECT_THAT(RequestFault(request), StartsWith("--up, --unit: "));
  request.unit = LengthUnit::kMetre;
  EXPECT_EQ(RequestFault(request), "");
}

TEST(ExportRequest, NormalMapsNeedACoarserMesh) {
  EXPECT_TRUE(CheckNormalMap(0, 0).ok());
  EXPECT_TRUE(CheckNormalMap(64, 3).ok());
  EXPECT_THAT(std::string(CheckNormalMap(64, 0).message()),
              StartsWith("--normal-map: holds what a coarser mesh lacks"));
  EXPECT_THAT(std::string(CheckNormalMap(-1, 3).message()), StartsWith("--normal-map: must lie"));
  EXPECT_THAT(std::string(CheckNormalMap(0, 2).message()), StartsWith("--max-vertices: "));
}

TEST(ExportRequest, LimitsAreThoseOfTheTexts) {
  const auto fault = [](ExportFormat format, const auto& change) {
    ExportRequest request = RequestOf(format);
    change(request);
    return RequestFault(request);
  };
  using enum ExportFormat;
  EXPECT_EQ(fault(kPly, [](auto& r) { r.result.clear(); }), "the folder of the result is empty");
  EXPECT_EQ(fault(kPly, [](auto& r) { r.out.clear(); }), "--out: the folder of the export is empty");
  EXPECT_EQ(fault(kPly, [](auto& r) { r.fps = 1e6; }), "");
  EXPECT_EQ(fault(kPly, [](auto& r) { r.fps = 1e6 + 1; }),
            "--fps: must lie between 0 and 1000000 frames per second");
  EXPECT_EQ(fault(kPly, [](auto& r) { r.fps = -1e-9; }),
            "--fps: must lie between 0 and 1000000 frames per second");
  const std::string axes =
      "--up, --unit: glb is y up and in metres by its specification; leave them out, readers turn and scale "
      "it "
      "themselves";
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.up = UpAxis::kZ; }), axes);
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.unit = LengthUnit::kCentimetre; }), axes);
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.up = UpAxis::kY; }), "");
  EXPECT_EQ(fault(kUsda, [](auto& r) { r.up = UpAxis::kZ; }), "");
  EXPECT_EQ(fault(kObj, [](auto& r) { r.meshopt = true; }),
            "--meshopt: compresses glb alone, not obj; leave it out");
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.meshopt = true; }), "");
  EXPECT_EQ(fault(kObj, [](auto& r) { r.texture_px = 8; }),
            "--texture: stands in glb, or in files of its own with --format png; obj holds none");
  EXPECT_EQ(fault(kObj, [](auto& r) { r.normal_map_px = 8; }),
            "--normal-map: stands in glb, or in files of its own with --format png; obj holds none");
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.texture_px = 16384; }), "");
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.texture_px = 16385; }), "--texture: must lie between 1 and 16384 px");
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.texture_px = -1; }), "--texture: must lie between 1 and 16384 px");
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.texture_frames = 0; }), "--texture-frames: must be at least 1");
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.texture_frames = 1; }), "");
  EXPECT_EQ(fault(kObj,
                  [](auto& r) {
                    r.attributes = {ExportAttribute::kUv, ExportAttribute::kViews};
                  }),
            "--attributes: obj does not carry views; `weft export --help` has what each format carries");
  EXPECT_EQ(fault(kPly, [](auto& r) { r.world_up = std::string("up"); }),
            "--world-up: \"up\" is not one of x, -x, y, -y, z, -z");
  EXPECT_EQ(fault(kPly, [](auto& r) { r.max_vertices = 2; }),
            "--max-vertices: a mesh has at least 3; 0: all");
  EXPECT_EQ(fault(kPly, [](auto& r) { r.max_vertices = 3; }), "");
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.max_vertices = 3, r.normal_map_px = 16384; }), "");
  EXPECT_EQ(fault(kGlb, [](auto& r) { r.max_vertices = 3, r.normal_map_px = 16385; }),
            "--normal-map: must lie between 1 and 16384 px");
  EXPECT_EQ(
      fault(kGlb, [](auto& r) { r.normal_map_px = 8; }),
      "--normal-map: holds what a coarser mesh lacks; say with --max-vertices how many vertices that has");
}

}  // namespace
}  // namespace weft
