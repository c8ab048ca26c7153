#include "capture/rig/colmap_text.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "capture/rig/lens_fit.h"

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

// Lenses that see by the angle: fx fy cx cy as above, then the parameters that are k1 to k4, or omega of FOV,
// and those that must be zero.
struct AngleKind {
  size_t parameters;
  int of[4];
  std::vector<size_t> k, zero;
};
const std::map<std::string, AngleKind> kAngleKinds = {
    {"SIMPLE_FISHEYE", {3, {0, 0, 1, 2}, {}, {}}},
    {"FISHEYE", {4, {0, 1, 2, 3}, {}, {}}},
    {"SIMPLE_RADIAL_FISHEYE", {4, {0, 0, 1, 2}, {3}, {}}},
    {"RADIAL_FISHEYE", {5, {0, 0, 1, 2}, {3, 4}, {}}},
    {"OPENCV_FISHEYE", {8, {0, 1, 2, 3}, {4, 5, 6, 7}, {}}},
    {"THIN_PRISM_FISHEYE", {12, {0, 1, 2, 3}, {4, 5, 8, 9}, {6, 7, 10, 11}}},
    {"FOV", {5, {0, 1, 2, 3}, {4}, {}}}};

struct Line {
  int number;
  std::vector<std::string> words;
};

// Lines without comments and blank ones.
std::vector<Line> LinesOf(std::string_view text) {
  std::vector<Line> out;
  int number = 0;
  for (const absl::string_view line : absl::StrSplit(absl::string_view(text.data(), text.size()), '\n')) {
    ++number;
    const absl::string_view stripped = absl::StripAsciiWhitespace(line);
    if (stripped.empty() || stripped[0] == '#') continue;
    out.push_back({number, absl::StrSplit(stripped, absl::ByAnyChar(" \t"), absl::SkipEmpty())});
  }
  return out;
}

absl::Status Bad(const std::string& file, const Line& line, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat(file, ": line ", line.number, ": ", what));
}

absl::StatusOr<std::vector<double>> NumbersFrom(const Line& line, size_t first, size_t count,
                                                const std::string& file) {
  std::vector<double> out;
  for (size_t i = first; i < first + count; ++i) {
    double value = 0;
    if (i >= line.words.size() || !absl::SimpleAtod(line.words[i], &value) || !std::isfinite(value))
      return Bad(file, line, absl::StrCat("expected ", count, " numbers from word ", first + 1, " on"));
    out.push_back(value);
  }
  return out;
}

absl::StatusOr<std::vector<double>> Parameters(const Line& line, size_t count, const std::string& file) {
  if (line.words.size() > 4 + count) {
    return Bad(file, line,
               absl::StrCat("the model ", line.words[1], " has ", count, " parameters, here are ",
                            line.words.size() - 4));
  }
  return NumbersFrom(line, 4, count, file);
}

absl::Status SetAngleLens(const Line& line, const AngleKind& kind, const std::string& file,
                          CameraModel& camera, std::vector<std::string>& remarks) {
  WEFT_ASSIGN_OR_RETURN(const auto numbers, Parameters(line, kind.parameters, file));
  const std::string& model = line.words[1];
  for (const size_t i : kind.zero) {
    if (numbers[i] != 0)
      return Bad(file, line,
                 absl::StrCat("the model ", model, " has tangential or thin prism terms that are not zero, ",
                              "which have no counterpart here; undistort the images with COLMAP"));
  }
  camera.fx_px = numbers[kind.of[0]], camera.fy_px = numbers[kind.of[1]];
  camera.cx_px = numbers[kind.of[2]] - kHalfPixel, camera.cy_px = numbers[kind.of[3]] - kHalfPixel;
  std::vector<double> k;
  for (const size_t i : kind.k) k.push_back(numbers[i]);
  const auto error_px = FitLens(model == "FOV" ? FovRadius(k[0]) : FisheyeRadius(k), &camera);
  if (!error_px.ok())
    return Bad(file, line, absl::StrCat("its lens, ", model, ": ", error_px.status().message()));
  remarks.push_back(
      absl::StrFormat("camera %s of cameras.txt: its lens, %s, is held to %.2g px by Weft's rational lens",
                      line.words[0], model, *error_px));
  return absl::OkStatus();
}

