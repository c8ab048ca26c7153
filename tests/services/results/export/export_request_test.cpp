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

}  // namespace
}  // namespace weft
