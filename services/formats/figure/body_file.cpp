#include "services/formats/figure/body_file.h"

#include <array>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/little_endian.h"
#include "weft/v1/body.pb.h"

namespace weft {
namespace {

struct BodyField {
  double BodyShape::*value;
  bool (v1::Body::*has)() const;
  double (v1::Body::*get)() const;
  void (v1::Body::*set)(double);
};

#define WEFT_BODY_FIELD(name) \
  BodyField { &BodyShape::name, &v1::Body::has_##name, &v1::Body::name, &v1::Body::set_##name }
constexpr std::array<BodyField, kBodyFactors> kFields = {
    WEFT_BODY_FIELD(stature),     WEFT_BODY_FIELD(torso_length),   WEFT_BODY_FIELD(arm_length),
    WEFT_BODY_FIELD(leg_length),  WEFT_BODY_FIELD(shoulder_width), WEFT_BODY_FIELD(neck_girth),
    WEFT_BODY_FIELD(chest_girth), WEFT_BODY_FIELD(waist_girth),    WEFT_BODY_FIELD(hip_girth),
    WEFT_BODY_FIELD(arm_girth),   WEFT_BODY_FIELD(leg_girth),      WEFT_BODY_FIELD(belly_depth)};
#undef WEFT_BODY_FIELD

}  // namespace

absl::StatusOr<NamedBody> ParseBody(std::string_view json, const std::string& source_name) {
  v1::Body proto;
  WEFT_RETURN_IF_ERROR(ParseJson(json, source_name, proto));
  NamedBody out;
  out.id = proto.id();
  for (const BodyField& field : kFields)
    if ((proto.*field.has)()) out.shape.*field.value = (proto.*field.get)();
  if (absl::Status status = out.shape.Validate(); !status.ok())
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", std::string(status.message())));
  return out;
}

absl::StatusOr<NamedBody> ReadBody(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const std::string json, ReadWholeFile(path, kMaxJsonBytes));
  return ParseBody(json, path);
}

void BodyToProto(const NamedBody& body, v1::Body& proto) {
  proto.set_id(body.id);
  for (const BodyField& field : kFields) (proto.*field.set)(body.shape.*field.value);
}

absl::Status WriteBody(const std::string& path, const NamedBody& body) {
  v1::Body proto;
  BodyToProto(body, proto);
  return WriteJsonFile(path, proto);
}

std::string BodyHash(const BodyShape& shape) {
  std::string bytes;
  for (const BodyFactor& factor : BodyFactors()) PutLittleEndian(shape.*factor.value, bytes);
  return absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size()));
}

}  // namespace weft
