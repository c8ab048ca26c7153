#include "services/formats/options/option_range.h"

#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <cmath>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"

namespace weft {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

void Collect(const Descriptor& descriptor, const std::string& prefix, std::vector<OptionField>& options) {
  for (int i = 0; i < descriptor.field_count(); ++i) {
    const FieldDescriptor* field = descriptor.field(i);
    options.push_back({prefix + field->name(), field});
    if (options.back().IsGroup())
      Collect(*field->message_type(), absl::StrCat(prefix, field->name(), "."), options);
  }
}

// The message that holds the option; null where it is left out.
const Message* OwnerOf(const v1::PipelineOptions& options, const OptionField& option) {
  const Message* message = &options;
  std::vector<std::string> names = absl::StrSplit(option.path, '.');
  names.pop_back();
  for (const std::string& name : names) {
    const FieldDescriptor* field = message->GetDescriptor()->FindFieldByName(name);
    if (!message->GetReflection()->HasField(*message, field)) return nullptr;
    message = &message->GetReflection()->GetMessage(*message, field);
  }
  return message->GetReflection()->HasField(*message, option.field) ? message : nullptr;
}

double NumberIn(const Message& message, const FieldDescriptor* field) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return reflection.GetDouble(message, field);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return reflection.GetFloat(message, field);
    case FieldDescriptor::CPPTYPE_INT32:
      return reflection.GetInt32(message, field);
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection.GetUInt32(message, field);
    default:
      return 0;
  }
}

// Bounds of a float option are floats, too: 0.8 as a float is above 0.8 as a double.
bool IsWithin(double value, const FieldDescriptor* field, const v1::OptionAbout& about) {
  const auto bound = [field](double number) {
    return field->cpp_type() == FieldDescriptor::CPPTYPE_FLOAT ? static_cast<float>(number) : number;
  };
  return std::isfinite(value) && !(about.has_min() && value < bound(about.min())) &&
         !(about.has_max() && value > bound(about.max())) &&
         !(about.has_above() && value <= bound(about.above())) &&
         !(about.has_below() && value >= bound(about.below()));
}

}  // namespace

bool OptionField::IsGroup() const { return field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE; }

const v1::OptionAbout& OptionField::About() const { return field->options().GetExtension(v1::about); }

std::string OptionField::Unit() const {
  constexpr std::pair<const char*, const char*> kUnits[] = {
      {"_mm2", "mm^2"},     {"_mm", "mm"},       {"_px", "px"},
      {"_deg", "degrees"},  {"_cells", "cells"}, {"_pitches", "cells"},
      {"_sigmas", "sigma"}, {"_rings", "rings"}, {"_edges", "edges"}};
  for (const auto& [ending, unit] : kUnits) {
    if (absl::EndsWith(field->name(), ending)) return unit;
  }
  return "";
}

std::string OptionField::Range() const {
  const v1::OptionAbout& about = About();
  std::vector<std::string> parts;
  if (about.has_min()) parts.push_back(absl::StrCat("at least ", about.min()));
  if (about.has_above()) parts.push_back(absl::StrCat("above ", about.above()));
  if (about.has_max()) parts.push_back(absl::StrCat("at most ", about.max()));
  if (about.has_below()) parts.push_back(absl::StrCat("below ", about.below()));
  return absl::StrJoin(parts, ", ");
}

const std::vector<OptionField>& AllOptions() {
  static const std::vector<OptionField> all = [] {
    std::vector<OptionField> options;
    Collect(*v1::PipelineOptions::descriptor(), "", options);
    return options;
  }();
  return all;
}

std::string OptionValue(const v1::PipelineOptions& options, const OptionField& option) {
  const Message* owner = option.IsGroup() ? nullptr : OwnerOf(options, option);
  if (owner == nullptr) return "";
  std::string text;
  google::protobuf::TextFormat::PrintFieldValueToString(*owner, option.field, -1, &text);
  return text;
}

std::string RangeProblem(const v1::PipelineOptions& options, const OptionField& option) {
  const Message* owner = option.IsGroup() ? nullptr : OwnerOf(options, option);
  if (owner == nullptr || option.field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL) return "";
  if (IsWithin(NumberIn(*owner, option.field), option.field, option.About())) return "";
  const std::string range = option.Range();
  return absl::StrCat(OptionValue(options, option), " must be ", range.empty() ? "a finite number" : range);
}

absl::Status CheckRanges(const v1::PipelineOptions& options) {
  for (const OptionField& option : AllOptions()) {
    if (const std::string problem = RangeProblem(options, option); !problem.empty())
      return absl::InvalidArgumentError(absl::StrCat(option.path, ": ", problem));
  }
  return absl::OkStatus();
}

}  // namespace weft
