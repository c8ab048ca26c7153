#include "capture/rig/yaml_lens.h"

#include <algorithm>
#include <array>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "capture/rig/lens_fit.h"
#include "capture/rig/yaml_fields.h"

namespace weft {
namespace {

// Adds a remark where the lens was fitted.
absl::Status SetFitted(const RadiusOfAngle& radius, CameraModel& camera, std::vector<std::string>& remarks) {
  const absl::StatusOr<double> error_px = FitLens(radius, &camera);
  if (!error_px.ok())
    return absl::InvalidArgumentError(absl::StrCat("its fisheye lens: ", error_px.status().message()));
  remarks.push_back(absl::StrFormat("camera %s: its fisheye lens is held to %.2g px by Weft's rational lens",
                                    camera.id, *error_px));
  return absl::OkStatus();
}

enum class YamlLensKind { kNone, kOpenCv, kFisheye, kFov, kUnknown };

// A pinhole's distortion is OpenCV's, and other names stand for themselves.
YamlLensKind LensKindOf(const std::string& model) {
  struct Named {
    const char* name;
    YamlLensKind kind;
  };
  constexpr Named kNamed[] = {{"none", YamlLensKind::kNone},
                              {"plumbbob", YamlLensKind::kOpenCv},
                              {"radtan", YamlLensKind::kOpenCv},
                              {"radialtangential", YamlLensKind::kOpenCv},
                              {"brownconrady", YamlLensKind::kOpenCv},
                              {"rationalpolynomial", YamlLensKind::kOpenCv},
                              {"thinprism", YamlLensKind::kOpenCv},
                              {"opencv", YamlLensKind::kOpenCv},
                              {"pinhole", YamlLensKind::kOpenCv},
                              {"", YamlLensKind::kOpenCv},
                              {"equidistant", YamlLensKind::kFisheye},
                              {"equi", YamlLensKind::kFisheye},
                              {"fisheye", YamlLensKind::kFisheye},
                              {"opencvfisheye", YamlLensKind::kFisheye},
                              {"kannalabrandt", YamlLensKind::kFisheye},
                              {"kannalabrandt4", YamlLensKind::kFisheye},
                              {"kb4", YamlLensKind::kFisheye},
                              {"fov", YamlLensKind::kFov}};
  const std::string key = YamlKey(model);
  for (const Named& named : kNamed)
    if (key == named.name) return named.kind;
  return YamlLensKind::kUnknown;
}

bool IsTrue(const YAML::Node& node) {
  return node.IsScalar() && node.Scalar() != "0" && !absl::EqualsIgnoreCase(node.Scalar(), "false");
}

// A field that names a lens.
struct NamedLens {
  std::string field, model;
};

bool IsPinhole(const std::string& model) {
  const std::string key = YamlKey(model);
  return key.empty() || key == "pinhole" || key == "perspective" || key == "standard";
}

// Of other lenses than ours. A camera_model may be the name of a product as well.
bool IsOtherLens(const std::string& model) {
  constexpr std::array kOthers = {
      "omni",    "mei",        "eucm",         "ucm",       "doublesphere",    "ocam",
      "unified", "scaramuzza", "catadioptric", "spherical", "equirectangular", "orthographic"};
  const std::string key = YamlKey(model);
  return key == "ds" || std::any_of(kOthers.begin(), kOthers.end(),
                                    [&](const char* other) { return absl::StartsWith(key, other); });
}

// What the fields say of the lens besides that it is a pinhole. InvalidArgument: two lenses.
absl::StatusOr<NamedLens> NamedLensOf(const YAML::Node& fields) {
  struct Field {
    const char* name;
    bool is_of_lens;  // names nothing else
  };
  constexpr std::array kFields = {Field{"distortion_model", true}, Field{"distortion_type", true},
                                  Field{"lens_model", false},      Field{"lens_type", false},
                                  Field{"projection_model", true}, Field{"camera_model", false},
                                  Field{"camera_type", false}};
  NamedLens out;
  for (const Field& field : kFields) {
    const YAML::Node node = YamlField(fields, {field.name});
    if (!node.IsScalar() || IsPinhole(node.Scalar())) continue;
    const NamedLens lens = {field.name, node.Scalar()};
    const YamlLensKind kind = LensKindOf(lens.model);
    if (kind == YamlLensKind::kUnknown && !field.is_of_lens && !IsOtherLens(lens.model)) continue;
    if (kind == YamlLensKind::kUnknown) return lens;
    if (!out.model.empty() && LensKindOf(out.model) != kind)
      return absl::InvalidArgumentError(
          absl::StrCat("the field ", out.field, " says ", out.model, " and ", lens.field, " says ",
                       lens.model, ", which are other lenses; leave the one that was calibrated"));
    if (out.model.empty()) out = lens;
  }
  if (out.model.empty() && IsTrue(YamlField(fields, {"fisheye_model", "fisheye", "is_fisheye"})))
    out = {"fisheye_model", "fisheye"};
  return out;
}

}  // namespace

absl::Status SetYamlLens(const std::string& model, const std::vector<double>& k, CameraModel& camera,
                         std::vector<std::string>& remarks) {
  const auto count = [&](size_t wanted, const char* more) {
    if (k.size() == wanted) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat("the model ", model, " has ", wanted,
                                                   " distortion coefficients, the file ", k.size(), more));
  };
  switch (LensKindOf(model)) {
    case YamlLensKind::kNone:
      return count(0, "");
    case YamlLensKind::kFisheye: {
      const absl::Status status = count(
          4, "; give the four of the fisheye calibration, or name the model that the coefficients are of");
      return status.ok() ? SetFitted(FisheyeRadius(k), camera, remarks) : status;
    }
    case YamlLensKind::kFov: {
      const absl::Status status = count(1, "");
      return status.ok() ? SetFitted(FovRadius(k[0]), camera, remarks) : status;
    }
    case YamlLensKind::kOpenCv:
      return SetOpenCvDistortion(k, &camera);
    case YamlLensKind::kUnknown:
      break;
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "the lens model ", model, " has no counterpart here; known are plumb_bob, radtan, ",
      "rational_polynomial, equidistant, fisheye and fov. Undistort the pictures, or calibrate with one ",
      "of these"));
}

absl::Status SetYamlDistortion(const YAML::Node& fields, CameraModel& camera,
                               std::vector<std::string>& remarks) {
  if (!YamlField(fields, {"xi"}).IsNull()) {
    return absl::InvalidArgumentError(
        "the field xi is that of an omnidirectional lens, which has no counterpart here; undistort the "
        "pictures");
  }
  const YAML::Node field = YamlField(
      fields, {"distortion_coefficients", "distortion_coeffs", "dist_coeffs", "D", "distortion", "dist"});
  if (field.IsNull()) return absl::InvalidArgumentError("the field distortion_coefficients is missing");
  WEFT_ASSIGN_OR_RETURN(const auto k, YamlNumbers(field, "distortion_coefficients"));
  WEFT_ASSIGN_OR_RETURN(const NamedLens lens, NamedLensOf(fields));
  if (k.size() == 4 && lens.model.empty() && YamlField(fields, {"fisheye_model"}).IsNull()) {
    remarks.push_back(
        absl::StrCat("camera ", camera.id,
                     ": its four distortion coefficients are taken as k1 k2 p1 p2; if they are those ",
                     "of a fisheye lens, add the line `distortion_model: fisheye` to its file"));
  }
  return SetYamlLens(lens.model, k, camera, remarks);
}

}  // namespace weft
