// Minimises data terms + lambda E_Dist (paper, Eq. 1 to 5) over positions and rotations of all vertices.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/distortion.h"
#include "alignment/elastic_preconditioner.h"
#include "alignment/elastic_problem.h"
#include "alignment/sliced_mesh.h"

namespace weft {

// Corrections kept by the quasi-Newton method; each costs four passes over the mesh in an iteration. On worn
// T-shirts of the data set shirt-drive-12 (six frames of validation, a quarter hidden, 0.5 mm of noise) 3
// take 27 + 24 iterations, stiff and elastic, and 5 take 28 + 25, to the same errors.
inline constexpr int kCorrections = 3;

// Asked now and then, from the calling thread; true ends the work with Cancelled.
using CancelCheck = std::function<bool()>;

struct ElasticReport {
  int iterations = 0;
  int evaluations = 0;
  double energy_before = 0, energy_after = 0;
  bool converged = false;
};

// Per-vertex rigid fit (ARAP's local step, Sorkine & Alexa 2007): the rotation that maps a vertex's rest
// edges to the edges at the present positions by least squares. The iteration starts from the rotation in
// `state`.
void FitRigid(const SlicedMesh& mesh, Deformation* state);

// A local/global method as quasi-Newton. At fixed positions the rotations are fitted vertex by vertex
// (local step). At fixed rotations the energy is quadratic with the matrix W + stretch lambda L (global
// step), where L is the mesh's graph Laplacian. Minimised by L-BFGS over the positions, with rotations
// eliminated by the local step and that matrix as the preconditioner. `state` holds the start and receives
// the result. Cancelled: `cancelled` said so, `state` is as it was. Deterministic at any thread count.
absl::StatusOr<ElasticReport> SolveElastic(const SlicedMesh& mesh, const MeshGraph& graph,
                                           const ElasticProblem& problem, const ElasticOptions& options,
                                           Deformation* state, const CancelCheck& cancelled = nullptr);
// The same with a preconditioner of the problem, for several solves.
absl::StatusOr<ElasticReport> SolveElastic(const SlicedMesh& mesh, const ElasticProblem& problem,
                                           const ElasticPreconditioner& preconditioner,
                                           const ElasticOptions& options, Deformation* state,
                                           const CancelCheck& cancelled = nullptr);

}  // namespace weft
