// What options.proto says of an option: its path, its sentence, its range.
#pragma once

#include <google/protobuf/descriptor.h>

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "weft/v1/options.pb.h"

namespace weft {

// One option, or one group of them.
struct OptionField {
  std::string path;  // "triangulation.consensus.inlier_radius_mm"
  const google::protobuf::FieldDescriptor* field = nullptr;

  bool IsGroup() const;
  const v1::OptionAbout& About() const;
  std::string Unit() const;   // "mm"; empty where the name has none
  std::string Range() const;  // "above 0, at most 1000"; empty where any value will do
};

// All options in the order of options.proto, groups before what they hold.
const std::vector<OptionField>& AllOptions();

// The value as `weft options` prints it; empty where the message leaves the option out.
std::string OptionValue(const v1::PipelineOptions& options, const OptionField& option);

// Why the value is none of the option's; empty where it is, or is left out.
std::string RangeProblem(const v1::PipelineOptions& options, const OptionField& option);

// InvalidArgument names the first option beyond its range, and the range.
absl::Status CheckRanges(const v1::PipelineOptions& options);

}  // namespace weft
