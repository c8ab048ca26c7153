// How good a result is, measured against the truth.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "evaluation/error_tally.h"
#include "evaluation/truth_by_node.h"
#include "pattern/observation.h"
#include "simulation/view_truth.h"
#include "triangulation/cloud.h"

namespace weft {

// What a job made of one frame; pieces that it did not write stay empty and are not scored.
struct CameraObservations {
  std::string camera_id;
  std::vector<Observation> observations;
};
struct ResultPieces {
  std::optional<std::vector<CameraObservations>> observations;
  std::optional<Cloud> cloud;
  std::optional<std::vector<Eigen::Vector3d>> mesh_mm;  // vertices in the template's order
  const TruthByNode* by_node = nullptr;                 // where that template is not the truth's own
};

struct EvaluationOptions {
  double right_within_pitch = 0.5;  // an observation is right this near to its node, in pitches of the node
  double covered_within_mm = 1.0;   // a vertex is covered by a point this near to it
  int well_seen_views = 3;          // a vertex is well seen when its cell is scoreable in so many views

  absl::Status Validate() const;
};

// Ratios are empty when there is nothing to divide by. Scores of frames add up with +=.

// Decoding of one kind of node. An observation is right when its node is visible, at least in part, and
// close to it. Of two observations of a node in a view only the closer one is right.
struct DecodeScore {
  // Scoreable nodes by their size in the picture: from this many pixels on, up to the next class.
  static constexpr std::array<double, 5> kPitchClassesPx = {3, 4, 5, 7, 10};
  struct PitchClass {
    int64_t scoreable = 0, found = 0;
  };

  int64_t observations = 0;
  int64_t right = 0;
  int64_t out_of_sight = 0;  // observations of nodes that the view does not see
  int64_t scoreable = 0;     // nodes that should be found
  int64_t found = 0;         // of them
  std::array<PitchClass, kPitchClassesPx.size()> by_pitch;
  ErrorTally errors_px;  // of the right observations
  // Of the wrong ones whose node is in sight. Where cloth turns away pitches go to zero, and a small error is
  // more than half of one.
  ErrorTally wrong_px;

  // Which class a scoreable node belongs to.
  static size_t PitchClassOf(double pitch_px);
  std::optional<double> Precision() const;
  std::optional<double> Recall() const;
  DecodeScore& operator+=(const DecodeScore& other);
};

// The cloud's cell centres; its corners are not scored, since they have no vertex.
struct CloudScore {
  int64_t points = 0;
  int64_t points_of_unseen_cells = 0;  // of cells that no view sees: they cannot be right
  int64_t well_seen = 0;               // vertices
  int64_t covered = 0;                 // of them
  ErrorTally errors_mm;                // distance to the vertex, of all points whose cell is seen

  std::optional<double> Coverage() const;
  CloudScore& operator+=(const CloudScore& other);
};

// Distance of each vertex to its true position. Against a truth of another template, of those vertices alone
// whose place on the true cloth the board tells.
struct MeshScore {
  ErrorTally visible_mm;  // of vertices that are well seen
  ErrorTally hidden_mm;   // of all others, those without a cell among them
  // Of the visible ones that have a point in the cloud, in one order: error of the vertex and of the point.
  // Both stay empty without a cloud, and for a template that is not the truth's own.
  ErrorTally with_point_mm, point_mm;
  int64_t far = 0;  // of the visible ones

  // Share of the visible ones that are farther than this from their place.
  static constexpr double kFarMm = 5;
  std::optional<double> FarShare() const;
  MeshScore& operator+=(const MeshScore& other);
};

struct FrameScore {
  std::optional<DecodeScore> centers;
  std::optional<DecodeScore> corners;  // empty as well when there is no observation of a corner
  std::optional<CloudScore> cloud;
  std::optional<MeshScore> mesh;

  FrameScore& operator+=(const FrameScore& other);  // a missing piece adds nothing
  // Keeps summaries of errors alone.
  void Seal();
};

// Whether enough views see a vertex well, [vertices of the result]. `by_node` as in ResultPieces.
std::vector<bool> WellSeenVertices(const FrameTruth& truth, const TruthByNode* by_node,
                                   const EvaluationOptions& options = {});

// InvalidArgument: observations of a camera that the truth does not know, a camera twice, a mesh with another
// number of vertices, or with vertices that are not finite.
absl::StatusOr<FrameScore> Evaluate(const FrameTruth& truth, const ResultPieces& result,
                                    const EvaluationOptions& options = {});

}  // namespace weft
