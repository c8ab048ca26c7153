#include "capture/calibration/tag_detection.h"

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
}

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/status_macros.h"
#include "capture/calibration/edge_lines.h"

namespace weft {
namespace {

struct FamilyMaker {
  const char* name;
  apriltag_family_t* (*make)();
  void (*destroy)(apriltag_family_t*);
};
constexpr FamilyMaker kMakers[] = {{"tag36h11", tag36h11_create, tag36h11_destroy},
                                   {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy}};

const FamilyMaker* MakerOf(const std::string& family) {
  for (const FamilyMaker& maker : kMakers) {
    if (family == maker.name) return &maker;
  }
  return nullptr;
}

absl::Status UnknownFamily(const std::string& family) {
  return absl::InvalidArgumentError(
      absl::StrCat("tag family \"", family, "\" is unknown; known are tag36h11 and tagStandard41h12"));
}

LightImage ToLight(const Frame& grey, double gamma) {
  std::array<float, 256> light;
  for (int v = 0; v < 256; ++v) light[v] = static_cast<float>(255 * std::pow(v / 255.0, gamma));
  LightImage out{grey.width_px, grey.height_px, std::vector<float>(grey.pixels->size())};
  std::transform(grey.pixels->begin(), grey.pixels->end(), out.values.begin(),
                 [&](uint8_t v) { return light[v]; });
  return out;
}

double ShortestSidePx(const std::array<Eigen::Vector2d, 4>& corners) {
  double shortest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 4; ++k) shortest = std::min(shortest, (corners[(k + 1) % 4] - corners[k]).norm());
  return shortest;
}

}  // namespace

struct TagDetector::Library {
  apriltag_detector_t* detector = nullptr;
  std::vector<std::pair<apriltag_family_t*, void (*)(apriltag_family_t*)>> families;

  ~Library() {
    if (detector) apriltag_detector_destroy(detector);
    for (const auto& [family, destroy] : families) destroy(family);
  }
};

TagDetector::TagDetector() : library_(std::make_unique<Library>()) {}
TagDetector::~TagDetector() = default;

absl::Status TagDetectionOptions::Validate() const {
  if (!(max_blur_px > 0)) return absl::InvalidArgumentError("max_blur_px must be positive");
  if (!(min_module_px >= 1)) return absl::InvalidArgumentError("min_module_px must be at least 1");
  if (!(min_contrast > 0)) return absl::InvalidArgumentError("min_contrast must be positive");
  if (!(gamma > 0.2 && gamma < 5)) return absl::InvalidArgumentError("gamma must be 0.2 to 5");
  if (search_reduction < 0 || search_reduction > 8)
    return absl::InvalidArgumentError("search_reduction must be 0 to 8");
  return absl::OkStatus();
}

absl::StatusOr<std::vector<uint8_t>> TagModules(const std::string& family, int id) {
  const FamilyMaker* maker = MakerOf(family);
  if (!maker) return UnknownFamily(family);
  apriltag_family_t* made = maker->make();
  if (id < 0 || id >= static_cast<int>(made->ncodes)) {
    const int codes = static_cast<int>(made->ncodes);
    maker->destroy(made);
    return absl::InvalidArgumentError(
        absl::StrCat("tag id ", id, " is not in ", family, " (0 to ", codes - 1, ")"));
  }
  // A white ring around the border square, or just inside where the border is reversed; data bits by their
  // places.
  const int width = made->total_width, ring = made->width_at_border + (made->reversed_border ? 0 : 2);
  const int first = (width - ring) / 2, last = first + ring - 1;
  std::vector<uint8_t> out(static_cast<size_t>(width) * width, 0);
  for (int i = first; i <= last; ++i) {
    for (const int at : {first * width + i, last * width + i, i * width + first, i * width + last})
      out[at] = 1;
  }
  const int border = (width - made->width_at_border) / 2;
  for (uint32_t bit = 0; bit < made->nbits; ++bit) {
    const bool white = made->codes[id] >> (made->nbits - 1 - bit) & 1;
    // Places outside of a reversed border are negative, held in unsigned numbers.
    const int x = static_cast<int>(made->bit_x[bit]) + border,
              y = static_cast<int>(made->bit_y[bit]) + border;
    out[y * width + x] = white;
  }
  maker->destroy(made);
  return out;
}

absl::StatusOr<std::unique_ptr<TagDetector>> TagDetector::Make(const std::vector<std::string>& families,
                                                               const TagDetectionOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  std::unique_ptr<TagDetector> out(new TagDetector);
  out->options_ = options;
  out->library_->detector = apriltag_detector_create();
  out->library_->detector->nthreads = 1;
  for (const std::string& family : families) {
    const FamilyMaker* maker = MakerOf(family);
    if (!maker) return UnknownFamily(family);
    out->library_->families.emplace_back(maker->make(), maker->destroy);
    // One wrong bit is put right; more would find tags where there are none.
    apriltag_detector_add_family_bits(out->library_->detector, out->library_->families.back().first, 1);
  }
  return out;
}

