#include "animation/paper/pixel_avatar.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

const AvatarTable* TableNamed(const std::vector<AvatarTable>& tables, const std::string& name) {
  const auto found = std::find_if(tables.begin(), tables.end(),
                                  [&](const AvatarTable& table) { return table.name == name; });
  if (found == tables.end()) return nullptr;
  const bool is_whole =
      found->rows > 0 && found->columns > 0 &&
      found->values.size() == static_cast<size_t>(found->rows) * static_cast<size_t>(found->columns);
  return is_whole ? &*found : nullptr;
}

absl::Status BadPixelAvatar(const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat("avatar of pixels: ", what));
}

}  // namespace

absl::Status PixelAvatar::Validate() const {
  WEFT_RETURN_IF_ERROR(graph.Validate());
  if (prior.nodes() < 2 || prior.nodes() > graph.nodes)
    return BadPixelAvatar("it has a prior of another graph");
  WEFT_RETURN_IF_ERROR(prior.Validate(prior.nodes()));
  if (!(fps > 0) || !std::isfinite(fps)) return BadPixelAvatar("fps must be positive");
  if (!(left_mm >= 0) || !std::isfinite(left_mm)) return BadPixelAvatar("left_mm must not be negative");
  if (net.empty()) return BadPixelAvatar("it has no net");
  return net.atlas.Validate();
}

absl::Status PixelAvatar::CheckFits(const Template& garment) const {
  return CheckLearntWith(template_hash, board_hash, garment);
}

std::vector<AvatarTable> TablesOf(const PixelAvatar& avatar) {
  std::vector<AvatarTable> out = {
      {"graph",
       1,
       2,
       false,
       {static_cast<float>(avatar.graph.nodes), static_cast<float>(avatar.graph.nodes_of_vertex)}},
      {"unit", 1, static_cast<int>(avatar.prior.unit.size()), false, avatar.prior.unit}};
  for (size_t k = 0; k < avatar.prior.layers.size(); ++k) {
    const PriorLayer& layer = avatar.prior.layers[k];
    out.push_back({absl::StrCat("weight", k), layer.to, layer.from, false, layer.weight});
    out.push_back({absl::StrCat("bias", k), 1, layer.to, false, layer.bias});
  }
  return out;
}

absl::Status TakeTables(const std::vector<AvatarTable>& tables, PixelAvatar* avatar) {
  const AvatarTable *graph = TableNamed(tables, "graph"), *unit = TableNamed(tables, "unit");
  if (graph == nullptr || graph->values.size() != 2) return BadPixelAvatar("the table \"graph\" is missing");
  if (unit == nullptr || unit->rows != 1) return BadPixelAvatar("the table \"unit\" is missing");
  for (const float value : graph->values)
    if (!(value >= 1 && value <= 1000)) return BadPixelAvatar("the table \"graph\" makes no sense");
  avatar->graph = {static_cast<int>(graph->values[0]), static_cast<int>(graph->values[1])};
  avatar->prior.unit = unit->values;
  avatar->prior.layers = LayersOf(tables);
  return absl::OkStatus();
}

std::vector<PriorLayer> LayersOf(const std::vector<AvatarTable>& tables) {
  std::vector<PriorLayer> out;
  for (int k = 0;; ++k) {
    const AvatarTable *weight = TableNamed(tables, absl::StrCat("weight", k)),
                      *bias = TableNamed(tables, absl::StrCat("bias", k));
    if (weight == nullptr || bias == nullptr) return out;
    out.push_back({weight->columns, weight->rows, weight->values, bias->values});
  }
}

}  // namespace weft
