// What a job reads, listed once: checks, confinement, uploads and retention all follow this list.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/library_item.pb.h"

namespace weft {

struct JobInput {
  std::string field;  // of the request: "spec.rig", "spec.work.inputs.result"
  std::string what;   // in a sentence: "the rig"
  v1::ItemKind kind;  // in a library; ITEM_KIND_UNSPECIFIED: no library keeps such files
  bool is_required;
  std::string path;  // may be empty
  int of_work = -1;  // position in spec.work.inputs; -1: it has a field of its own
};

// Those of the job's kind (kind_info.h), in its order. There is an avatar where the job names one, and what
// kinds without fields of their own are given.
std::vector<JobInput> InputsOf(const v1::RegistrationSpec& spec);
// Replaces the path of an input of `spec`.
void SetInput(const JobInput& input, const std::string& path, v1::RegistrationSpec* spec);

// InvalidArgument names the first field that is required and empty, or holds a zero byte.
absl::Status CheckInputsGiven(const v1::RegistrationSpec& spec);

// Whether an input is `folder` or lies below it. All paths are canonical.
bool IsReadFrom(const v1::RegistrationSpec& spec, const std::string& folder);

}  // namespace weft
