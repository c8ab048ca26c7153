#include "services/work/spec/kind_info.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <map>
#include <optional>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "capture/file/plain_text.h"
#include "services/work/spec/kind_texts.h"

namespace weft {
namespace {

constexpr int kMostInputs = 1000, kMostOptions = 100;
constexpr size_t kMostBytes = 4096;

std::deque<v1::WorkKindInfo> ParseTexts() {
  std::deque<v1::WorkKindInfo> infos;
  const auto add = [&infos](const char* text) -> v1::WorkKindInfo& {
    // Which line is wrong stands on stderr then.
    if (!google::protobuf::TextFormat::ParseFromString(text, &infos.emplace_back())) std::abort();
    return infos.back();
  };
  for (const char* text : kJobKinds) add(text);
  for (const char* text : kOperationKinds) add(text).set_start(v1::WORK_START_OPERATION);
  return infos;
}

// Their addresses stay.
std::deque<v1::WorkKindInfo>& Infos() {
  static auto* const infos = new std::deque<v1::WorkKindInfo>(ParseTexts());
  return *infos;
}

using MaybeFault = std::optional<SpecFault>;

template <typename Infos>
std::string NamesOfAll(const Infos& infos) {
  return absl::StrJoin(infos, ", ",
                       [](std::string* out, const auto& info) { absl::StrAppend(out, info.name()); });
}

MaybeFault FaultOfText(const std::string& name, const std::string& value, const std::string& field) {
  if (value.size() > kMostBytes)
    return SpecFault{field, absl::StrCat(EscapedText(name), " has ", value.size(), " bytes"),
                     absl::StrCat("at most ", kMostBytes, " are allowed")};
  if (IsPlainText(value)) return std::nullopt;
  return SpecFault{field, absl::StrCat(EscapedText(name), " holds a control character"), "remove it"};
}

MaybeFault CheckInputs(const v1::WorkKindInfo& info, const v1::WorkSpec& work, const std::string& field) {
  if (work.inputs_size() > kMostInputs)
    return SpecFault{field, "are too many", absl::StrCat("give at most ", kMostInputs)};
  std::map<std::string, int> given;
  for (const v1::NamedValue& input : work.inputs()) {
    if (input.value().empty()) return SpecFault{field, absl::StrCat(EscapedText(input.name()), " is empty")};
    if (const MaybeFault fault = FaultOfText(input.name(), input.value(), field)) return fault;
    ++given[input.name()];
  }
  for (const v1::WorkInputInfo& input : info.inputs()) {
    const int count = given[input.name()];
    if (count == 0 && input.is_required())
      return SpecFault{field, absl::StrCat(input.name(), " is missing"),
                       absl::StrCat(info.name(), " needs it")};
    if (count > 1 && !input.may_repeat())
      return SpecFault{field, absl::StrCat(input.name(), " is given ", count, " times"), "give it once"};
    given.erase(input.name());
  }
  if (given.empty()) return std::nullopt;
  return SpecFault{field,
                   absl::StrCat("\"", EscapedText(given.begin()->first), "\" is no input of ", info.name()),
                   absl::StrCat("it has ", NamesOfAll(info.inputs()))};
}

MaybeFault CheckValue(const v1::WorkOptionInfo& option, const std::string& value, const std::string& field) {
  if (const MaybeFault fault = FaultOfText(option.name(), value, field)) return fault;
  if (option.type() == v1::OPTION_TYPE_FLAG) {
    if (value.empty()) return std::nullopt;
    return SpecFault{field, absl::StrCat(option.name(), " has the value \"", EscapedText(value), "\""),
                     "it is given or not, without a value"};
  }
  const auto& choices = option.choices();
  if (!choices.empty() && std::find(choices.begin(), choices.end(), value) == choices.end())
    return SpecFault{field, absl::StrCat(option.name(), " is \"", EscapedText(value), "\""),
                     absl::StrCat("give one of ", absl::StrJoin(choices, ", "))};
  if (option.type() == v1::OPTION_TYPE_TEXT) return std::nullopt;
  double number = 0;
  int64_t whole = 0;
  const bool is_number = option.type() == v1::OPTION_TYPE_INTEGER
                             ? absl::SimpleAtoi(value, &whole)
                             : absl::SimpleAtod(value, &number) && std::isfinite(number);
  if (option.type() == v1::OPTION_TYPE_INTEGER) number = static_cast<double>(whole);
  const bool has_range = option.least() != 0 || option.most() != 0;
  if (is_number && (!has_range || (number >= option.least() && number <= option.most()))) return std::nullopt;
  return SpecFault{
      field, absl::StrCat(option.name(), " is \"", EscapedText(value), "\""),
      absl::StrCat(option.type() == v1::OPTION_TYPE_INTEGER ? "give a whole number" : "give a number",
                   !has_range ? ""
                   : !std::isinf(option.most())
                       ? absl::StrCat(" from ", option.least(), " to ", option.most())
                   : option.least() > 0 ? " above 0"
                                        : " of 0 or more")};
}

MaybeFault CheckOptions(const v1::WorkKindInfo& info, const v1::WorkSpec& work, const std::string& field) {
  if (work.options_size() > kMostOptions)
    return SpecFault{field, "are too many", absl::StrCat("give at most ", kMostOptions)};
  for (const v1::NamedValue& given : work.options()) {
    const auto option =
        std::find_if(info.options().begin(), info.options().end(),
                     [&given](const v1::WorkOptionInfo& known) { return known.name() == given.name(); });
    if (option == info.options().end()) {
      return SpecFault{field,
                       absl::StrCat("\"", EscapedText(given.name()), "\" is no option of ", info.name()),
                       info.options().empty() ? "it has none" : "it has " + NamesOfAll(info.options())};
    }
    if (const MaybeFault fault = CheckValue(*option, given.value(), field)) return fault;
  }
  for (const v1::WorkOptionInfo& option : info.options()) {
    const bool is_given =
        std::any_of(work.options().begin(), work.options().end(),
                    [&option](const v1::NamedValue& given) { return given.name() == option.name(); });
    if (option.is_required() && !is_given)
      return SpecFault{field, absl::StrCat(option.name(), " is missing"),
                       absl::StrCat(info.name(), " needs it")};
  }
  return std::nullopt;
}

}  // namespace

std::vector<const v1::WorkKindInfo*> AllKindInfos() {
  std::vector<const v1::WorkKindInfo*> infos;
  for (const bool operations : {false, true}) {
    for (const v1::WorkKindInfo& info : Infos()) {
      if ((info.start() == v1::WORK_START_OPERATION) == operations) infos.push_back(&info);
    }
  }
  return infos;
}

const v1::WorkKindInfo* FindKindInfo(std::string_view name) {
  const auto found = std::find_if(Infos().begin(), Infos().end(),
                                  [name](const v1::WorkKindInfo& info) { return info.name() == name; });
  return found == Infos().end() ? nullptr : &*found;
}

void AddKindInfo(v1::WorkKindInfo info) {
  if (FindKindInfo(info.name()) != nullptr) std::abort();
  Infos().push_back(std::move(info));
}

bool HasFieldsOfItsOwn(const v1::RegistrationSpec& spec) {
  return spec.has_driving() || spec.live_every() != 0;
}

std::string KindNameOf(const v1::RegistrationSpec& spec) {
  if (spec.has_work()) return spec.work().kind();
  return spec.has_driving() ? kDriveKind : kRegisterKind;
}

std::optional<SpecFault> FaultOfWork(const v1::WorkKindInfo& info, const v1::WorkSpec& work,
                                     const std::string& field) {
  if (const MaybeFault fault = CheckInputs(info, work, field + ".inputs")) return fault;
  return CheckOptions(info, work, field + ".options");
}

SpecFault UnknownKind(const std::string& name, v1::WorkStart start, const std::string& field) {
  std::vector<std::string> known;
  for (const v1::WorkKindInfo* info : AllKindInfos()) {
    if (info->start() == start) known.push_back(info->name());
  }
  return SpecFault{field, absl::StrCat("\"", EscapedText(name), "\" is none that a daemon runs"),
                   known.empty() ? "it runs none" : "give one of " + absl::StrJoin(known, ", ")};
}

}  // namespace weft
