#include "services/formats/files/rig_file.h"

#include <algorithm>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/text_file.h"
#include "weft/v1/rig.pb.h"

namespace weft {
namespace {

absl::Status CheckFields(const v1::Camera& camera, const std::string& who) {
  const auto* descriptor = camera.GetDescriptor();
  const auto* reflection = camera.GetReflection();
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const auto* field = descriptor->field(i);
    if (field->cpp_type() == field->CPPTYPE_MESSAGE) continue;  // may be missing
    if (field->has_presence() && !reflection->HasField(camera, field)) {
      return absl::InvalidArgumentError(absl::StrCat(who, ": the field ", field->name(), " is missing"));
    }
  }
  const auto count = [&](const char* field, int have, int least, int most) -> absl::Status {
    if (have >= least && have <= most) return absl::OkStatus();
    const std::string expected = least == most ? absl::StrCat(least) : absl::StrCat(least, " to ", most);
    return absl::InvalidArgumentError(
        absl::StrCat(who, ": the field ", field, " has ", have, " numbers, expected ", expected));
  };
  absl::Status status = count("distortion", camera.distortion_size(), 5, 8);
  status.Update(count("rotation", camera.rotation_size(), 9, 9));
  status.Update(count("translation_mm", camera.translation_mm_size(), 3, 3));
  return status;
}

CameraModel FromProto(const v1::Camera& proto) {
  CameraModel camera;
  camera.id = proto.id();
  camera.width_px = proto.width_px();
  camera.height_px = proto.height_px();
  camera.fx_px = proto.fx_px();
  camera.fy_px = proto.fy_px();
  camera.cx_px = proto.cx_px();
  camera.cy_px = proto.cy_px();
  std::copy(proto.distortion().begin(), proto.distortion().end(), camera.distortion.begin());
  for (int i = 0; i < 9; ++i) camera.rotation(i / 3, i % 3) = proto.rotation(i);
  for (int i = 0; i < 3; ++i) camera.translation_mm[i] = proto.translation_mm(i);
  return camera;
}

v1::Camera ToProto(const CameraModel& camera) {
  v1::Camera proto;
  proto.set_id(camera.id);
  proto.set_width_px(camera.width_px);
  proto.set_height_px(camera.height_px);
  proto.set_fx_px(camera.fx_px);
  proto.set_fy_px(camera.fy_px);
  proto.set_cx_px(camera.cx_px);
  proto.set_cy_px(camera.cy_px);
  int terms = 8;
  while (terms > 5 && camera.distortion[terms - 1] == 0) --terms;
  for (int i = 0; i < terms; ++i) proto.add_distortion(camera.distortion[i]);
  for (int i = 0; i < 9; ++i) proto.add_rotation(camera.rotation(i / 3, i % 3));
  for (int i = 0; i < 3; ++i) proto.add_translation_mm(camera.translation_mm[i]);
  return proto;
}

constexpr double kDegPerRad = 180 / std::numbers::pi;

void ToProto(const CalibratedCamera& camera, v1::CameraSigmas& proto) {
  const auto& s = camera.sigmas;
  proto.set_fx_px(s[0]);
  proto.set_fy_px(s[1]);
  proto.set_cx_px(s[2]);
  proto.set_cy_px(s[3]);
  for (int i = 4; i < 9; ++i) proto.add_distortion(s[i]);
  for (int i = 9; i < 12; ++i) proto.add_rotation_deg(s[i] * kDegPerRad);
  for (int i = 12; i < 15; ++i) proto.add_center_mm(s[i]);
  proto.set_projection_px(camera.projection_sigma_px);
  proto.set_corner_px(camera.corner_sigma_px);
  proto.set_rms_px(camera.rms_px);
  proto.set_views(camera.views);
  proto.set_corners(camera.corners);
}

CalibratedCamera FromProto(const v1::CameraSigmas& proto) {
  CalibratedCamera camera;
  camera.sigmas = {proto.fx_px(), proto.fy_px(), proto.cx_px(), proto.cy_px()};
  for (int i = 0; i < 5; ++i) camera.sigmas[4 + i] = proto.distortion(i);
  for (int i = 0; i < 3; ++i) camera.sigmas[9 + i] = proto.rotation_deg(i) / kDegPerRad;
  for (int i = 0; i < 3; ++i) camera.sigmas[12 + i] = proto.center_mm(i);
  camera.projection_sigma_px = proto.projection_px();
  camera.corner_sigma_px = proto.corner_px();
  camera.rms_px = proto.rms_px();
  camera.views = proto.views();
  camera.corners = proto.corners();
  return camera;
}

// UTF-16 has a message of its own.
bool LooksLikeJson(std::string_view text) {
  text = WithoutByteOrderMark(text);
  const size_t first = text.find_first_not_of(" \t\r\n");
  return first == std::string_view::npos || text[first] == '{' || !CheckEncoding(text, "").ok();
}

}  // namespace

