#include "capture/rig/colmap_text.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"

namespace weft {
namespace {

constexpr double kHalfPixel = 0.5;

struct LensKind {
  size_t parameters;
  // Index of fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6 among the parameters, -1 for zero.
  int of[12];
};
const std::map<std::string, LensKind> kLensKinds = {
    {"SIMPLE_PINHOLE", {3, {0, 0, 1, 2, -1, -1, -1, -1, -1, -1, -1, -1}}},
    {"PINHOLE", {4, {0, 1, 2, 3, -1, -1, -1, -1, -1, -1, -1, -1}}},
    {"SIMPLE_RADIAL", {4, {0, 0, 1, 2, 3, -1, -1, -1, -1, -1, -1, -1}}},
    {"RADIAL", {5, {0, 0, 1, 2, 3, 4, -1, -1, -1, -1, -1, -1}}},
    {"OPENCV", {8, {0, 1, 2, 3, 4, 5, 6, 7, -1, -1, -1, -1}}},
    {"FULL_OPENCV", {12, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}}}};

struct Line {
  int number;
  std::vector<std::string> words;
};

// Lines without comments; blank ones are kept, since images.txt has two lines per image.
std::vector<Line> LinesOf(std::string_view text) {
  std::vector<Line> out;
  int number = 0;
  for (const absl::string_view line : absl::StrSplit(absl::string_view(text.data(), text.size()), '\n')) {
    ++number;
    const absl::string_view stripped = absl::StripAsciiWhitespace(line);
    if (!stripped.empty() && stripped[0] == '#') continue;
    out.push_back({number, absl::StrSplit(stripped, absl::ByAnyChar(" \t"), absl::SkipEmpty())});
  }
  return out;
}

absl::StatusOr<std::vector<double>> NumbersFrom(const Line& line, size_t first, size_t count,
                                                const std::string& where) {
  std::vector<double> out;
  for (size_t i = first; i < first + count; ++i) {
    double value = 0;
    if (i >= line.words.size() || !absl::SimpleAtod(line.words[i], &value) || !std::isfinite(value)) {
      return absl::InvalidArgumentError(absl::StrCat(where, ": line ", line.number, ": expected ", count,
                                                     " numbers from word ", first + 1, " on"));
    }
    out.push_back(value);
  }
  return out;
}

absl::StatusOr<CameraModel> LensOf(const Line& line, const std::string& where) {
  const auto bad = [&](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(where, ": line ", line.number, ": ", what));
  };
  if (line.words.size() < 4) return bad("expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS");
  const auto kind = kLensKinds.find(line.words[1]);
  if (kind == kLensKinds.end()) {
    return bad(absl::StrCat("the model ", line.words[1],
                            " has no counterpart here; known are SIMPLE_PINHOLE, PINHOLE, "
                            "SIMPLE_RADIAL, RADIAL, OPENCV and FULL_OPENCV"));
  }
  CameraModel camera;
  if (!absl::SimpleAtoi(line.words[2], &camera.width_px) ||
      !absl::SimpleAtoi(line.words[3], &camera.height_px)) {
    return bad("expected the width and height of the image");
  }
  const auto numbers = NumbersFrom(line, 4, kind->second.parameters, where);
  if (!numbers.ok()) return numbers.status();
  const auto at = [&](int i) { return kind->second.of[i] < 0 ? 0.0 : (*numbers)[kind->second.of[i]]; };
  camera.fx_px = at(0);
  camera.fy_px = at(1);
  camera.cx_px = at(2) - kHalfPixel;
  camera.cy_px = at(3) - kHalfPixel;
  for (int i = 0; i < 8; ++i) camera.distortion[i] = at(4 + i);
  return camera;
}

}  // namespace

absl::StatusOr<Rig> ParseColmapText(std::string_view cameras, std::string_view images,
                                    const std::string& source_name) {
  std::map<std::string, CameraModel> lenses;
  const std::string cameras_file = source_name + "/cameras.txt", images_file = source_name + "/images.txt";
  for (const Line& line : LinesOf(cameras)) {
    if (line.words.empty()) continue;
    absl::StatusOr<CameraModel> lens = LensOf(line, cameras_file);
    if (!lens.ok()) return lens.status();
    lenses[line.words[0]] = *std::move(lens);
  }
  Rig rig;
  bool points = false;  // the line after an image's holds its points, none or many
  for (const Line& line : LinesOf(images)) {
    if (points) {
      points = false;
      continue;
    }
    if (line.words.empty()) continue;
    points = true;
    const auto pose = NumbersFrom(line, 1, 7, images_file);
    if (!pose.ok()) return pose.status();
    const auto lens = line.words.size() == 10 ? lenses.find(line.words[8]) : lenses.end();
    if (lens == lenses.end()) {
      return absl::InvalidArgumentError(absl::StrCat(
          images_file, ": line ", line.number,
          ": expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME with a camera of cameras.txt"));
    }
    CameraModel camera = lens->second;
    const Eigen::Quaterniond turn((*pose)[0], (*pose)[1], (*pose)[2], (*pose)[3]);
    if (!(turn.norm() > 0.5)) {
      return absl::InvalidArgumentError(
          absl::StrCat(images_file, ": line ", line.number, ": QW QX QY QZ is no rotation"));
    }
    camera.rotation = turn.normalized().toRotationMatrix();
    camera.translation_mm = {(*pose)[4], (*pose)[5], (*pose)[6]};
    camera.id = line.words[9].substr(0, line.words[9].rfind('.'));
    rig.cameras.push_back(camera);
  }
  if (absl::Status status = rig.Validate(); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", status.message()));
  }
  return rig;
}

absl::StatusOr<ColmapText> FormatColmapText(const Rig& rig) {
  if (absl::Status status = rig.Validate(); !status.ok()) return status;
  ColmapText out;
  out.cameras = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  out.images = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME, then a line of points\n";
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    const CameraModel& c = rig.cameras[i];
    if (c.id.find_first_of(" \t") != std::string::npos) {
      return absl::InvalidArgumentError(
          absl::StrCat("camera ", c.id, ": COLMAP's text allows no space in a name"));
    }
    absl::StrAppendFormat(&out.cameras, "%d FULL_OPENCV %d %d %.17g %.17g %.17g %.17g",
                          static_cast<int>(i + 1), c.width_px, c.height_px, c.fx_px, c.fy_px,
                          c.cx_px + kHalfPixel, c.cy_px + kHalfPixel);
    for (const double k : c.distortion) absl::StrAppendFormat(&out.cameras, " %.17g", k);
    out.cameras += '\n';
    const Eigen::Quaterniond q(c.rotation);
    absl::StrAppendFormat(&out.images, "%d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %d %s.png\n\n",
                          static_cast<int>(i + 1), q.w(), q.x(), q.y(), q.z(), c.translation_mm.x(),
                          c.translation_mm.y(), c.translation_mm.z(), static_cast<int>(i + 1), c.id);
  }
  return out;
}

}  // namespace weft
