#include "services/results/report/camera_facts.h"

#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

v1::ViewReport& AddView(v1::FrameReport& frame, const std::string& camera) {
  v1::ViewReport& view = *frame.add_views();
  view.set_camera(camera);
  return view;
}

v1::ViewReport& AddUnused(v1::FrameReport& frame, const std::string& camera, int width_px, int rig_width_px) {
  v1::ViewReport& view = AddView(frame, camera);
  view.set_missing_reason("image is of another size");
  view.mutable_image_size()->set_width_px(width_px);
  view.mutable_rig_size()->set_width_px(rig_width_px);
  return view;
}

TEST(CameraFacts, ImagesOfEachOthersSizeAreAnExchange) {
  v1::FrameReport frame;
  AddUnused(frame, "a", 640, 800);
  AddUnused(frame, "b", 800, 640);
  AddUnused(frame, "c", 500, 900);  // nobody's size
  AddView(frame, "d");
  const CameraFacts facts = FactsOf({frame});
  EXPECT_EQ(facts.cameras[0].fits_camera, "b");
  EXPECT_EQ(facts.cameras[1].fits_camera, "a");
  EXPECT_EQ(facts.cameras[2].fits_camera, "");
  EXPECT_TRUE(facts.cameras[2].has_other_size);
  EXPECT_FALSE(facts.cameras[3].has_other_size);
  EXPECT_EQ(FaultOf(facts.cameras).reason,
            "cameras a and b are exchanged: their images have each other's size");
}

TEST(CameraFacts, SizesThatTwoCamerasHaveSayNothing) {
  v1::FrameReport frame;
  AddUnused(frame, "a", 640, 800);
  AddUnused(frame, "b", 800, 640);
  AddUnused(frame, "c", 800, 640);
  EXPECT_EQ(FactsOf({frame}).cameras[0].fits_camera, "");
}

TEST(CameraFacts, EqualPicturesAreCounted) {
  std::vector<v1::FrameReport> frames(3);
  for (size_t f = 0; f < frames.size(); ++f) {
    AddView(frames[f], "still").set_image_hash("77");
    AddView(frames[f], "new").set_image_hash(std::to_string(f));
  }
  const CameraFacts facts = FactsOf(frames);
  EXPECT_EQ(facts.cameras[0].images, 2);
  EXPECT_EQ(facts.cameras[0].repeated, 2);
  EXPECT_EQ(facts.cameras[1].images, 2);
  EXPECT_EQ(facts.cameras[1].repeated, 0);
}

TEST(CameraFacts, WhatWasSeenIsOfCamerasThatHaveAnImage) {
  std::vector<v1::FrameReport> frames(2);
  for (v1::FrameReport& frame : frames) {
    v1::ViewReport& view = AddView(frame, "a");
    view.set_vertices_in_view(100);
    view.set_vertices_seen(60);
  }
  frames[1].mutable_views(0)->set_missing_reason("the file is empty");
  const CameraFacts facts = FactsOf(frames);
  EXPECT_EQ(facts.cameras[0].in_view, 100);
  EXPECT_EQ(facts.cameras[0].seen, 60);
}

void Agree(v1::ViewReport& view, int compared, int agreeing, double median_px, double common_px) {
  v1::CameraAgreement& agreement = *view.mutable_agreement();
  agreement.set_compared(compared), agreement.set_agreeing(agreeing);
  agreement.set_median_px(median_px), agreement.set_common_px(common_px);
}

TEST(CameraFacts, AgreementIsSummedUpOverTheFrames) {
  std::vector<v1::FrameReport> frames(3);
  Agree(AddView(frames[0], "a"), 100, 80, 1, 4);  // 80 % agree just so
  Agree(AddView(frames[1], "a"), 300, 239, 3, 2);
  AddView(frames[2], "a");
  v1::CameraAgreement& first = *frames[0].mutable_views(0)->mutable_agreement();
  first.set_scale(1), first.set_scale_sigma(0.1), first.set_perspective(0.2),
      first.set_perspective_sigma(0.3);
  v1::CameraAgreement& second = *frames[1].mutable_views(0)->mutable_agreement();
  second.set_scale(2), second.set_scale_sigma(0.5), second.set_perspective(0.6),
      second.set_perspective_sigma(0.7);
  const CameraStanding camera = FactsOf(frames).cameras[0];
  EXPECT_EQ(camera.camera, "a");
  EXPECT_EQ(camera.compared, 400);
  EXPECT_EQ(camera.agreeing, 319);
  EXPECT_EQ(camera.frames, 2);
  EXPECT_EQ(camera.frames_apart, 1);
  EXPECT_DOUBLE_EQ(camera.median_px, 2);
  EXPECT_DOUBLE_EQ(camera.common_px, 3);
  // Weighed by what was compared: one to three.
  EXPECT_DOUBLE_EQ(camera.scale, 1.75);
  EXPECT_DOUBLE_EQ(camera.scale_sigma, 0.4);
  EXPECT_DOUBLE_EQ(camera.perspective, 0.5);
  EXPECT_DOUBLE_EQ(camera.perspective_sigma, 0.6);
  first.set_scale(0);
  EXPECT_DOUBLE_EQ(FactsOf(frames).cameras[0].scale, 2) << "0 is not known";
}

