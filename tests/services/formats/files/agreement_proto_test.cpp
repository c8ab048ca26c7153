#include "services/formats/files/agreement_proto.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

CameraAgreement SomeAgreement() {
  CameraAgreement agreement;
  agreement.compared = 10;
  agreement.agreeing = 9;
  agreement.median_px = 0.5;
  agreement.common_px = 0.25;
  agreement.scale = 1.5;
  agreement.scale_sigma = 0.125;
  agreement.perspective = 2.5;
  agreement.perspective_sigma = 0.375;
  return agreement;
}

Rig TwoCameraRig() {
  Rig rig;
  for (const char* id : {"left", "right"}) rig.cameras.emplace_back().id = id;
  return rig;
}

TEST(DescribeAgreement, HasEveryNumber) {
  v1::ViewReport report;
  DescribeAgreement(SomeAgreement(), TwoCameraRig(), report);
  const v1::CameraAgreement& out = report.agreement();
  EXPECT_EQ(out.compared(), 10);
  EXPECT_EQ(out.agreeing(), 9);
  EXPECT_EQ(out.median_px(), 0.5);
  EXPECT_EQ(out.common_px(), 0.25);
  EXPECT_EQ(out.scale(), 1.5);
  EXPECT_EQ(out.scale_sigma(), 0.125);
  EXPECT_EQ(out.perspective(), 2.5);
  EXPECT_EQ(out.perspective_sigma(), 0.375);
  EXPECT_EQ(out.fits_camera(), "");
  EXPECT_EQ(out.fits_turned(), "");
}

TEST(DescribeAgreement, OfACameraThatWasNotComparedSaysNothing) {
  v1::ViewReport report;
  DescribeAgreement({}, TwoCameraRig(), report);
  EXPECT_FALSE(report.has_agreement());
}

TEST(DescribeAgreement, NamesTheCameraWhosePlaceFits) {
  CameraAgreement agreement = SomeAgreement();
  agreement.fits.emplace();
  agreement.fits->camera = 1;
  agreement.fits->median_px = 0.75;
  v1::ViewReport report;
  DescribeAgreement(agreement, TwoCameraRig(), report);
  EXPECT_EQ(report.agreement().fits_camera(), "right");
  EXPECT_EQ(report.agreement().fits_part(), std::string(CameraPartName(agreement.fits->part)));
  EXPECT_EQ(report.agreement().fits_turned(), "");
  EXPECT_EQ(report.agreement().fits_px(), 0.75);
}

TEST(DescribeAgreement, SaysHowImagesAreTurned) {
  for (const auto& [turn, text] :
       {std::pair{ImageTurn::kUpsideDown, "upside down"}, std::pair{ImageTurn::kMirrored, "mirrored"},
        std::pair{ImageTurn::kMirroredUpsideDown, "mirrored and upside down"}}) {
    CameraAgreement agreement = SomeAgreement();
    agreement.fits.emplace();
    agreement.fits->turn = turn;
    v1::ViewReport report;
    DescribeAgreement(agreement, TwoCameraRig(), report);
    EXPECT_EQ(report.agreement().fits_turned(), text);
    EXPECT_EQ(report.agreement().fits_camera(), "");
  }
}

}  // namespace
}  // namespace weft