absl::StatusOr<CameraModel> LensOf(const Line& line, const std::string& file,
                                   std::vector<std::string>& remarks) {
  if (line.words.size() < 4) return Bad(file, line, "expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS");
  CameraModel camera;
  if (!absl::SimpleAtoi(line.words[2], &camera.width_px) ||
      !absl::SimpleAtoi(line.words[3], &camera.height_px))
    return Bad(file, line, "expected the width and height of the image");
  if (const auto kind = kAngleKinds.find(line.words[1]); kind != kAngleKinds.end()) {
    WEFT_RETURN_IF_ERROR(SetAngleLens(line, kind->second, file, camera, remarks));
    return camera;
  }
  const auto kind = kLensKinds.find(line.words[1]);
  if (kind == kLensKinds.end()) {
    std::vector<std::string> known;
    for (const auto& [name, of] : kLensKinds) known.push_back(name);
    for (const auto& [name, of] : kAngleKinds) known.push_back(name);
    return Bad(file, line,
               absl::StrCat("the model ", line.words[1], " has no counterpart here; known are ",
                            absl::StrJoin(known, ", "), "; undistort the images with COLMAP"));
  }
  WEFT_ASSIGN_OR_RETURN(const auto numbers, Parameters(line, kind->second.parameters, file));
  const auto at = [&](int i) { return kind->second.of[i] < 0 ? 0.0 : numbers[kind->second.of[i]]; };
  camera.fx_px = at(0), camera.fy_px = at(1);
  camera.cx_px = at(2) - kHalfPixel, camera.cy_px = at(3) - kHalfPixel;
  for (int i = 0; i < 8; ++i) camera.distortion[i] = at(4 + i);
  return camera;
}

// X Y POINT3D_ID of each point: numbers in threes. An image has a number more and a name.
bool IsPoints(const Line& line) {
  double value = 0;
  return line.words.size() % 3 == 0 &&
         std::all_of(line.words.begin(), line.words.end(),
                     [&](const std::string& word) { return absl::SimpleAtod(word, &value); });
}

absl::StatusOr<CameraModel> ImageOf(const Line& line, const std::map<std::string, CameraModel>& lenses,
                                    const std::string& file) {
  const auto lens = line.words.size() >= 10 ? lenses.find(line.words[8]) : lenses.end();
  if (lens == lenses.end()) {
    return Bad(
        file, line,
        "expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME with a camera of cameras.txt, or the points "
        "of the image before");
  }
  WEFT_ASSIGN_OR_RETURN(const auto pose, NumbersFrom(line, 1, 7, file));
  CameraModel camera = lens->second;
  const Eigen::Quaterniond turn(pose[0], pose[1], pose[2], pose[3]);
  constexpr double kRounding = 0.01;
  if (!(std::abs(turn.norm() - 1) < kRounding))
    return Bad(file, line, absl::StrFormat("QW QX QY QZ has the length %.4g, a rotation has 1", turn.norm()));
  camera.rotation = turn.normalized().toRotationMatrix();
  camera.translation_mm = {pose[4], pose[5], pose[6]};
  camera.id = absl::StrJoin(line.words.begin() + 9, line.words.end(), " ");
  return camera;
}

// The folders of an image, the last one first; a folder cam<camera> of image<frame> is called <camera>.
struct ImagePath {
  std::string stem;
  std::vector<std::string> folders;
};

ImagePath PathOfImage(const std::string& name) {
  std::vector<std::string> parts = absl::StrSplit(name, absl::ByAnyChar("/\\"), absl::SkipEmpty());
  if (parts.empty()) return {name, {}};
  ImagePath out{parts.back().substr(0, parts.back().rfind('.')), {parts.rbegin() + 1, parts.rend()}};
  constexpr size_t kCam = 3;
  if (!out.folders.empty() && absl::StartsWith(out.folders[0], "cam") && out.folders[0].size() > kCam &&
      absl::StartsWith(out.stem, "image"))
    out.folders[0].erase(0, kCam);
  return out;
}

