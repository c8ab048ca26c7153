// Kinds of work by name: what each reads and takes. Commands, forms, checks and clients follow this list.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "weft/v1/job.pb.h"
#include "weft/v1/work.pb.h"

namespace weft {

// Before the id of a job where work reads the folder of its results.
inline constexpr char kJobPrefix[] = "job:";

inline constexpr char kRegisterKind[] = "register";
inline constexpr char kDriveKind[] = "drive";

// Jobs first, then operations. They live as long as the program.
std::vector<const v1::WorkKindInfo*> AllKindInfos();
// Null: no such kind.
const v1::WorkKindInfo* FindKindInfo(std::string_view name);
// Adds one to the list. Its name is new; call it before other threads start.
void AddKindInfo(v1::WorkKindInfo info);

// Of the job that a spec asks for; may be that of no kind.
std::string KindNameOf(const v1::RegistrationSpec& spec);

// Whether it has fields that only kinds of WORK_START_JOB_FIELDS have, beside inputs.
bool HasFieldsOfItsOwn(const v1::RegistrationSpec& spec);

// What is wrong with a field of a request, and what to do about it; the remedy may be empty.
struct SpecFault {
  std::string field, why, remedy = "";
};

// Inputs and options that the kind lacks, that are missing or out of range; the first. `field`: of the work,
// "spec.work".
std::optional<SpecFault> FaultOfWork(const v1::WorkKindInfo& info, const v1::WorkSpec& work,
                                     const std::string& field);
// No kind that is started so has this name; names those that there are.
SpecFault UnknownKind(const std::string& name, v1::WorkStart start, const std::string& field);

}  // namespace weft
