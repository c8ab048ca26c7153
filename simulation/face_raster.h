// Which faces the rays of a camera meet first, found face by face instead of ray by ray.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "alignment/mesh.h"
#include "alignment/ray_scene.h"

namespace weft {

// Sixteen rays within a pixel, each at a moment of its own while the shutter is open.
struct RaySamples {
  static constexpr int kCount = 16;
  std::array<Eigen::Vector2f, kCount> offset;  // of their directions from the middle of the pixel
  std::array<float, kCount> moment;            // -0.5 the shutter opens, 0.5 it closes
};

// Immutable; any number of threads may ask.
class FaceRaster {
 public:
  // Vertices in camera axes; `view` holds the directions (x, y, 1) of the whole picture. Keeps references.
  FaceRaster(const std::vector<Eigen::Vector3f>& corners_mm, const std::vector<Face>& faces,
             const Eigen::AlignedBox2f& view);

  // Faces that may lie in some of these directions, each once, about from near to far.
  std::vector<int> FacesIn(const Eigen::AlignedBox2f& box) const;

  // What each direction [size * size] of a tile meets first; RayHit::face is an index into `faces`, distances
  // are along the optical axis. Directions are those of pixels next to each other, row by row; NaN meets
  // nothing.
  void Draw(const std::vector<int>& faces, const std::vector<Eigen::Vector2f>& directions, int size,
            std::vector<RayHit>* hits) const;

  // The same for the samples of some pixels, with the faces in motion: slot_of_pixel [size * size] is the
  // place of a pixel in `hits` [slots * RaySamples::kCount], -1 for none. `paths_mm` [vertices]: way of each
  // vertex during the exposure, empty at rest.
  void DrawSamples(const std::vector<int>& faces, const std::vector<Eigen::Vector2f>& directions, int size,
                   const std::vector<int>& slot_of_pixel, const RaySamples& samples,
                   const std::vector<Eigen::Vector3f>& paths_mm, std::vector<RayHit>* hits) const;

 private:
  struct Cells {
    int x0, y0, x1, y1;  // inclusive
  };
  Cells CellsOf(const Eigen::AlignedBox2f& box) const;
  class TileFrame;

  const std::vector<Eigen::Vector3f>& corners_mm_;
  const std::vector<Face>& faces_;
  Eigen::AlignedBox2f view_;
  std::vector<Eigen::AlignedBox2f> bounds_;  // [faces]; empty for faces that are not in the view
  std::vector<int> near_;                    // reach behind the camera: may show anywhere
  std::vector<int> cell_first_, in_cell_;    // faces by cell of a grid over the view
};

}  // namespace weft
