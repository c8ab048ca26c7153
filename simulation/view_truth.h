// What a camera could see at best: exact positions and visibility of the board's nodes in a view.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "alignment/ray_scene.h"
#include "capture/rig/camera_model.h"
#include "pattern/observation.h"
#include "simulation/printed_mesh.h"

namespace weft {

// A node of the board in one view.
struct NodeTruth {
  BoardNode node;
  int vertex = -1;  // the mesh's vertex at a centre; -1 where there is none (cut cells), and for corners
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  // Square root of the area of the projected cell (corner: of the unit square around it).
  double pitch_px = 0;
  double facing_deg = 0;   // between the mean normal of its points and the direction to the camera
  bool visible = false;    // the node is in sight and at least 5 of 9 points of its cell are
  bool scoreable = false;  // expected to be found, see ScoreableOptions
};

// A node is scoreable when it is visible, the cloth carries its whole cell (corner: a cell on each side), and
// it is large and faces the camera.
struct ScoreableOptions {
  double min_pitch_px = 3;
  double max_facing_deg = 70;
};

// The nodes of which at least one of the 9 points is visible, with their position in the image; ordered by
// kind, row, column. Where a panel's edge cuts off a cell's centre, its position extrapolates the print;
// such a node is never visible. A node on a seam, which the cloth has twice, appears once, at the face of
// lowest index.
struct ViewTruth {
  std::string camera_id;
  std::vector<NodeTruth> nodes;
};

// All that is true of one frame.
struct FrameTruth {
  TriangleMesh mesh;             // vertices in the template's order
  std::vector<ViewTruth> views;  // ordered by camera
};

// Parallel over rows of the board in the calling thread's TBB arena; the same result at any thread count.
ViewTruth FindViewTruth(const TriangleMesh& mesh, const PrintLocator& print, const RayScene& rays,
                        const CameraModel& camera, const ScoreableOptions& options = {});

}  // namespace weft
