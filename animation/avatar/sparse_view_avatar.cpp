#include "animation/avatar/sparse_view_avatar.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

absl::Status BadAvatar(const std::string& what) { return absl::InvalidArgumentError("avatar: " + what); }

bool AllPositive(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x) && x > 0; });
}

AvatarTable Table(const char* name, size_t rows, size_t columns, std::vector<float> values) {
  return {name, static_cast<int>(rows), static_cast<int>(columns), false, std::move(values)};
}

// A table of so many rows and columns; -1: any number.
absl::StatusOr<const AvatarTable*> FindTable(const std::map<std::string, const AvatarTable*>& tables,
                                             const std::string& name, int rows, int columns) {
  const auto found = tables.find(name);
  if (found == tables.end()) return BadAvatar(absl::StrCat("the table \"", name, "\" is missing"));
  const AvatarTable& table = *found->second;
  const bool fits =
      table.rows > 0 && table.columns > 0 && (rows < 0 || table.rows == rows) &&
      (columns < 0 || table.columns == columns) &&
      table.values.size() == static_cast<size_t>(table.rows) * static_cast<size_t>(table.columns);
  if (!fits)
    return BadAvatar(absl::StrCat("the table \"", name, "\" is ", table.rows, " x ", table.columns,
                                  ", which does not fit the others"));
  return found->second;
}

}  // namespace

absl::Status SparseViewTraining::Validate() const {
  if (components < 1 || components > 256) return BadAvatar("components must be 1 to 256");
  if (max_frames < 10) return BadAvatar("max_frames must be at least 10");
  if (calibration_frames < 1) return BadAvatar("calibration_frames must be at least 1");
  return absl::OkStatus();
}

bool AvatarNet::IsOfUse() const {
  double before = 0, after = 0;
  for (const NetGain& of_cameras : gain)
    before += of_cameras.frames * of_cameras.before_mm, after += of_cameras.frames * of_cameras.after_mm;
  return after < before;
}

absl::Status SparseViewAvatar::Validate() const {
  WEFT_RETURN_IF_ERROR(space.Validate());
  const size_t vertices = static_cast<size_t>(space.vertices);
  if (!(fps > 0) || !std::isfinite(fps)) return BadAvatar("fps must be positive");
  if (acceleration.size() != space.sigma_mm.size() || !AllPositive(acceleration))
    return BadAvatar("the accelerations must be positive, one per component");
  if (left_mm.size() != vertices || !AllPositive(left_mm))
    return BadAvatar("what the space leaves must be positive, one number per vertex");
  if (edge_mm.size() != edge_spread_mm.size() || !AllPositive(edge_mm) || !AllPositive(edge_spread_mm))
    return BadAvatar("lengths of edges and their spreads must be positive and as many");
  if (edge_follow.size() != edge_mm.size() ||
      !std::all_of(edge_follow.begin(), edge_follow.end(), [](float f) { return f >= 0 && f <= 1; }))
    return BadAvatar("the shares by which edges follow the carrier must be 0 to 1, one per edge");
  for (const auto& of_cameras : sigma.of)
    for (const float scale : of_cameras)
      if (!std::isfinite(scale) || scale <= 0) return BadAvatar("the scales of sigma must be positive");
  return absl::OkStatus();
}

absl::Status CheckLearntWith(const std::string& template_hash, const std::string& board_hash,
                             const Template& garment) {
  const std::string hash = garment.ContentHash();
  if (board_hash != garment.board_hash)
    return absl::FailedPreconditionError(absl::StrCat("the avatar was learnt on a garment of board ",
                                                      board_hash, ", the template is of board ",
                                                      garment.board_hash));
  if (template_hash != hash)
    return absl::FailedPreconditionError(absl::StrCat("the avatar was learnt with template ", template_hash,
                                                      ", this one is ", hash, " (", garment.id, ")"));
  return absl::OkStatus();
}

