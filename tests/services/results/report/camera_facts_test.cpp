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

}  // namespace
}  // namespace weft
