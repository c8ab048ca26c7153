// AprilTags in an image, with corners that are good to a small part of a pixel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/calibration/board_view.h"
#include "capture/calibration/target.h"
#include "capture/image/frame.h"

namespace weft {

struct TagDetectionOptions {
  double max_blur_px = 2.0;  // standard deviation of a tag's edges; tags beyond are refused
  // Smallest size of a tag's modules. Small modules have overlapping edges, which bias corners outwards:
  // by 0.06 px at 2.2 px a module, less than 0.005 from 3.2 px on (edges of 0.75 px).
  double min_module_px = 2.0;
  double min_contrast = 20;  // grey values from black to white
  double gamma = 1;          // of the camera's values; light is value^gamma. Edges shift where this is wrong
  int search_reduction = 0;  // tags are searched at 1 / this size, 0: 2 from 4 Mpx on, else 1; corners are
                             // always found at full size

  absl::Status Validate() const;
};

struct TagSighting {
  std::string family;
  int id = 0;
  std::array<Eigen::Vector2d, 4> corners_px;  // top left, top right, bottom right, bottom left, as printed
  double blur_px = 0;
};

// What an image holds, and how many tags in it were refused for what reason.
struct ImageTags {
  std::vector<TagSighting> tags;
  int blurred = 0;
  double blurred_px = 0;  // median blur of those
  int small = 0;          // modules below min_module_px, or too small to tell whether their edges are sharp
  int unclear = 0;        // too little contrast, or sides that are hidden or no lines
};

// Black (0) and white (1) modules of a tag as it is printed, [width_modules][width_modules], its quiet zone
// included. InvalidArgument: no such family or id.
absl::StatusOr<std::vector<uint8_t>> TagModules(const std::string& family, int id);

// Searches with the AprilTag library (Wang and Olson, AprilTag 2, IROS 2016). Then fits each side of the
// border to the centres of the brightness steps across it, as a line that may bend with the lens. Corners
// are the intersections of the sides. Thread safety: none; one per thread. Making one takes a tenth of a
// second.
class TagDetector {
 public:
  // InvalidArgument: options or a family.
  static absl::StatusOr<std::unique_ptr<TagDetector>> Make(const std::vector<std::string>& families,
                                                           const TagDetectionOptions& options);
  ~TagDetector();

  // Errors of Frame::Validate.
  absl::StatusOr<ImageTags> Detect(const Frame& frame) const;

 private:
  TagDetector();
  struct Library;

  TagDetectionOptions options_;
  std::unique_ptr<Library> library_;
};

// The image in grey, 8 bits. Errors of Frame::Validate.
absl::StatusOr<Frame> Grey(const Frame& frame);
// The image with left and right exchanged, grey.
absl::StatusOr<Frame> MirroredGrey(const Frame& frame);

// Boards and ends of scale bars among the tags of an image, added to `views`. Tags that are no part of the
// target are left out.
void AddSightings(const CalibrationTarget& target, int camera, int frame,
                  const std::vector<TagSighting>& tags, CalibrationViews* views);

}  // namespace weft