absl::Status SparseViewAvatar::CheckFits(const Template& garment) const {
  WEFT_RETURN_IF_ERROR(CheckLearntWith(template_hash, board_hash, garment));
  if (static_cast<size_t>(space.vertices) != garment.rest.vertices_mm.size())
    return absl::FailedPreconditionError(absl::StrCat(
        "the avatar has ", space.vertices, " vertices, the template ", garment.rest.vertices_mm.size()));
  return absl::OkStatus();
}

std::vector<AvatarTable> TablesOf(const SparseViewAvatar& avatar) {
  const ShapeSpace& space = avatar.space;
  const size_t components = space.sigma_mm.size(), size = space.mean_mm.size();
  std::vector<float> scales;
  for (const auto& of_cameras : avatar.sigma.of)
    scales.insert(scales.end(), of_cameras.begin(), of_cameras.end());
  std::vector<AvatarTable> out = {
      Table("mean_mm", 1, size, space.mean_mm),
      Table("basis", components, size, space.basis),
      Table("component_sigma_mm", 1, components, space.sigma_mm),
      Table("space_left_mm", 1, 1, {static_cast<float>(space.left_mm)}),
      Table("acceleration", 1, components, avatar.acceleration),
      Table("edge_mm", 1, avatar.edge_mm.size(), avatar.edge_mm),
      Table("edge_follow", 1, avatar.edge_follow.size(), avatar.edge_follow),
      Table("edge_spread_mm", 1, avatar.edge_spread_mm.size(), avatar.edge_spread_mm),
      Table("left_mm", 1, avatar.left_mm.size(), avatar.left_mm),
      Table("sigma_factors", SigmaScale::kCameras, SigmaScale::kRays, std::move(scales)),
  };
  out[1].sixteen_bits = true;
  return out;
}

absl::Status TakeTables(const std::vector<AvatarTable>& tables, SparseViewAvatar* avatar) {
  std::map<std::string, const AvatarTable*> named;
  for (const AvatarTable& table : tables) named.emplace(table.name, &table);
  ShapeSpace& space = avatar->space;
  int vertices3 = -1, components = -1, edges = -1;
  const auto take = [&](const char* name, int rows, int columns, std::vector<float>* out) -> absl::Status {
    const absl::StatusOr<const AvatarTable*> table = FindTable(named, name, rows, columns);
    if (table.ok()) *out = (*table)->values;
    return table.status();
  };
  absl::Status status = take("mean_mm", 1, -1, &space.mean_mm);
  if (!status.ok()) return status;
  vertices3 = static_cast<int>(space.mean_mm.size());
  if (vertices3 % 3 != 0) return BadAvatar("the mean has no three numbers for each vertex");
  space.vertices = vertices3 / 3;
  if (status = take("component_sigma_mm", 1, -1, &space.sigma_mm); !status.ok()) return status;
  components = static_cast<int>(space.sigma_mm.size());
  std::vector<float> left, scales;
  status.Update(take("basis", components, vertices3, &space.basis));
  status.Update(take("space_left_mm", 1, 1, &left));
  status.Update(take("acceleration", 1, components, &avatar->acceleration));
  status.Update(take("left_mm", 1, space.vertices, &avatar->left_mm));
  status.Update(take("edge_mm", 1, -1, &avatar->edge_mm));
  edges = static_cast<int>(avatar->edge_mm.size());
  status.Update(take("edge_spread_mm", 1, edges, &avatar->edge_spread_mm));
  avatar->edge_follow.assign(avatar->edge_mm.size(), 0);
  if (named.contains("edge_follow")) status.Update(take("edge_follow", 1, edges, &avatar->edge_follow));
  avatar->sigma = TypicalSigmaScale();
  if (named.contains("sigma_factors"))
    status.Update(take("sigma_factors", SigmaScale::kCameras, SigmaScale::kRays, &scales));
  if (!status.ok()) return status;
  space.left_mm = left[0];
  if (scales.empty()) return absl::OkStatus();
  for (int cameras = 0; cameras < SigmaScale::kCameras; ++cameras)
    std::copy_n(scales.begin() + cameras * SigmaScale::kRays, SigmaScale::kRays,
                avatar->sigma.of[cameras].begin());
  return absl::OkStatus();
}

}  // namespace weft
