#include "services/results/export/export_format.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

namespace weft {
namespace {

using enum ExportAttribute;

constexpr std::array<std::pair<ExportAttribute, const char*>, 7> kAttributes = {{{kUv, "uv"},
                                                                                 {kVelocity, "velocity"},
                                                                                 {kState, "state"},
                                                                                 {kSigma, "sigma"},
                                                                                 {kViews, "views"},
                                                                                 {kCoverage, "coverage"},
                                                                                 {kNormal, "normal"}}};
constexpr std::array<std::pair<UpAxis, const char*>, 2> kUpAxes = {{{UpAxis::kY, "y"}, {UpAxis::kZ, "z"}}};
constexpr std::array<std::pair<LengthUnit, const char*>, 3> kUnits = {
    {{LengthUnit::kMetre, "m"}, {LengthUnit::kCentimetre, "cm"}, {LengthUnit::kMillimetre, "mm"}}};

template <typename Value, size_t kCount>
const char* NameIn(const std::array<std::pair<Value, const char*>, kCount>& names, Value value) {
  for (const auto& [named, name] : names)
    if (named == value) return name;
  return "";
}

template <typename Value, size_t kCount>
absl::StatusOr<Value> ValueIn(const std::array<std::pair<Value, const char*>, kCount>& names,
                              std::string_view option, std::string_view wanted) {
  std::vector<std::string> known;
  for (const auto& [value, name] : names) {
    if (name == wanted) return value;
    known.emplace_back(name);
  }
  return absl::InvalidArgumentError(absl::StrCat(std::string(option), ": \"", std::string(wanted),
                                                 "\" is not one of ", absl::StrJoin(known, ", ")));
}

}  // namespace

bool FormatTraits::Carries(ExportAttribute attribute) const {
  return std::ranges::find(carries, attribute) != carries.end();
}

std::vector<ExportAttribute> FormatTraits::ByDefault() const {
  std::vector<ExportAttribute> attributes = carries;
  std::erase(attributes, kNormal);
  return attributes;
}

const std::vector<FormatTraits>& ExportFormats() {
  static const std::vector<ExportAttribute> all = {kUv, kVelocity, kState, kSigma, kViews, kCoverage};
  static const std::vector<FormatTraits> formats = {{.format = ExportFormat::kPly,
                                                     .name = "ply",
                                                     .about = "a binary PLY per frame",
                                                     .file_per_frame = true,
                                                     .up = UpAxis::kZ,
                                                     .carries = all},
                                                    {.format = ExportFormat::kObj,
                                                     .name = "obj",
                                                     .about = "a Wavefront OBJ per frame",
                                                     .file_per_frame = true,
                                                     .up = UpAxis::kY,
                                                     .carries = {kUv}},
                                                    {.format = ExportFormat::kGlb,
                                                     .name = "glb",
                                                     .about = "binary glTF, a morph target per frame",
                                                     .up = UpAxis::kY,
                                                     .fixed_axes = true,
                                                     .needs_rate = true,
                                                     .carries = {kUv, kState, kSigma, kCoverage, kNormal}},
                                                    {.format = ExportFormat::kMdd,
                                                     .name = "mdd",
                                                     .about = "point cache MDD, and a mesh garment.obj",
                                                     .up = UpAxis::kY,
                                                     .needs_rate = true,
                                                     .repeats_gaps = true,
                                                     .carries = {kUv}},
                                                    {.format = ExportFormat::kPc2,
                                                     .name = "pc2",
                                                     .about = "point cache PC2, and a mesh garment.obj",
                                                     .up = UpAxis::kY,
                                                     .repeats_gaps = true,
                                                     .carries = {kUv}},
                                                    {.format = ExportFormat::kUsda,
                                                     .name = "usda",
                                                     .about = "USD as text, points as time samples",
                                                     .up = UpAxis::kY,
                                                     .needs_rate = true,
                                                     .carries = all},
                                                    {.format = ExportFormat::kNpz,
                                                     .name = "npz",
                                                     .about = "arrays of NumPy",
                                                     .up = UpAxis::kY,
                                                     .carries = all}};
  return formats;
}

const FormatTraits& TraitsOf(ExportFormat format) {
  return *std::ranges::find_if(ExportFormats(),
                               [format](const FormatTraits& traits) { return traits.format == format; });
}

const char* NameOf(ExportAttribute attribute) { return NameIn(kAttributes, attribute); }
const char* NameOf(UpAxis up) { return NameIn(kUpAxes, up); }
const char* NameOf(LengthUnit unit) { return NameIn(kUnits, unit); }

absl::StatusOr<ExportFormat> ExportFormatFromName(std::string_view name) {
  std::vector<std::string> known;
  for (const FormatTraits& traits : ExportFormats()) {
    if (traits.name == name) return traits.format;
    known.emplace_back(traits.name);
  }
  return absl::InvalidArgumentError(
      absl::StrCat("--format: \"", std::string(name), "\" is not one of ", absl::StrJoin(known, ", "),
                   "; Debian 12 has no libraries of Alembic and binary USD, for which usda and the point "
                   "caches stand in"));
}

absl::StatusOr<ExportAttribute> ExportAttributeFromName(std::string_view name) {
  return ValueIn(kAttributes, "--attributes", name);
}
absl::StatusOr<UpAxis> UpAxisFromName(std::string_view name) { return ValueIn(kUpAxes, "--up", name); }
absl::StatusOr<LengthUnit> LengthUnitFromName(std::string_view name) {
  return ValueIn(kUnits, "--unit", name);
}

std::string FormatTable() {
  std::string table;
  for (const FormatTraits& traits : ExportFormats()) {
    const std::string carried = absl::StrJoin(
        traits.carries, ", ",
        [](std::string* out, ExportAttribute attribute) { absl::StrAppend(out, NameOf(attribute)); });
    absl::StrAppend(&table, absl::StrFormat("  %-5s %s, %s up: %s\n", traits.name, traits.about,
                                            NameOf(traits.up), carried));
  }
  return table;
}

}  // namespace weft
