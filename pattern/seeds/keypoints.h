// Candidates for cell centres: bright spots between dark ink lines.
#pragma once

#include <span>
#include <vector>

#include "absl/status/status.h"
#include "pattern/image/color_image.h"

namespace weft {

// Standard deviation of the surroundings that a spot is compared with.
inline constexpr float kSurroundPx = 1.6f;

struct KeypointOptions {
  // A spot is brighter than the darkest pixel of its 7x7 neighbourhood by this much, as a ratio's logarithm.
  float min_contrast = 0.12f;

  absl::Status Validate() const;
};

struct Keypoint {
  float x_px = 0;
  float y_px = 0;
  float contrast = 0;
};

// Local maxima of BlobContrast, sub-pixel, in reading order. They cover pitches of 3 to 6.5 px; coarser cells
// are found in a smaller image.
std::vector<Keypoint> DetectKeypoints(const Plane& spots, const KeypointOptions& options);

// Keypoints by place.
class KeypointGrid {
 public:
  KeypointGrid(const std::vector<Keypoint>& points, int width_px, int height_px);

  struct Place {
    float x, y;
    int index;
  };

  // Calls visit(places) for spans of keypoints that hold all within `radius_px` of (x, y), and others around
  // them, in a fixed order; ends where it returns true.
  template <typename Visit>
  void Around(float x, float y, float radius_px, Visit visit) const;
  // Index of the nearest keypoint within `radius_px` that is not to be passed over, as passes_over(index)
  // says; -1 where there is none.
  template <typename PassesOver>
  int Nearest(float x, float y, float radius_px, PassesOver passes_over) const;

 private:
  static constexpr int kBucketPx = 4;
  int Bucket(float v, int count) const {
    const int b = static_cast<int>(v) / kBucketPx;
    return v < 0 ? 0 : (b >= count ? count - 1 : b);
  }

  int columns_, rows_;
  std::vector<int> first_;     // [rows][columns] + 1
  std::vector<Place> places_;  // by bucket
};

template <typename Visit>
void KeypointGrid::Around(float x, float y, float radius_px, Visit visit) const {
  const int c0 = Bucket(x - radius_px, columns_), c1 = Bucket(x + radius_px, columns_);
  const int r0 = Bucket(y - radius_px, rows_), r1 = Bucket(y + radius_px, rows_);
  for (int r = r0; r <= r1; ++r) {
    const int* first = &first_[static_cast<size_t>(r) * columns_];
    if (visit(std::span(places_.data() + first[c0], places_.data() + first[c1 + 1]))) return;
  }
}

template <typename PassesOver>
int KeypointGrid::Nearest(float x, float y, float radius_px, PassesOver passes_over) const {
  int nearest = -1;
  float least = radius_px * radius_px;
  Around(x, y, radius_px, [&](std::span<const Place> places) {
    for (const Place& place : places) {
      const float dx = place.x - x, dy = place.y - y, squared = dx * dx + dy * dy;
      if (squared >= least || passes_over(place.index)) continue;
      least = squared;
      nearest = place.index;
    }
    return false;
  });
  return nearest;
}

// A keypoint that is in no patch.
struct LooseBlob {
  float x_px = 0, y_px = 0;  // in the full image
  int level = 0;             // of the pyramid, where it was found
};

}  // namespace weft
