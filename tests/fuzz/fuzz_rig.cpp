// Rigs of other programs, by the first byte: COLMAP's two files after each other, or the YAML and JSON of
// OpenCV, ROS and Kalibr.
#include "capture/rig/colmap_text.h"
#include "capture/rig/foreign_rig.h"
#include "capture/rig/opencv_yaml.h"
#include "services/formats/files/text_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using weft::FuzzRequire;

constexpr char kColmap = 'C', kNextFile = '\x1e';

// What was read is a rig, can be judged and written, and is the same when it is read back.
void Try(const absl::StatusOr<weft::ForeignRig>& rig) {
  if (!rig.ok()) return;
  FuzzRequire(rig->rig.Validate().ok());
  weft::ForeignRig judged = *rig;
  weft::JudgeRig({}, &judged).IgnoreError();
  const auto text = weft::FormatOpenCvYaml(rig->rig);
  FuzzRequire(text.ok());
  const auto again = weft::ParseOpenCvYaml(*text, "again");
  FuzzRequire(again.ok(), std::string(again.status().message()));
  FuzzRequire(again->rig.ContentHash() == rig->rig.ContentHash());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const auto text = weft::PlainLines({reinterpret_cast<const char*>(data) + 1, size - 1}, "rig");
  if (!text.ok()) return 0;
  FuzzRequire(text->find('\r') == std::string::npos);
  if (data[0] != kColmap) {
    Try(weft::ParseOpenCvYaml(*text, "rig"));
    return 0;
  }
  const std::string_view both = *text;
  const size_t end = std::min(both.find(kNextFile), both.size());
  Try(weft::ParseColmapText(both.substr(0, end), both.substr(std::min(end + 1, both.size())), "rig"));
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  const std::string lens =
      "image_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: "
      "d\n"
      "   data: [ 700., 0., 320., 0., 700., 240., 0., 0., 1. ]\ndistortion_coefficients: {rows: 1, cols: 4, "
      "data: "
      "[0.1, 0.01, 0, 0]}\n";
  return {
      "Y%YAML:1.0\n---\n" + lens,
      "Y" + lens + "distortion_model: equidistant\ncamera_name: 0021\nR: [0.1, 0, 0]\nT: [1, 2, 3]\n",
      "Ycam0:\n  distortion_model: fov\n  distortion_coeffs: [0.8]\n  resolution: [640, 480]\n  intrinsics: "
      "[700, "
      "710, 320, 240]\ncam1:\n  distortion_coeffs: [0, 0, 0, 0]\n  resolution: [640, 480]\n  intrinsics: "
      "[700, 710, "
      "320, 240]\n  T_cn_cnm1: [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n",
      "Y{\"cameras\": [{\"image_width\": 9, \"image_height\": 9, \"camera_matrix\": [9, 0, 4, 0, 9, 4, 0, 0, "
      "1], "
      "\"distortion_coefficients\": []}]}",
      "Y<?xml "
      "version=\"1.0\"?>\n<opencv_storage>\n<image_width>9</image_width>\n<image_height>9</image_height>\n"
      "<camera_matrix type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt><data>9 0 4 0 9 4 0 0 "
      "1</data>"
      "</camera_matrix><distortion_coefficients>0 0 0 0 0</distortion_coefficients></opencv_storage>\n",
      "C1 OPENCV_FISHEYE 640 480 700 700 320 240 0.1 0 0 0\n2 PINHOLE 640 480 700 700 320 240\n\x1e"
      "1 1 0 0 0 0 0 5 1 left/1.png\n1 2 -1\n2 0.7071068 0 0.7071068 0 0 0 5 2 right/1.png\n"};
}
