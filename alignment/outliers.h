// What targets weigh, and those that no smooth cloth explains (RobustOptions).
#pragma once

#include <vector>

#include "alignment/align.h"

namespace weft {

// Of a target in E_Det, see DetectionOptions.
Eigen::Matrix3d WeightOf(const VertexTarget& target, const DetectionOptions& options);

// Distance of each target from the surface without the target, over that of an outlier.
std::vector<double> OutlierRatios(const MeshGraph& graph, const std::vector<VertexTarget>& targets,
                                  const std::vector<Eigen::Vector3d>& position_mm,
                                  const AlignOptions& options);

// The targets without outliers, those near the limit weakened.
std::vector<VertexTarget> WithoutOutliers(const std::vector<VertexTarget>& targets,
                                          const std::vector<double>& ratios, const DetectionOptions& options);

// Whether `some` are the targets that are no outliers.
bool AreAllBut(const std::vector<VertexTarget>& targets, const std::vector<double>& ratios,
               const std::vector<VertexTarget>& some);

}  // namespace weft