TEST(CameraFacts, AnotherPlaceCountsWhereItExplainsHalfOfTheFramesApart) {
  std::vector<v1::FrameReport> frames(5);
  for (v1::FrameReport& frame : frames) Agree(AddView(frame, "a"), 100, 0, 9, 9);
  const auto fit = [&](int frame, const std::string& camera, const std::string& turned, double px) {
    v1::CameraAgreement& agreement = *frames[frame].mutable_views(0)->mutable_agreement();
    agreement.set_fits_camera(camera), agreement.set_fits_part("lens"), agreement.set_fits_turned(turned);
    agreement.set_fits_px(px);
  };
  fit(0, "b", "", 1);
  fit(1, "b", "", 3);
  CameraStanding standing = FactsOf(frames).cameras[0];
  EXPECT_EQ(standing.fits_camera, "") << "two of five";
  EXPECT_EQ(standing.fits_px, 0);
  fit(2, "b", "", 2);
  fit(3, "", "upside down", 8);
  standing = FactsOf(frames).cameras[0];
  EXPECT_EQ(standing.fits_camera, "b");
  EXPECT_EQ(standing.fits_part, "lens");
  EXPECT_EQ(standing.fits_turned, "");
  EXPECT_EQ(standing.fits_px, 8) << "the largest";
  for (const int frame : {0, 1, 4}) fit(frame, "", "upside down", 1);
  EXPECT_EQ(FactsOf(frames).cameras[0].fits_turned, "upside down");
  frames.resize(2);
  frames[1].mutable_views(0)->mutable_agreement()->clear_fits_turned();
  EXPECT_EQ(FactsOf(frames).cameras[0].fits_turned, "upside down") << "one of two is half";
}

TEST(CameraFacts, BlankImagesAreThoseThatSeeNoneOfMuchCloth) {
  std::vector<v1::FrameReport> frames(4);
  for (size_t f = 0; f < frames.size(); ++f) {
    frames[f].set_frame("f" + std::to_string(f));
    v1::ViewReport& view = AddView(frames[f], "a");
    view.set_vertices_in_view(f == 0 ? kLeastInView - 1 : kLeastInView);
    view.set_vertices_seen(f == 1 ? 1 : 0);
  }
  const CameraStanding camera = FactsOf(frames).cameras[0];
  EXPECT_EQ(camera.facing_images, 3);
  EXPECT_EQ(camera.blank_images, 2);
  EXPECT_EQ(camera.blank_frame, "f2");
}

TEST(CameraFacts, OfTheRigAreThoseThatHaveAnImageOnce) {
  std::vector<v1::FrameReport> frames(2);
  for (v1::FrameReport& frame : frames) {
    AddView(frame, "a");
    AddView(frame, "gone").set_missing_reason("no file");
    AddView(frame, "late");
    frame.add_unknown_cameras("z");
  }
  frames[0].mutable_views(2)->set_missing_reason("no file");
  frames[1].add_unknown_cameras("y");
  frames[0].mutable_cloud()->set_print_scale(1.5), frames[1].mutable_cloud()->set_print_scale(2.5);
  frames[1].mutable_cloud()->set_template_scale(3);
  const CameraFacts facts = FactsOf(frames);
  EXPECT_EQ(facts.of_rig, 2);
  EXPECT_EQ(facts.unknown, (std::vector<std::string>{"y", "z"}));
  EXPECT_EQ(facts.print_scale, 2.5) << "of two the larger";
  EXPECT_EQ(facts.template_scale, 3);
  EXPECT_FALSE(FactsOf({}).print_scale || FactsOf({}).template_scale);
}

}  // namespace
}  // namespace weft
