#include "services/results/export/export_transform.h"

#include <array>
#include <string>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

struct WorldUp {
  std::string_view name;
  std::array<std::array<double, 3>, 3> y_up_from_world;
};

constexpr std::array<WorldUp, 6> kWorldUps = {{{"y", {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}},
                                               {"-y", {{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}}},
                                               {"z", {{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}}},
                                               {"-z", {{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}}},
                                               {"x", {{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}}},
                                               {"-x", {{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}}}}}};

double UnitPerMm(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::kMetre:
      return 1e-3;
    case LengthUnit::kCentimetre:
      return 0.1;
    case LengthUnit::kMillimetre:
      return 1;
  }
  return 1;
}

}  // namespace

absl::StatusOr<ExportTransform> ExportTransform::Make(UpAxis up, std::string_view world_up, LengthUnit unit) {
  for (const WorldUp& known : kWorldUps) {
    if (known.name != world_up) continue;
    ExportTransform transform{up, unit, {}, UnitPerMm(unit)};
    Eigen::Matrix3d y_up;
    for (int row = 0; row < 3; ++row)
      for (int col = 0; col < 3; ++col) y_up(row, col) = known.y_up_from_world[row][col];
    Eigen::Matrix3d z_up_from_y_up;
    z_up_from_y_up << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    transform.rotation = up == UpAxis::kY ? y_up : Eigen::Matrix3d(z_up_from_y_up * y_up);
    return transform;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("--world-up: \"", std::string(world_up), "\" is not one of x, -x, y, -y, z, -z"));
}

}  // namespace weft
