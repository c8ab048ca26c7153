#include "services/files/rig_file.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "services/files/atomic_file.h"
#include "services/files/json_file.h"
#include "weft/v1/rig.pb.h"

namespace weft {
namespace {

absl::Status CheckFields(const v1::Camera& camera, const std::string& who) {
  const auto* descriptor = camera.GetDescriptor();
  const auto* reflection = camera.GetReflection();
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const auto* field = descriptor->field(i);
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

}  // namespace

absl::StatusOr<Rig> ParseRig(std::string_view json, const std::string& source_name) {
  v1::Rig proto;
  if (absl::Status status = ParseJson(json, source_name, proto); !status.ok()) return status;
  Rig rig;
  rig.id = proto.id();
  for (int i = 0; i < proto.cameras_size(); ++i) {
    const v1::Camera& camera = proto.cameras(i);
    const std::string who = absl::StrCat(source_name, ": cameras[", i, "]",
                                         camera.id().empty() ? "" : absl::StrCat(" (id ", camera.id(), ")"));
    if (absl::Status status = CheckFields(camera, who); !status.ok()) return status;
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
  const absl::StatusOr<std::string> json = ReadWholeFile(path, kMaxJsonBytes);
  if (!json.ok()) return json.status();
  return ParseRig(*json, path);
}

absl::Status WriteRig(const std::string& path, const Rig& rig, const std::string& provenance) {
  if (absl::Status status = rig.Validate(); !status.ok()) return status;
  v1::Rig proto;
  if (!rig.id.empty()) proto.set_id(rig.id);
  proto.set_hash(rig.ContentHash());
  if (!provenance.empty()) proto.set_provenance(provenance);
  for (const CameraModel& camera : rig.cameras) *proto.add_cameras() = ToProto(camera);
  return WriteJsonFile(path, proto, JsonZeros::kOmitted);
}

}  // namespace weft
