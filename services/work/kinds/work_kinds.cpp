#include "base/status_macros.h"
#include "services/work/kinds/drive_kind.h"
#include "services/work/kinds/register_kind.h"
#include "services/work/kinds/work_kind.h"

namespace weft {

const WorkKind& KindOf(const v1::RegistrationSpec& spec) {
  static const RegisterKind kRegister;
  static const DriveKind kDrive;
  if (spec.has_driving()) return kDrive;
  return kRegister;
}

absl::StatusOr<LoadedInputs> ListInputs(const v1::RegistrationSpec& spec) {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<Work> work,
                        KindOf(spec).Load(spec, WorkKind::LoadFor::kListing));
  return work->inputs();
}

}  // namespace weft
