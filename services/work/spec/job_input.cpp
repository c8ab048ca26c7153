#include "services/work/spec/job_input.h"

#include <google/protobuf/message.h>

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// Names of the fields from the spec down to the path.
std::vector<std::string> NamesOf(const JobInput& input) {
  std::vector<std::string> names = absl::StrSplit(input.field, '.');
  names.erase(names.begin());
  return names;
}

const FieldDescriptor* FieldOf(const Message& message, const std::string& name) {
  return message.GetDescriptor()->FindFieldByName(name);
}

std::string PathOf(const v1::RegistrationSpec& spec, const JobInput& input) {
  const std::vector<std::string> names = NamesOf(input);
  const Message* at = &spec;
  for (size_t i = 0; i + 1 < names.size(); ++i)
    at = &at->GetReflection()->GetMessage(*at, FieldOf(*at, names[i]));
  return at->GetReflection()->GetString(*at, FieldOf(*at, names.back()));
}

// Each value that is given; one without a path where none is.
void AddOfWork(const v1::WorkSpec& work, const v1::WorkInputInfo& info, std::vector<JobInput>& inputs) {
  const JobInput none{"spec.work.inputs." + info.name(), info.label(), info.item(), info.is_required(), ""};
  const size_t before = inputs.size();
  for (int i = 0; i < work.inputs_size(); ++i) {
    if (work.inputs(i).name() != info.name()) continue;
    inputs.push_back(none);
    inputs.back().path = work.inputs(i).value();
    inputs.back().of_work = i;
  }
  if (inputs.size() == before && info.is_required()) inputs.push_back(none);
}

}  // namespace

std::vector<JobInput> InputsOf(const v1::RegistrationSpec& spec) {
  std::vector<JobInput> inputs;
  const v1::WorkKindInfo* kind = FindKindInfo(KindNameOf(spec));
  if (kind == nullptr) return inputs;
  for (const v1::WorkInputInfo& info : kind->inputs()) {
    JobInput input{"spec." + info.field(), info.label(), info.item(), info.is_required(), ""};
    if (info.field().empty()) {
      AddOfWork(spec.work(), info, inputs);
      continue;
    }
    input.path = PathOf(spec, input);
    inputs.push_back(std::move(input));
  }
  return inputs;
}

void SetInput(const JobInput& input, const std::string& path, v1::RegistrationSpec* spec) {
  if (input.of_work >= 0) {
    spec->mutable_work()->mutable_inputs(input.of_work)->set_value(path);
    return;
  }
  const std::vector<std::string> names = NamesOf(input);
  Message* at = spec;
  for (size_t i = 0; i + 1 < names.size(); ++i)
    at = at->GetReflection()->MutableMessage(at, FieldOf(*at, names[i]));
  at->GetReflection()->SetString(at, FieldOf(*at, names.back()), path);
}

absl::Status CheckInputsGiven(const v1::RegistrationSpec& spec) {
  for (const JobInput& input : InputsOf(spec)) {
    if (input.is_required && input.path.empty())
      return absl::InvalidArgumentError(
          absl::StrCat("the field ", input.field, " is empty: name ", input.what));
    if (absl::StrContains(input.path, '\0'))
      return absl::InvalidArgumentError(absl::StrCat("the field ", input.field, " holds a zero byte"));
  }
  return absl::OkStatus();
}

bool IsReadFrom(const v1::RegistrationSpec& spec, const std::string& folder) {
  const std::vector<JobInput> inputs = InputsOf(spec);
  return std::any_of(inputs.begin(), inputs.end(), [&folder](const JobInput& input) {
    return input.path == folder || absl::StartsWith(input.path, folder + "/");
  });
}

}  // namespace weft
