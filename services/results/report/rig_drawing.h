// A rig seen along an axis of the world, as inline SVG: cameras with their names, a scale bar.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "capture/rig/camera_model.h"

namespace weft {

// Which world axes run to the right and down the paper.
struct PaperAxes {
  std::string title;  // "From above (x to the right, z down the page)"
  int right = 0, down = 2;
};
PaperAxes FromAbove();
PaperAxes FromTheSide();

// Draws in the order of the calls; everything that is to be drawn must be held first, so that it fits.
class RigDrawing {
 public:
  explicit RigDrawing(PaperAxes axes);

  void Hold(const Eigen::Vector3d& world_mm);
  // Where a point comes to lie, in the picture's units. Valid once all is held.
  Eigen::Vector2d Place(const Eigen::Vector3d& world_mm) const;

  // SVG to be drawn below the cameras: links, points.
  void Add(const std::string& svg) { body_ += svg; }
  // A wedge that opens to where the camera looks; `css_class` is a class of the style sheet, `more` follows
  // the name in the hover text. Named cameras bear their name where there is room for it.
  void AddCamera(const CameraModel& camera, const std::string& css_class, const std::string& more,
                 bool is_named);

  // <figure>; names that found no room are counted in the caption.
  std::string Figure() const;

 private:
  struct Named {
    Eigen::Vector2d at, look;
    std::string name;
  };
  std::string Names(int* without_room) const;
  std::string ScaleBar() const;
  double Scale() const;  // picture units a mm
  Eigen::Vector2d Size() const;
  Eigen::Vector2d OnPaper(const Eigen::Vector3d& world) const {
    return {world[axes_.right], world[axes_.down]};
  }

  PaperAxes axes_;
  Eigen::Vector2d low_, high_;
  std::string body_;
  std::vector<Named> cameras_;
};

}  // namespace weft
