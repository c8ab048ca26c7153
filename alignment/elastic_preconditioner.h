// Approximate inverse of the elastic solver's global step.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/elastic_problem.h"
#include "alignment/mesh_graph.h"
#include "alignment/single_factor.h"
#include "alignment/sliced_mesh.h"

namespace weft {

// Of W + stretch lambda L (SolveElastic): the block of weakly held vertices, which move together over long
// distances, is factorised; the others use its diagonal. Frozen ones do not move.
class ElasticPreconditioner {
 public:
  // Depends on the problem's weights and frozen vertices, and on lambda and stretch.
  static absl::StatusOr<ElasticPreconditioner> Build(const SlicedMesh& mesh, const MeshGraph& graph,
                                                     const ElasticProblem& problem,
                                                     const ElasticOptions& options);

  void Apply(const Field3& in, Field3* out) const;

 private:
  std::vector<float> inverse_diagonal_;
  std::vector<int> weak_;
  SingleFactor factor_;
};

}  // namespace weft