absl::StatusOr<ImageTags> TagDetector::Detect(const Frame& frame) const {
  WEFT_ASSIGN_OR_RETURN(const Frame grey, Grey(frame));
  const int reduction = options_.search_reduction > 0 ? options_.search_reduction
                        : static_cast<int64_t>(grey.width_px) * grey.height_px >= 4'000'000 ? 2
                                                                                            : 1;
  library_->detector->quad_decimate = static_cast<float>(reduction);
  const LightImage light = ToLight(grey, options_.gamma);
  // The library only reads the pixels.
  image_u8_t image = {grey.width_px, grey.height_px, grey.width_px,
                      const_cast<uint8_t*>(grey.pixels->data())};
  zarray_t* found = apriltag_detector_detect(library_->detector, &image);

  ImageTags out;
  std::vector<double> blurs;
  for (int i = 0; i < zarray_size(found); ++i) {
    apriltag_detection_t* tag = nullptr;
    zarray_get(found, i, &tag);
    TagSighting sighting;
    sighting.family = tag->family->name;
    sighting.id = tag->id;
    // The library counts from the lower left, against the clock, and puts the middle of a pixel at one half.
    std::array<Eigen::Vector2d, 4> rough;
    for (int k = 0; k < 4; ++k) rough[k] = Eigen::Vector2d(tag->p[3 - k][0], tag->p[3 - k][1]).array() - 0.5;
    if (ShortestSidePx(rough) < options_.min_module_px * tag->family->width_at_border) {
      ++out.small;
      continue;
    }
    const std::optional<SharpSquare> sharp = SharpenSquare(
        light, rough, {tag->family->width_at_border, !tag->family->reversed_border, options_.min_contrast});
    if (!sharp) {
      ++out.unclear;
      continue;
    }
    constexpr double kAnyBlur = 0.95;     // of the limit
    constexpr double kSharpLensPx = 0.8;  // of edges in pictures that nobody would call blurred
    const double seen_px = kAnyBlur * sharp->blur_limit_px;
    if (sharp->blur_px > options_.max_blur_px || (sharp->blur_px > seen_px && seen_px > kSharpLensPx)) {
      blurs.push_back(sharp->blur_px);
      continue;
    }
    // Modules so small that they hide the blur of a sharp lens: size is what is wrong.
    if (sharp->blur_px > seen_px) {
      ++out.small;
      continue;
    }
    sighting.corners_px = sharp->corners_px;
    sighting.blur_px = sharp->blur_px;
    out.tags.push_back(sighting);
  }
  apriltag_detections_destroy(found);
  out.blurred = static_cast<int>(blurs.size());
  out.blurred_px = Median(std::move(blurs));
  std::sort(out.tags.begin(), out.tags.end(), [](const TagSighting& a, const TagSighting& b) {
    return std::tie(a.family, a.id, a.corners_px[0].x()) < std::tie(b.family, b.id, b.corners_px[0].x());
  });
  return out;
}

absl::StatusOr<Frame> Grey(const Frame& frame) {
  if (frame.format == PixelFormat::kGrey8) {
    WEFT_RETURN_IF_ERROR(frame.Validate());
    return frame;
  }
  WEFT_ASSIGN_OR_RETURN(const Frame rgb, ToRgb(frame));
  Frame grey = rgb;
  grey.format = PixelFormat::kGrey8;
  auto values = std::make_shared<std::vector<uint8_t>>(rgb.pixels->size() / 3);
  for (size_t i = 0; i < values->size(); ++i) {
    const uint8_t* p = &(*rgb.pixels)[3 * i];
    (*values)[i] = static_cast<uint8_t>((p[0] + 2 * p[1] + p[2] + 2) / 4);
  }
  grey.pixels = std::move(values);
  return grey;
}

absl::StatusOr<Frame> MirroredGrey(const Frame& frame) {
  WEFT_ASSIGN_OR_RETURN(Frame grey, Grey(frame));
  auto values = std::make_shared<std::vector<uint8_t>>(*grey.pixels);
  for (int y = 0; y < grey.height_px; ++y) {
    const auto row = values->begin() + static_cast<std::ptrdiff_t>(y) * grey.width_px;
    std::reverse(row, row + grey.width_px);
  }
  grey.pixels = std::move(values);
  return grey;
}

void AddSightings(const CalibrationTarget& target, int camera, int frame,
                  const std::vector<TagSighting>& tags, CalibrationViews* views) {
  std::map<std::pair<std::string, int>, const TagSighting*> by_id;
  for (const TagSighting& tag : tags) {
    // A tag that is seen twice is a copy or a reflection: neither can be trusted.
    const auto [at, added] = by_id.try_emplace({tag.family, tag.id}, &tag);
    if (!added) at->second = nullptr;
  }
  const auto find = [&](const std::string& family, int id) {
    const auto at = by_id.find({family, id});
    return at == by_id.end() ? nullptr : at->second;
  };
  for (size_t b = 0; b < target.boards.size(); ++b) {
    const TagBoard& board = target.boards[b];
    BoardView view{.camera = camera, .frame = frame, .board = static_cast<int>(b), .straight_sides = true};
    std::vector<double> blurs;
    for (size_t i = 0; i < board.tag_ids.size(); ++i) {
      const TagSighting* tag = find(board.family, board.tag_ids[i]);
      if (!tag) continue;
      for (int k = 0; k < 4; ++k) view.corners.push_back({static_cast<int>(4 * i) + k, tag->corners_px[k]});
      blurs.push_back(tag->blur_px);
    }
    if (blurs.empty()) continue;
    view.blur_px = Median(std::move(blurs));
    views->boards.push_back(std::move(view));
  }
  for (size_t b = 0; b < target.scale_bars.size(); ++b) {
    const ScaleBar& bar = target.scale_bars[b];
    for (int end = 0; end < 2; ++end) {
      const TagSighting* tag = find(bar.family, end == 0 ? bar.first_tag : bar.second_tag);
      if (!tag) continue;
      // The middle of a square is where its diagonals meet, in perspective too.
      const auto& c = tag->corners_px;
      const Eigen::Vector2d a = c[2] - c[0], d = c[3] - c[1], gap = c[1] - c[0];
      const double s = (gap.x() * d.y() - gap.y() * d.x()) / (a.x() * d.y() - a.y() * d.x());
      views->bar_ends.push_back({camera, frame, static_cast<int>(b), end, c[0] + s * a});
    }
  }
}

}  // namespace weft
