#include "simulation/appearance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "simulation/random.h"

namespace weft {
namespace {

constexpr float kSpot_mm = 0.5f;  // size of the spots of the weave
// Apart by use; hashed with the seed at every look, so numbers and no names.
constexpr uint64_t kWeave = 1, kWrinkle = 2, kCrease = 3;
constexpr float kTurnFloat = 2 * std::numbers::pi_v<float>;

// A zero-mean number of standard deviation 1 (uniform) for a place of an integer grid.
float PlaceNoise(uint64_t key, int64_t x, int64_t y) {
  const uint64_t counter = static_cast<uint64_t>(y) << 32 ^ static_cast<uint32_t>(x);
  return 3.4641016f *
         (static_cast<float>(MixBits(key + 0x9e3779b97f4a7c15ULL * counter) >> 40) * 0x1.0p-24f - 0.5f);
}

// Smooth noise between the places of a unit grid, and its slope.
struct NoiseValue {
  float value = 0, by_x = 0, by_y = 0;
};
NoiseValue SmoothNoise(uint64_t key, float x, float y) {
  const float fx = std::floor(x), fy = std::floor(y);
  const auto ix = static_cast<int64_t>(fx), iy = static_cast<int64_t>(fy);
  const float tx = x - fx, ty = y - fy;
  const float u = tx * tx * (3 - 2 * tx), v = ty * ty * (3 - 2 * ty);
  const float n00 = PlaceNoise(key, ix, iy), n10 = PlaceNoise(key, ix + 1, iy);
  const float n01 = PlaceNoise(key, ix, iy + 1), n11 = PlaceNoise(key, ix + 1, iy + 1);
  return {(1 - v) * ((1 - u) * n00 + u * n10) + v * ((1 - u) * n01 + u * n11),
          6 * tx * (1 - tx) * ((1 - v) * (n10 - n00) + v * (n11 - n01)),
          6 * ty * (1 - ty) * ((1 - u) * (n01 - n00) + u * (n11 - n10))};
}

// What is left of a pattern of this period in pixels of this size: the transfer of a pixel with its blur,
// nothing from two pixels a period on.
float Resolved(float footprint_mm, float period_mm) {
  const float pixels = period_mm / std::max(footprint_mm, 1e-6f);
  return std::clamp((pixels - 2) / 3, 0.0f, 1.0f);
}

// Signed distance to a square with round corners, centred on the origin, in cells; negative inside.
float SquareDistance(float x, float y, float half, float corner) {
  const float dx = std::abs(x) - half + corner, dy = std::abs(y) - half + corner;
  const float nearest = std::max(dx, dy);
  if (dx <= 0 || dy <= 0) return nearest - corner;
  return std::sqrt(dx * dx + dy * dy) - corner;
}

absl::Status CheckShare(const char* part, const char* field, double value, double most) {
  if (value >= 0 && value <= most) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(part, ": ", field, " is ", value, ", expected 0 to ", most));
}

}  // namespace

absl::Status InkOptions::Validate() const {
  if (!(spread_cells > 0))
    return absl::InvalidArgumentError(
        absl::StrCat("inks: spread_cells is ", spread_cells, ", expected more than 0"));
  absl::Status status = CheckShare("inks", "spread_cells", spread_cells, 0.5);
  status.Update(CheckShare("inks", "corner_cells", corner_cells, 0.4));
  status.Update(CheckShare("inks", "line_growth_cells", line_growth_cells, 0.2));
  status.Update(CheckShare("inks", "cell_variation", cell_variation, 0.5));
  return status;
}

