// Fields of cameras in YAML and JSON.
#pragma once

#include <yaml-cpp/yaml.h>

#include <initializer_list>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace weft {

// OpenCV 2 wrote Camera_Matrix, ROS 2 prints k: case and underscores are no difference.
std::string YamlKey(absl::string_view name);

// The first of `names` that the map has; null where there is none.
YAML::Node YamlField(const YAML::Node& map, std::initializer_list<const char*> names);

// As the file spells the first of `names` that it has; empty where there is none.
std::string YamlSpelling(const YAML::Node& map, std::initializer_list<const char*> names);

// The numbers of a sequence, or of the field `data` of a matrix; empty where the field is missing.
// InvalidArgument names the field.
absl::StatusOr<std::vector<double>> YamlNumbers(const YAML::Node& node, const std::string& name);
// The same where there must be `count` of them.
absl::StatusOr<std::vector<double>> YamlNumbers(const YAML::Node& node, const std::string& name,
                                                size_t count);

}  // namespace weft
