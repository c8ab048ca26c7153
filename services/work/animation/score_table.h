// Scores of driven meshes and of what stands beside them: one row per split, number of cameras and method.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "evaluation/driving_score.h"
#include "triangulation/triangulate.h"
#include "weft/v1/avatar.pb.h"

namespace weft {

// Of one split, number of cameras and method.
struct ScoreTally {
  DrivingScore score;
  // Distances from the registration's vertices, of those that it has a point of.
  ErrorTally from_registered_mm;
  // Of vertices near seams and of all others.
  ErrorTally at_seams_mm, off_seams_mm;
  int lost_frames = 0;
  int64_t cells = 0, views = 0;  // cells that were seen in all, and in how many views
  std::vector<double> ms;

  void AddViews(const std::vector<ViewObservations>& seen);

  ScoreTally& operator+=(const ScoreTally& other);
};

// Rows keep the order in which they were asked for first.
class ScoreTable {
 public:
  // 0 cameras: the method needs none. The reference is good until the next call.
  ScoreTally& At(const std::string& split, int cameras, const std::string& method);

  // Adds the rows of another sequence.
  ScoreTable& operator+=(const ScoreTable& other);

  // Rows without frames are left out. `threads` that the times are of.
  void WriteTo(int threads, v1::AvatarEvaluation& out) const;

 private:
  struct Key {
    std::string split;
    int cameras;
    std::string method;
    bool operator==(const Key&) const = default;
  };
  std::vector<std::pair<Key, ScoreTally>> rows_;
};

// How far takes of a data set come apart that are repeated with another time step. Errors of its files.
absl::Status AddChaosFloor(const std::string& dataset, v1::AvatarEvaluation& out);

}  // namespace weft
