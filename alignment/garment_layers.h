// Which of several garments lies over which, and hidden cloth that is on the wrong side.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/elastic_solver.h"
#include "alignment/mesh.h"
#include "alignment/ray_scene.h"
#include "alignment/template.h"

namespace weft {

// Hidden vertices of one garment that lie on the wrong side of another are drawn through it. The removal of
// self-intersections misses them: a waistband that lies over the shirt instead of under it crosses nothing.
struct LayerOptions {
  double weight = 1;  // against E_Dist; 0 leaves the stage out
  // Whether each frame tells which garment lies over which. Else the order of the template holds, from the
  // innermost garment to the outermost.
  bool find_order = true;
  double reach_mm = 40;  // cloth that is further apart does not lie over each other

  absl::Status Validate() const;
};

// Positions in Template::garments.
struct GarmentPair {
  int inner = 0, outer = 0;

  bool operator==(const GarmentPair&) const = default;
};

// The garments of a joint template in one frame. Thread safety: const functions may be called from any number
// of threads.
class GarmentLayers {
 public:
  // The garments must have passed CheckGarmentSpans. Errors: of RayScene::Build.
  static absl::StatusOr<GarmentLayers> Build(const std::vector<GarmentSpan>& garments,
                                             const std::vector<Face>& faces,
                                             const std::vector<Eigen::Vector3d>& position_mm);

  // The pairs of which one lies over the other, ordered. Cameras see the outer garment and nothing of the
  // inner one below it. So each measured vertex with hidden cloth of another garment within reach, along its
  // normal, tells of an order. Pairs are left out of which few vertices tell, or which contradict each other.
  // Without `find_order` all pairs are in. `hidden`: [vertices], those that were not measured.
  std::vector<GarmentPair> Order(const std::vector<bool>& hidden, const LayerOptions& options) const;

  // Draws hidden vertices on the wrong side through the other garment, along their normal and a little
  // further; where both are hidden, the inner one gives way. Returns how many.
  int Draw(const std::vector<GarmentPair>& pairs, const std::vector<bool>& hidden,
           const LayerOptions& options, ElasticProblem* problem) const;

 private:
  struct Crossing {
    double distance_mm = 0;
    bool from_outside = false;
    bool hidden = false;  // the face that is met, with all its corners
  };
  // The first face of a garment on the way from a vertex along its normal (sign 1) or against it (-1).
  std::optional<Crossing> Meets(int vertex, int sign, int garment, const std::vector<bool>& hidden,
                                double reach_mm) const;
  int VotesOver(int over, int under, const std::vector<bool>& hidden, double reach_mm) const;
  int DrawGarment(int garment, int other, int sign, const std::vector<bool>& hidden,
                  const LayerOptions& options, ElasticProblem* problem) const;

  std::vector<GarmentSpan> garments_;
  std::vector<std::vector<Face>> faces_;  // [garments]
  std::vector<RayScene> scenes_;          // [garments]
  std::vector<Eigen::Vector3d> position_mm_, normals_;
};

}  // namespace weft
