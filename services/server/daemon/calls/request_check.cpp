#include "services/server/daemon/calls/request_check.h"

#include <algorithm>
#include <optional>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status_macros.h"
#include "services/formats/files/frame_meshes.h"
#include "services/formats/options/presets.h"
#include "services/server/retention/retention_plan.h"
#include "services/server/rpc/error_detail.h"
#include "services/work/kinds/work_kind.h"
#include "services/work/spec/job_input.h"
#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

constexpr size_t kMaxPathBytes = 4096;
constexpr size_t kMaxNameBytes = 255, kMaxNotesBytes = 4096;
constexpr size_t kLeastKeyBytes = 8, kMaxKeyBytes = 64;
constexpr int kMostPriority = 100;
constexpr int kUsualLimit = 100, kMostLimit = 1000;  // of a list
constexpr int kMostLiveEvery = 1'000'000;

absl::Status Invalid(const std::string& field, const std::string& why, const std::string& remedy = "") {
  return FieldError(absl::StatusCode::kInvalidArgument, {field, why, remedy});
}

absl::Status CheckText(const std::string& field, const std::string& text, size_t max_bytes) {
  if (text.size() > max_bytes) {
    return Invalid(field, absl::StrCat("has ", text.size(), " bytes"),
                   absl::StrCat("at most ", max_bytes, " are allowed"));
  }
  if (std::ranges::any_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; })) {
    return Invalid(field, "holds a control character", "remove it");
  }
  return absl::OkStatus();
}

absl::Status CheckPath(const std::string& field, const std::string& path) {
  if (path.empty()) return Invalid(field, "must not be empty");
  return CheckText(field, path, kMaxPathBytes);
}

absl::Status CheckHash(const std::string& field, const std::string& hash) {
  const bool digits = std::ranges::all_of(hash, [](char c) { return absl::ascii_isxdigit(c); });
  if (hash.empty() || (hash.size() == 16 && digits)) return absl::OkStatus();
  return Invalid(field, absl::StrCat("\"", hash, "\" is no hash"), "give 16 hex digits, or nothing");
}

absl::Status CheckLive(const v1::RegistrationSpec& spec) {
  const std::string field = "spec.live_every";
  if (spec.live_every() < 0 || spec.live_every() > kMostLiveEvery) {
    return Invalid(field, absl::StrCat(spec.live_every(), " is out of range"),
                   absl::StrCat("give 1 to ", kMostLiveEvery, ", or 0 for a take that has ended"));
  }
  const bool ranges = !spec.frames().empty() || spec.first_frame() != 0 || spec.end_frame() != 0;
  if (spec.live_every() > 0 && ranges) {
    return Invalid(field, "is given with a range of frames", "leave one of them out");
  }
  return absl::OkStatus();
}

// Of the kind's name, and of work without fields of its own.
std::optional<SpecFault> FaultOfKind(const v1::RegistrationSpec& spec) {
  const v1::WorkKindInfo* kind = FindKindInfo(KindNameOf(spec));
  if (!spec.has_work()) return std::nullopt;
  if (kind == nullptr || kind->start() != v1::WORK_START_JOB)
    return UnknownKind(spec.work().kind(), v1::WORK_START_JOB, "spec.work.kind");
  if (HasFieldsOfItsOwn(spec))
    return SpecFault{"spec.work", "is given with fields of other kinds of jobs",
                     "leave spec.driving and spec.live_every out"};
  return FaultOfWork(*kind, spec.work(), "spec.work");
}

// What the kind of the job asks for.
absl::Status CheckKind(const v1::RegistrationSpec& spec) {
  if (const auto fault = KindOf(spec).FaultOf(spec)) return Invalid(fault->field, fault->why, fault->remedy);
  absl::Status status;
  for (const std::string& camera : spec.driving().cameras())
    status.Update(CheckText("spec.driving.cameras", camera, kMaxNameBytes));
  return status;
}

