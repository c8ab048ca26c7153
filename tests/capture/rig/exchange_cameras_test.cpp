#include "capture/rig/exchange_cameras.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Rig FourCameras() {
  Rig rig;
  rig.id = "four";
  for (int c = 0; c < 4; ++c) {
    CameraModel& camera = rig.cameras.emplace_back();
    camera.id = absl::StrCat("c", c);
    camera.width_px = 100, camera.height_px = 80;
    camera.fx_px = camera.fy_px = 100 + c;
  }
  return rig;
}

TEST(ExchangeCameras, EachGetsThePlaceOfTheNext) {
  const Rig rig = FourCameras();
  EXPECT_THAT(ExchangedPlaces(rig, {"c1", "c3"}).value(), ElementsAre(0, 3, 2, 1));
  const auto ring = ExchangedPlaces(rig, {"c0", "c3", "c1"});
  EXPECT_THAT(ring.value(), ElementsAre(3, 0, 2, 1));
  const Rig exchanged = WithPlaces(rig, *ring);
  EXPECT_EQ(exchanged.cameras[0].id, "c0");
  EXPECT_EQ(exchanged.cameras[0].fx_px, 103);
  EXPECT_EQ(exchanged.cameras[1].fx_px, 100);
  EXPECT_EQ(exchanged.cameras[2].fx_px, 102);
  // Twice a pair is the rig again.
  const auto pair = ExchangedPlaces(rig, {"c1", "c3"});
  EXPECT_EQ(WithPlaces(WithPlaces(rig, *pair), *pair).ContentHash(), rig.ContentHash());
}

TEST(ExchangeCameras, ErrorsNameTheCamera) {
  Rig rig = FourCameras();
  const auto message = [&](const std::vector<std::string>& ids) {
    return std::string(ExchangedPlaces(rig, ids).status().message());
  };
  EXPECT_THAT(message({"c1"}), HasSubstr("two or more"));
  EXPECT_THAT(message({"c1", "c9"}), HasSubstr("the rig has no camera c9"));
  EXPECT_THAT(message({"c1", "c2", "c1"}), HasSubstr("c1 is given twice"));
}

TEST(ExchangeCameras, OfPartsTheRestStays) {
  Rig rig = FourCameras();
  rig.cameras[2].width_px = 120;
  rig.cameras[2].translation_mm.x() = 7;
  const std::vector<size_t> places = ExchangedPlaces(rig, {"c1", "c2"}).value();
  const auto first = [&](CameraPart part) { return WithPlaces(rig, places, part).cameras[1]; };
  const CameraModel &own = rig.cameras[1], &other = rig.cameras[2];
  for (const CameraPart part :
       {CameraPart::kCamera, CameraPart::kPlaceAndLens, CameraPart::kPlace, CameraPart::kLens}) {
    const CameraModel model = first(part);
    const bool has_place = part != CameraPart::kLens, has_lens = part != CameraPart::kPlace;
    EXPECT_EQ(model.id, "c1");
    EXPECT_EQ(model.width_px, part == CameraPart::kCamera ? 120 : own.width_px);
    EXPECT_EQ(model.fx_px, has_lens ? other.fx_px : own.fx_px) << CameraPartName(part);
    EXPECT_EQ(model.translation_mm.x(), has_place ? 7 : own.translation_mm.x()) << CameraPartName(part);
    EXPECT_EQ(CameraPartFromName(CameraPartName(part)).value(), part);
  }
  EXPECT_THAT(std::string(CameraPartFromName("pose").status().message()), HasSubstr("place-and-lens"));
}

}  // namespace
}  // namespace weft
