#include "capture/rig/yaml_fields.h"

#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// More than any field of a camera has. Aliases of YAML can make a short text as large as they like.
constexpr size_t kMostNumbers = 64;
constexpr int kMostNesting = 8;

absl::Status Flatten(const YAML::Node& node, int nesting, std::vector<double>& out) {
  if (nesting > kMostNesting || out.size() > kMostNumbers)
    return absl::InvalidArgumentError("has more numbers than a camera");
  if (node.IsSequence()) {
    for (const auto& item : node) {
      WEFT_RETURN_IF_ERROR(Flatten(item, nesting + 1, out));
    }
    return absl::OkStatus();
  }
  double value = 0;
  if (!node.IsScalar() || !absl::SimpleAtod(node.Scalar(), &value) || !std::isfinite(value)) {
    return absl::InvalidArgumentError(
        absl::StrCat(node.IsScalar() ? absl::StrCat("\"", node.Scalar().substr(0, 40), "\"") : "an entry",
                     " is no number"));
  }
  out.push_back(value);
  return absl::OkStatus();
}

}  // namespace

std::string YamlKey(absl::string_view name) {
  return absl::StrReplaceAll(absl::AsciiStrToLower(name), {{"_", ""}});
}

YAML::Node YamlField(const YAML::Node& map, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    for (const auto& entry : map) {
      if (entry.first.IsScalar() && YamlKey(entry.first.Scalar()) == YamlKey(name)) return entry.second;
    }
  }
  return YAML::Node(YAML::NodeType::Null);
}

std::string YamlSpelling(const YAML::Node& map, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    for (const auto& entry : map)
      if (entry.first.IsScalar() && YamlKey(entry.first.Scalar()) == YamlKey(name))
        return entry.first.Scalar();
  }
  return "";
}

absl::StatusOr<std::vector<double>> YamlNumbers(const YAML::Node& node, const std::string& name) {
  std::vector<double> numbers;
  if (node.IsNull()) return numbers;
  const YAML::Node data = node.IsMap() ? YamlField(node, {"data"}) : node;
  absl::Status status = data.IsSequence()
                            ? Flatten(data, 0, numbers)
                            : absl::InvalidArgumentError("is neither a matrix nor a list of numbers");
  if (status.ok() && node.IsMap()) {
    std::vector<double> size;
    for (const char* field : {"rows", "cols"}) status.Update(Flatten(YamlField(node, {field}), 0, size));
    if (status.ok() && size[0] * size[1] != static_cast<double>(numbers.size())) {
      status = absl::InvalidArgumentError(
          absl::StrCat("has ", numbers.size(), " numbers, its rows and cols make ", size[0] * size[1]));
    }
  }
  if (!status.ok())
    return absl::InvalidArgumentError(absl::StrCat("the field ", name, " ", status.message()));
  return numbers;
}

absl::StatusOr<std::vector<double>> YamlNumbers(const YAML::Node& node, const std::string& name,
                                                size_t count) {
  absl::StatusOr<std::vector<double>> numbers = YamlNumbers(node, name);
  if (!numbers.ok() || numbers->size() == count) return numbers;
  if (node.IsNull()) return absl::InvalidArgumentError(absl::StrCat("the field ", name, " is missing"));
  return absl::InvalidArgumentError(
      absl::StrCat("the field ", name, " has ", numbers->size(), " numbers, expected ", count));
}

}  // namespace weft