absl::StatusOr<Rig> ParseRig(std::string_view json, const std::string& source_name) {
  if (!LooksLikeJson(json)) {
    return absl::InvalidArgumentError(absl::StrCat(
        source_name, ": is no JSON; `weft rig import` makes a rig.json of the files of other programs"));
  }
  v1::Rig proto;
  WEFT_RETURN_IF_ERROR(ParseJson(json, source_name, proto, kInputJson));
  Rig rig;
  rig.id = proto.id();
  for (int i = 0; i < proto.cameras_size(); ++i) {
    const v1::Camera& camera = proto.cameras(i);
    const std::string who = absl::StrCat(source_name, ": cameras[", i, "]",
                                         camera.id().empty() ? "" : absl::StrCat(" (id ", camera.id(), ")"));
    WEFT_RETURN_IF_ERROR(CheckFields(camera, who));
    rig.cameras.push_back(FromProto(camera));
  }
  if (absl::Status status = rig.Validate(); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", status.message()));
  }
  if (proto.has_hash() && proto.hash() != rig.ContentHash()) {
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": the field hash says ", proto.hash(), ", but the cameras hash to ",
                     rig.ContentHash(), "; remove the field if the cameras were changed on purpose"));
  }
  return rig;
}

absl::StatusOr<Rig> ReadRig(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const std::string json, ReadWholeFile(path, kInputJson.bytes));
  return ParseRig(json, path);
}

absl::Status WriteRig(const std::string& path, const Rig& rig, const std::string& provenance,
                      const CalibrationRecord* calibration) {
  WEFT_RETURN_IF_ERROR(rig.Validate());
  v1::Rig proto;
  if (!rig.id.empty()) proto.set_id(rig.id);
  proto.set_hash(rig.ContentHash());
  if (!provenance.empty()) proto.set_provenance(provenance);
  for (const CameraModel& camera : rig.cameras) *proto.add_cameras() = ToProto(camera);
  if (calibration) {
    v1::RigCalibration& record = *proto.mutable_calibration();
    record.set_version(calibration->version);
    record.set_replaces(calibration->replaces);
    record.set_calibrated_utc(calibration->calibrated_utc);
    record.set_rms_px(calibration->rms_px);
    for (int i = 0; i < 3; ++i) record.add_stage_low_mm(calibration->stage_low_mm[i]);
    for (int i = 0; i < 3; ++i) record.add_stage_high_mm(calibration->stage_high_mm[i]);
    for (int i = 0; i < proto.cameras_size(); ++i) {
      ToProto(calibration->cameras[i], *proto.mutable_cameras(i)->mutable_sigmas());
    }
  }
  return WriteJsonFile(path, proto, JsonZeros::kOmitted);
}

absl::StatusOr<std::optional<CalibrationRecord>> ReadCalibrationRecord(const std::string& path) {
  WEFT_RETURN_IF_ERROR(ReadRig(path).status());
  v1::Rig proto;
  WEFT_RETURN_IF_ERROR(ReadJsonFile(path, proto, kInputJson));
  if (!proto.has_calibration()) return std::nullopt;
  const v1::RigCalibration& from = proto.calibration();
  CalibrationRecord record;
  record.version = from.version();
  record.replaces = from.replaces();
  record.calibrated_utc = from.calibrated_utc();
  record.rms_px = from.rms_px();
  if (from.stage_low_mm_size() == 3 && from.stage_high_mm_size() == 3) {
    for (int i = 0; i < 3; ++i) record.stage_low_mm[i] = from.stage_low_mm(i);
    for (int i = 0; i < 3; ++i) record.stage_high_mm[i] = from.stage_high_mm(i);
  }
  for (const v1::Camera& camera : proto.cameras()) {
    const v1::CameraSigmas& sigmas = camera.sigmas();
    if (sigmas.distortion_size() != 5 || sigmas.rotation_deg_size() != 3 || sigmas.center_mm_size() != 3) {
      return absl::InvalidArgumentError(
          absl::StrCat(path, ": camera ", camera.id(),
                       ": sigmas needs 5 numbers of distortion, 3 of rotation_deg and 3 of center_mm"));
    }
    record.cameras.push_back(FromProto(sigmas));
  }
  return record;
}

absl::StatusOr<std::vector<double>> ReadCameraSigmas(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const std::optional<CalibrationRecord> record, ReadCalibrationRecord(path));
  std::vector<double> sigmas_px;
  if (record.has_value()) {
    for (const CalibratedCamera& camera : record->cameras) sigmas_px.push_back(camera.projection_sigma_px);
  }
  return sigmas_px;
}

}  // namespace weft