bool IsNumber(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), absl::ascii_isdigit);
}

// The folder, counted from the file, in which each image lies in one of its own: cam1/images/0001.png. Of a
// single image the one above a number. Nothing where there is no such.
std::optional<size_t> FolderOfCameras(const std::vector<ImagePath>& paths) {
  size_t levels = paths.front().folders.size();
  for (const ImagePath& path : paths) levels = std::min(levels, path.folders.size());
  if (paths.size() == 1) {
    const bool is_frame = levels > 0 && IsNumber(paths[0].stem) && !IsNumber(paths[0].folders[0]);
    return is_frame && paths[0].folders[0] != "images" ? std::optional<size_t>(0) : std::nullopt;
  }
  for (size_t level = 0; level < levels; ++level) {
    std::set<std::string> different;
    for (const ImagePath& path : paths) different.insert(path.folders[level]);
    if (different.size() == paths.size()) return level;
  }
  return std::nullopt;
}

// From paths of images to names of cameras, as the dumps that Weft reads have them.
void NameCameras(std::vector<CameraModel>& cameras, std::vector<std::string>& remarks) {
  std::vector<ImagePath> paths;
  std::set<std::string> folders;
  for (const CameraModel& camera : cameras) {
    paths.push_back(PathOfImage(camera.id));
    if (!paths.back().folders.empty()) folders.insert(paths.back().folders[0]);
  }
  if (paths.empty()) return;
  const std::optional<size_t> level = FolderOfCameras(paths);
  for (size_t i = 0; i < cameras.size(); ++i)
    cameras[i].id = level ? paths[i].folders[*level] : paths[i].stem;
  if (!level && folders.size() > 1)
    remarks.push_back(absl::StrCat("images lie in ", folders.size(),
                                   " folders, some with several images, so ",
                                   "cameras are called as their files, ", cameras[0].id, " and so on; if a ",
                                   "folder is a camera, leave one image of each in images.txt"));
}

absl::StatusOr<std::map<std::string, CameraModel>> LensesOf(std::string_view cameras, const std::string& file,
                                                            std::vector<std::string>& remarks) {
  std::map<std::string, CameraModel> lenses;
  for (const Line& line : LinesOf(cameras)) {
    WEFT_ASSIGN_OR_RETURN(CameraModel lens, LensOf(line, file, remarks));
    if (!lenses.emplace(line.words[0], std::move(lens)).second)
      return Bad(file, line, absl::StrCat("the camera ", line.words[0], " occurs twice"));
  }
  return lenses;
}

}  // namespace

absl::StatusOr<ForeignRig> ParseColmapText(std::string_view cameras, std::string_view images,
                                           const std::string& source_name) {
  const std::string images_file = source_name + "/images.txt";
  ForeignRig out;
  WEFT_ASSIGN_OR_RETURN(const auto lenses, LensesOf(cameras, source_name + "/cameras.txt", out.remarks));
  std::set<std::string> used;
  bool after_image = false;  // a line of points may follow
  for (const Line& line : LinesOf(images)) {
    if (std::exchange(after_image, false) && IsPoints(line)) continue;
    WEFT_ASSIGN_OR_RETURN(CameraModel camera, ImageOf(line, lenses, images_file));
    after_image = true;
    used.insert(line.words[8]);
    out.rig.cameras.push_back(std::move(camera));
  }
  NameCameras(out.rig.cameras, out.remarks);
  for (const auto& [id, lens] : lenses) {
    if (!used.contains(id))
      out.remarks.push_back(
          absl::StrCat("camera ", id, " of cameras.txt has no image in images.txt and is left out"));
  }
  absl::Status status = out.Validate();
  if (status.ok()) return out;
  return absl::InvalidArgumentError(
      absl::StrCat(source_name, ": ", status.message(),
                   absl::StrContains(status.message(), "occurs twice")
                       ? "; a rig has one image of each camera, named <camera>.png, <frame>/<camera>.png or "
                         "<camera>/<file>"
                       : ""));
}

absl::StatusOr<ColmapText> FormatColmapText(const Rig& rig) {
  WEFT_RETURN_IF_ERROR(rig.Validate());
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
