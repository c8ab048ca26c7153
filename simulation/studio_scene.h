// A printed cloth at one moment in the lit studio, ready to be seen by any camera.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/ray_scene.h"
#include "pattern/board/board.h"
#include "simulation/appearance.h"
#include "simulation/printed_mesh.h"
#include "simulation/studio_light.h"
#include "simulation/studio_room.h"

namespace weft {

struct SkinOptions {
  Eigen::Vector3f color = {0.36f, 0.21f, 0.15f};  // linear reflectance
  double variation = 0.12;                        // of its brightness from place to place, relative
  uint64_t seed = 1;
};

struct StudioOptions {
  InkOptions inks;
  FabricLookOptions fabric;
  SkinOptions skin;
  LightOptions light;
  RoomOptions room;

  absl::Status Validate() const;
};

// Surfaces in motion. Velocities [vertices] may be empty for what is at rest.
struct MovingMesh {
  TriangleMesh mesh;
  std::vector<Eigen::Vector3d> velocities_mm_s;
};

// What a ray meets: where and how to shade it.
struct ShadedPoint {
  bool printed = false;                             // the printed side of the cloth, at `board`
  Eigen::Vector2f board = Eigen::Vector2f::Zero();  // in cells
  Eigen::Vector3f plain = Eigen::Vector3f::Zero();  // reflectance of what is not printed
  float light = 0;                                  // falling on it
  Eigen::Vector2f light_by_slope =
      Eigen::Vector2f::Zero();  // change of light with the slope along board x, y
};

// Immutable; any number of threads may look at it.
class StudioScene {
 public:
  // Any mesh that carries a print of `board` will do; faces without print look like thread in the colour of
  // the lines. Casts the light in the calling thread's TBB arena. InvalidArgument: options, board or meshes
  // do not fit, named.
  static absl::StatusOr<StudioScene> Build(MovingMesh cloth, ClothPrint print, Board board, MovingMesh body,
                                           const StudioOptions& options);

  // The scene during an exposure of this length whose middle comes `offset_s` after this moment: every vertex
  // goes on at its velocity. The light stays as it is.
  absl::StatusOr<StudioScene> Exposed(double offset_s, double exposure_s) const;

  // Of the cloth, in the middle of the exposure.
  const TriangleMesh& mesh() const { return mesh_; }
  const ClothPrint& print() const { return fixed_->print; }
  const Board& board() const { return fixed_->board; }
  const StudioOptions& options() const { return fixed_->options; }
  const RayScene& rays() const { return rays_; }  // of cloth and body in the middle of the exposure
  const StudioRoom& room() const { return fixed_->room; }
  const PrintedInk& ink() const { return fixed_->ink; }

  // Cloth and body as one mesh, the cloth first: faces, places in the middle of the exposure, ways during it
  // (empty at rest).
  const std::vector<Face>& faces() const { return fixed_->faces; }
  const std::vector<Eigen::Vector3d>& places_mm() const { return places_mm_; }
  const std::vector<Eigen::Vector3d>& paths_mm() const { return paths_mm_; }
  bool IsCloth(int face) const { return face < static_cast<int>(fixed_->print.of_face.size()); }
  Eigen::Vector3d CenterMm() const;

  // `weights` are barycentric.
  ShadedPoint ShadeAt(int face, bool from_outside, const Eigen::Vector3f& weights) const;

 private:
  // What stays while the cloth moves on.
  struct Fixed {
    StudioOptions options;
    ClothPrint print;
    Board board;
    PrintedInk ink;
    StudioRoom room;
    std::vector<Face> faces;
    size_t cloth_vertices = 0;
    std::vector<Eigen::Vector3d> places_mm, velocities_mm_s;  // velocities empty at rest
    RayScene rays;                                            // of the places
    std::vector<float> outside, inside;                       // light per vertex
    std::vector<Eigen::Vector2f> light_by_slope;              // per vertex of the cloth
  };
  static void LightUp(Fixed& fixed);
  static std::vector<Eigen::Vector2f> LightBySlope(const Fixed& fixed, const VertexLight& light);

  std::shared_ptr<const Fixed> fixed_;
  TriangleMesh mesh_;
  std::vector<Eigen::Vector3d> places_mm_, paths_mm_;
  RayScene rays_;
};

}  // namespace weft