PrintedInk::PrintedInk(const Board& board, const InkOptions& inks)
    : rows_(board.rows),
      cols_(board.cols),
      half_square_(static_cast<float>(board.square_fraction / 2 - inks.line_growth_cells)),
      corner_(static_cast<float>(inks.corner_cells)),
      spread_(static_cast<float>(inks.spread_cells)),
      line_(inks.line) {
  const uint64_t key = KeyOf(inks.seed, "cell");
  cells_.reserve(static_cast<size_t>(rows_) * cols_);
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c < cols_; ++c) {
      const float shade = 1 + static_cast<float>(inks.cell_variation) * PlaceNoise(key, c, r);
      cells_.emplace_back(inks.color[static_cast<size_t>(board.at(r, c))] * std::max(shade, 0.1f));
    }
}

Eigen::Vector3f PrintedInk::At(float col, float row) const {
  const float left = std::floor(col), top = std::floor(row);
  if (!(left >= 0 && top >= 0 && left < static_cast<float>(cols_) && top < static_cast<float>(rows_)))
    return line_;
  const float distance = SquareDistance(col - left - 0.5f, row - top - 0.5f, half_square_, corner_);
  const float t = std::clamp(0.5f + distance / (2 * spread_), 0.0f, 1.0f);
  const float line = t * t * (3 - 2 * t);
  const Eigen::Vector3f& cell = cells_[static_cast<size_t>(top) * cols_ + static_cast<size_t>(left)];
  return cell + line * (line_ - cell);
}

absl::Status FabricLookOptions::Validate() const {
  absl::Status status = CheckShare("fabric", "weave_variation", weave_variation, 0.5);
  status.Update(CheckShare("fabric", "knit_depth", knit_depth, 1));
  status.Update(CheckShare("fabric", "wrinkle_slope", wrinkle_slope, 1));
  status.Update(CheckShare("fabric", "fuzz", fuzz, 1));
  if (!(wale_mm > 0 && course_mm > 0 && wrinkle_mm > 0))
    status.Update(absl::InvalidArgumentError("fabric: wale_mm, course_mm and wrinkle_mm must be positive"));
  return status;
}

FabricTexture FabricAt(const FabricLookOptions& fabric, float x_mm, float y_mm, float footprint_mm) {
  FabricTexture out;
  if (fabric.weave_variation > 0) {
    // Spots smaller than a pixel average out. Interpolated noise has a third of its places' variance.
    const float averaged = std::min(1.0f, kSpot_mm / std::max(footprint_mm, 1e-6f));
    const float x = x_mm / std::max(kSpot_mm, footprint_mm), y = y_mm / std::max(kSpot_mm, footprint_mm);
    out.shade += 1.8f * averaged * static_cast<float>(fabric.weave_variation) *
                 SmoothNoise(MixBits(fabric.seed + kWeave), x, y).value;
  }
  const auto wale = static_cast<float>(fabric.wale_mm), course = static_cast<float>(fabric.course_mm);
  const float knit = static_cast<float>(fabric.knit_depth) * Resolved(footprint_mm, wale);
  if (knit > 0) {
    // Loops are Vs in columns: the rows bend upwards towards the middle of a wale.
    const float across = x_mm / wale, middle = std::abs(across - std::floor(across) - 0.5f);
    const float along = y_mm / course + middle;
    out.shade -= knit * (0.25f - 0.25f * std::cos(kTurnFloat * across) + 0.25f -
                         0.25f * std::cos(kTurnFloat * along) - 0.5f);
  }
  if (fabric.wrinkle_slope > 0) {
    const auto size = static_cast<float>(fabric.wrinkle_mm);
    const NoiseValue coarse = SmoothNoise(MixBits(fabric.seed + kWrinkle), x_mm / size, y_mm / size);
    const NoiseValue fine =
        SmoothNoise(MixBits(fabric.seed + kCrease), 2.3f * x_mm / size, 2.3f * y_mm / size);
    // The slope of this noise has a standard deviation of 1.
    const auto slope = static_cast<float>(fabric.wrinkle_slope);
    out.slope =
        slope * Eigen::Vector2f(0.8f * coarse.by_x + 0.5f * fine.by_x, 0.8f * coarse.by_y + 0.5f * fine.by_y);
  }
  return out;
}

}  // namespace weft