absl::Status CheckRange(const v1::RegistrationSpec& spec) {
  if (spec.first_frame() < 0) {
    return Invalid("spec.first_frame", absl::StrCat(spec.first_frame(), " is negative"), "count from 0");
  }
  if (spec.end_frame() < 0) {
    return Invalid("spec.end_frame", absl::StrCat(spec.end_frame(), " is negative"), "give 0 for all frames");
  }
  if (spec.end_frame() != 0 && spec.end_frame() <= spec.first_frame()) {
    return Invalid(
        "spec.end_frame",
        absl::StrCat(spec.end_frame(), " is not beyond spec.first_frame (", spec.first_frame(), ")"),
        "give a later one, or 0 for all frames");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckSubmitRequest(const v1::SubmitJobRequest& request) {
  if (!request.has_spec()) return Invalid("spec", "is missing");
  const v1::RegistrationSpec& spec = request.spec();
  if (const auto fault = FaultOfKind(spec)) return Invalid(fault->field, fault->why, fault->remedy);
  for (const JobInput& input : InputsOf(spec)) {
    WEFT_RETURN_IF_ERROR(input.is_required ? CheckPath(input.field, input.path)
                                           : CheckText(input.field, input.path, kMaxPathBytes));
  }
  for (const auto& status :
       {CheckText("spec.out", spec.out(), kMaxPathBytes), CheckPlainName("out_probe", request.out_probe()),
        CheckKey(request.idempotency_key()), CheckPriority(request.priority()), CheckRange(spec),
        CheckLive(spec), CheckKind(spec),
        CheckText("spec.options.preset", spec.options().preset(), kMaxNameBytes),
        CheckText("spec.frames", spec.frames(), kMaxNameBytes),
        CheckText("spec.options.mosaic", spec.options().mosaic(), kMaxNameBytes),
        CheckText("spec.options.cloud_format", spec.options().cloud_format(), kMaxNameBytes),
        CheckHash("spec.expected.rig", spec.expected().rig()),
        CheckHash("spec.expected.board", spec.expected().board()),
        CheckHash("spec.expected.garment", spec.expected().garment())}) {
    if (!status.ok()) return status;
  }
  const auto preset = PresetOptions(spec.options().preset());
  if (!preset.ok()) return Invalid("spec.options.preset", std::string(preset.status().message()));
  const auto options = EffectiveOptions(spec.options());
  if (options.ok()) return absl::OkStatus();
  return Invalid("spec.options.pipeline", std::string(options.status().message()));
}

absl::Status CheckPlainName(const std::string& field, const std::string& name) {
  WEFT_RETURN_IF_ERROR(CheckText(field, name, kMaxNameBytes));
  if (name == "." || name == ".." || name.find('/') != std::string::npos) {
    return Invalid(field, absl::StrCat("\"", name, "\" has folders"), "give a name without folders");
  }
  return absl::OkStatus();
}

absl::Status CheckDescription(const v1::DescribeTakeRequest& request) {
  absl::Status status = CheckText("slate", request.slate(), kMaxNameBytes);
  status.Update(CheckText("name", request.name(), kMaxNameBytes));
  status.Update(CheckText("notes", absl::StrReplaceAll(request.notes(), {{"\n", " "}}), kMaxNotesBytes));
  return status;
}

absl::Status CheckPriority(int priority) {
  if (priority >= -kMostPriority && priority <= kMostPriority) return absl::OkStatus();
  return Invalid("priority", absl::StrCat(priority, " is out of range"),
                 absl::StrCat("give ", -kMostPriority, " to ", kMostPriority));
}

absl::Status CheckOneLine(const std::string& field, const std::string& text) {
  return CheckText(field, text, kMaxPathBytes);
}

absl::StatusOr<int> LimitOf(int limit) {
  if (limit < 0) return Invalid("limit", absl::StrCat(limit, " is negative"), "give 0 for the default");
  return limit == 0 ? kUsualLimit : std::min(limit, kMostLimit);
}

absl::Status CheckRehearsal(const v1::RehearseRetentionRequest& request) {
  constexpr double kMostAhead_days = 36500;
  if (!(request.ahead_days() >= 0 && request.ahead_days() <= kMostAhead_days))
    return Invalid("ahead_days", absl::StrCat(request.ahead_days(), " is out of range"), "give 0 to 36500");
  const v1::RetentionRules& rules = request.rules();
  for (int i = 0; i < rules.GetDescriptor()->field_count(); ++i) {
    const auto* field = rules.GetDescriptor()->field(i);
    const double value = rules.GetReflection()->GetDouble(rules, field);
    if (!(value >= 0 && value <= kMostRule))
      return Invalid(absl::StrCat("rules.", field->name()), absl::StrCat(value, " is out of range"),
                     "give 0 to 1e9");
  }
  return absl::OkStatus();
}

absl::StatusOr<int> LimitOrAll(int limit) {
  if (limit < 0) return Invalid("limit", absl::StrCat(limit, " is negative"), "give 0 for all");
  return limit;
}

absl::Status CheckPageToken(const std::string& token) {
  return CheckText("page_token", token, kMaxPathBytes + kMaxNameBytes);
}

absl::Status CheckOwner(const std::string& owner) { return CheckText("owner", owner, kMaxNameBytes); }

absl::Status CheckKey(const std::string& key) {
  const bool plain = std::ranges::all_of(
      key, [](char c) { return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '-'; });
  if (key.empty()) return absl::OkStatus();
  if (plain && key.size() >= kLeastKeyBytes && key.size() <= kMaxKeyBytes) return absl::OkStatus();
  return Invalid("idempotency_key", "cannot be an id",
                 absl::StrCat("give ", kLeastKeyBytes, " to ", kMaxKeyBytes,
                              " of a-z, 0-9 and \"-\", for example a UUID"));
}

absl::Status CheckTakeId(const std::string& take_id) {
  const bool plain = std::ranges::all_of(take_id, [](char c) { return absl::ascii_isalnum(c) || c == '-'; });
  if (plain && !take_id.empty() && take_id.size() <= kMaxNameBytes) return absl::OkStatus();
  return Invalid("take_id", absl::StrCat("\"", take_id.substr(0, kMaxNameBytes), "\" is no id of a take"),
                 "`weft take list` shows the takes");
}

absl::Status CheckJobId(const std::string& job_id) {
  if (job_id.empty()) return Invalid("job_id", "must not be empty");
  return CheckText("job_id", job_id, kMaxNameBytes);
}

absl::Status CheckOffset(int64_t offset) {
  if (offset >= 0) return absl::OkStatus();
  return Invalid("offset", absl::StrCat(offset, " is negative"), "count bytes from 0");
}

absl::Status CheckFetchRequest(const v1::FetchResultRequest& request) {
  WEFT_RETURN_IF_ERROR(CheckJobId(request.job_id()));
  const bool of_job = request.kind() == v1::RESULT_KIND_JOB || request.kind() == v1::RESULT_KIND_JOB_REPORT;
  if (!v1::ResultKind_IsValid(request.kind()) || request.kind() == v1::RESULT_KIND_UNSPECIFIED) {
    return Invalid("kind", absl::StrCat(static_cast<int>(request.kind()), " is no kind of result"));
  }
  WEFT_RETURN_IF_ERROR(CheckOffset(request.offset()));
  WEFT_RETURN_IF_ERROR(CheckText("version", request.version(), kMaxNameBytes));
  if (of_job && !request.frame().empty())
    return Invalid("frame", "is given for a file of the whole job", "leave it empty");
  if (!of_job && request.frame().empty()) return Invalid("frame", "must not be empty");
  if (!request.mesh().empty()) {
    if (request.kind() != v1::RESULT_KIND_MESH)
      return Invalid("mesh", "is given for another kind of result", "leave it empty");
    if (const absl::Status name = CheckMeshName(request.mesh()); !name.ok())
      return Invalid("mesh", std::string(name.message()));
  }
  return CheckPlainName("frame", request.frame());
}

}  // namespace weft
