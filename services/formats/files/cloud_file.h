// cloud.ply: the triangulated nodes of a frame.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "alignment/align.h"
#include "alignment/template.h"
#include "services/formats/files/ply.h"
#include "triangulation/cloud.h"

namespace weft {

enum class CloudColumns { kPlain, kWithCovariance };

// Per point x y z (mm), board_row, board_col, kind (0 centre, 1 corner), views, sigma_mm and
// fold_sigma_mm, the square root of a third of the trace of fold_covariance_mm2. On request also
// cov_xx_mm2 cov_xy_mm2 cov_xz_mm2 cov_yy_mm2 cov_yz_mm2 cov_zz_mm2, and fold_cov_xx_mm2 to
// fold_cov_zz_mm2. Real numbers in single precision. Where nodes that were seen have no point, an element
// `ray` has a row for each sight of them: x y z (the camera, mm), dx dy dz (length 1), board_row, board_col,
// kind and sigma_rad. Rejected nodes are left to the report.
Ply CloudAsPly(const Cloud& cloud, CloudColumns columns);
absl::Status WriteCloud(const std::string& path, const Cloud& cloud,
                        CloudColumns columns = CloudColumns::kPlain);

// Reads a cloud; x y z, board_row and board_col are required. Defaults are kind centre, views and sigma_mm
// 0 (unknown). Without its columns fold_covariance_mm2 gets the shape of the covariance and the size of
// fold_sigma_mm. Points are ordered by node. InvalidArgument names file, row and property; a node that
// occurs twice is an error.
absl::StatusOr<Cloud> ReadCloud(const std::string& path);

// The points as ReadCloud gives them back after WriteCloud with covariances. What is computed from these is
// the same, to the last bit, whether the file was in between or not. `cloud` is ordered by node.
Cloud AsInFile(Cloud cloud);

// Targets for the alignment from a cloud by board cell, or from points with the property template_vertex (-1
// for none), which need no cells.
absl::StatusOr<CloudTargets> TargetsFromPly(const Ply& ply, const std::string& source_name,
                                            const Template& garment);

}  // namespace weft
