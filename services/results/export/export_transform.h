// From the rig's world to the axes and the unit of an export.
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "absl/status/statusor.h"
#include "services/results/export/export_format.h"

namespace weft {

struct ExportTransform {
  UpAxis up = UpAxis::kY;
  LengthUnit unit = LengthUnit::kMetre;
  // export_from_world is `unit_per_mm * rotation`; the rotation has entries 0, 1 and -1.
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  double unit_per_mm = 1e-3;

  // `world_up`: the axis of the rig's world that points up: x, -x, y, -y, z or -z. x stays x unless it points
  // up itself. InvalidArgument: another axis.
  static absl::StatusOr<ExportTransform> Make(UpAxis up, std::string_view world_up, LengthUnit unit);

  Eigen::Vector3f Position(const Eigen::Vector3d& world_mm) const {
    return (unit_per_mm * (rotation * world_mm)).cast<float>();
  }
};

}  // namespace weft
