#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/work/kinds/take_kinds.h"
#include "services/work/kinds/work_kind.h"

namespace weft {
namespace {

// Of a job that another version of Weft was asked for.
class UnknownWork : public WorkKind {
 public:
  const v1::WorkKindInfo& info() const override {
    static const auto* const info = [] {
      auto* unknown = new v1::WorkKindInfo;
      unknown->set_name("unknown");
      unknown->set_done_word("done");
      return unknown;
    }();
    return *info;
  }
  Order order() const override { return Order::kInSequence; }
  bool is_refined_later() const override { return false; }
  bool has_coverage() const override { return false; }
  std::optional<SpecFault> FaultOf(const v1::RegistrationSpec& spec) const override {
    return UnknownKind(spec.work().kind(), v1::WORK_START_JOB, "spec.work.kind");
  }
  absl::StatusOr<v1::RegistrationOptions> Effective(const v1::RegistrationOptions& asked) const override {
    return asked;
  }
  absl::StatusOr<std::unique_ptr<Work>> Load(const v1::RegistrationSpec& spec, LoadFor) const override {
    return NoSuchKind(spec);
  }
  absl::StatusOr<std::vector<IncompleteFrame>> FindIncomplete(
      const v1::Job& job, const std::vector<v1::FrameInfo>&) const override {
    return NoSuchKind(job.spec());
  }

 private:
  static absl::Status NoSuchKind(const v1::RegistrationSpec& spec) {
    return absl::UnimplementedError(absl::StrCat("spec.work.kind: \"", EscapedText(KindNameOf(spec)),
                                                 "\" is none that this version of Weft does"));
  }
};

std::map<std::string, std::unique_ptr<WorkKind>>& Kinds() {
  static auto* const kinds = [] {
    auto* known = new std::map<std::string, std::unique_ptr<WorkKind>>;
    (*known)[kRegisterKind] = std::make_unique<RegisterKind>();
    (*known)[kDriveKind] = std::make_unique<DriveKind>();
    return known;
  }();
  return *kinds;
}

}  // namespace

const WorkKind& KindOf(const v1::RegistrationSpec& spec) {
  static const UnknownWork kUnknown;
  const auto found = Kinds().find(KindNameOf(spec));
  if (found == Kinds().end()) return kUnknown;
  return *found->second;
}

void AddKind(std::unique_ptr<WorkKind> kind) {
  AddKindInfo(kind->info());
  const std::string name = kind->name();
  Kinds()[name] = std::move(kind);
}

absl::StatusOr<LoadedInputs> ListInputs(const v1::RegistrationSpec& spec) {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<Work> work,
                        KindOf(spec).Load(spec, WorkKind::LoadFor::kListing));
  return work->inputs();
}

}  // namespace weft
