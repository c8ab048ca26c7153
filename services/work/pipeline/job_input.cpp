#include "services/work/pipeline/job_input.h"

#include <google/protobuf/message.h>

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace weft {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

const std::vector<JobInput>& AllInputs() {
  static const auto* const kInputs = new std::vector<JobInput>{
      {"spec.rig", "the rig", v1::ITEM_KIND_RIG, true, ""},
      {"spec.board", "the board", v1::ITEM_KIND_BOARD, true, ""},
      {"spec.garment", "the template", v1::ITEM_KIND_TEMPLATE, true, ""},
      {"spec.driving.avatar", "the avatar", v1::ITEM_KIND_AVATAR, false, ""},
      {"spec.options.scans", "the scans", v1::ITEM_KIND_UNSPECIFIED, false, ""},
      {"spec.options.starts", "the starts", v1::ITEM_KIND_UNSPECIFIED, false, ""},
      {"spec.dump", "the take", v1::ITEM_KIND_DUMP, true, ""},
  };
  return *kInputs;
}

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

}  // namespace

std::vector<JobInput> InputsOf(const v1::RegistrationSpec& spec) {
  std::vector<JobInput> inputs;
  for (const JobInput& input : AllInputs()) {
    std::string path = PathOf(spec, input);
    if (input.kind == v1::ITEM_KIND_AVATAR && path.empty()) continue;
    inputs.push_back(input);
    inputs.back().path = std::move(path);
  }
  return inputs;
}

void SetInput(const JobInput& input, const std::string& path, v1::RegistrationSpec* spec) {
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
