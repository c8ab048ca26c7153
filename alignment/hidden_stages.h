// Vertices that were not measured, once the measured ones stand (paper, section 5.4.2, Eq. 3 and 4).
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "alignment/elastic_solver.h"
#include "alignment/mesh.h"
#include "alignment/scan.h"

namespace weft {

// E_Push (Eq. 3): hidden cloth more likely lies inside than outside, so each hidden vertex is drawn against
// its normal.
struct PushOptions {
  double weight = 0;    // against E_Dist; 0 leaves the stage out
  double depth_mm = 1;  // epsilon of Eq. 3

  absl::Status Validate() const;
};

// E_Recon (Eq. 4): hidden vertices are drawn to a scan, where there is one.
struct ReconOptions {
  double weight = 1;  // against E_Dist; 0 leaves the stage out
  double tangential_share =
      0.1;  // of the weight along the surface, where the scan tells nothing; Eq. 4 has 1
  AssociationOptions association;

  absl::Status Validate() const;
};

// Adds Eq. 3 for the vertices for which `hidden` holds, S_0 being `position_mm`.
void AddPush(const std::vector<Eigen::Vector3d>& position_mm, const std::vector<Face>& faces,
             const std::vector<bool>& hidden, const PushOptions& options, ElasticProblem* problem);

// Adds Eq. 4 with the association at `position_mm`; returns the number of vertices that the scan draws.
int AddRecon(const Scan& scan, const std::vector<Eigen::Vector3d>& position_mm,
             const std::vector<Face>& faces, const std::vector<bool>& hidden, const ReconOptions& options,
             ElasticProblem* problem);

}  // namespace weft
