#include "simulation/face_raster.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace weft {
namespace {

constexpr int kGrid = 64;          // cells on each side of the view
constexpr float kNear_mm = 1;      // nearer corners have no place in the picture
constexpr float kOverlap = 1e-4f;  // by which neighbouring faces overlap, so that no ray slips between

// Weights of the corners as functions of the direction: proportional to those of the ray's point.
struct FaceEdges {
  Eigen::Vector3f b, c, normal;  // the sum of all three weights is normal . direction
  float plane = 0;               // normal . corner

  FaceEdges(const Eigen::Vector3f& pa, const Eigen::Vector3f& pb, const Eigen::Vector3f& pc) {
    const Eigen::Vector3f ab = pb - pa, ac = pc - pa;
    b = ac.cross(pa), c = pa.cross(ab);  // of the differences: no cancellation
    normal = ab.cross(ac);
    plane = normal.dot(pa);
  }
};

using Samples = Eigen::Array<float, RaySamples::kCount, 1>;

// FaceEdges at the moments of the samples.
class SampledEdges {
 public:
  // corners_mm: three when the shutter opens, the same three when it closes.
  SampledEdges(const std::array<Eigen::Vector3f, 6>& corners_mm,
               const std::array<float, RaySamples::kCount>& moments) {
    for (int k = 0; k < RaySamples::kCount; ++k) {
      const float after = moments[k] + 0.5f, before = 1 - after;
      const FaceEdges edges(before * corners_mm[0] + after * corners_mm[3],
                            before * corners_mm[1] + after * corners_mm[4],
                            before * corners_mm[2] + after * corners_mm[5]);
      for (int i = 0; i < 3; ++i)
        b_[i][k] = edges.b[i], c_[i][k] = edges.c[i], normal_[i][k] = edges.normal[i];
      plane_[k] = edges.plane;
    }
  }

  // Rays (x, y, 1); `hits` [RaySamples::kCount] holds what is nearest so far.
  void Meet(const Samples& x, const Samples& y, int face, RayHit* hits) const {
    const Samples sum = normal_[0] * x + normal_[1] * y + normal_[2];
    const Samples scale = sum.inverse();
    const Samples b = scale * (b_[0] * x + b_[1] * y + b_[2]), c = scale * (c_[0] * x + c_[1] * y + c_[2]);
    const Samples distance = scale * plane_;
    // The most that a weight is outside of its range.
    const Samples outside = (-b).max(-c).max(b + c - 1);
    if (!(outside.minCoeff() < kOverlap)) return;
    for (int k = 0; k < RaySamples::kCount; ++k)
      if (outside[k] < kOverlap && distance[k] > 0 && distance[k] < hits[k].distance_mm)
        hits[k] = {face, distance[k], b[k], c[k], sum[k] < 0};
  }

 private:
  std::array<Samples, 3> b_, c_, normal_;
  Samples plane_;
};

}  // namespace

FaceRaster::FaceRaster(const std::vector<Eigen::Vector3f>& corners_mm, const std::vector<Face>& faces,
                       const Eigen::AlignedBox2f& view)
    : corners_mm_(corners_mm),
      faces_(faces),
      view_(view),
      bounds_(faces.size()),
      cell_first_(kGrid * kGrid + 1, 0) {
  if (view_.isEmpty()) return;
  std::vector<Eigen::Vector2f> directions(corners_mm.size());
  for (size_t v = 0; v < corners_mm.size(); ++v) directions[v] = corners_mm[v].head<2>() / corners_mm[v].z();
  const auto each_cell = [&](size_t f, const auto& visit) {
    if (bounds_[f].isEmpty()) return;
    const Cells cells = CellsOf(bounds_[f]);
    for (int y = cells.y0; y <= cells.y1; ++y)
      for (int x = cells.x0; x <= cells.x1; ++x) visit(y * kGrid + x);
  };
  for (size_t f = 0; f < faces.size(); ++f) {
    int before = 0;
    Eigen::AlignedBox2f box;
    for (const int v : faces[f]) {
      before += corners_mm[v].z() > kNear_mm ? 1 : 0;
      box.extend(directions[v]);
    }
    if (before > 0 && before < 3) near_.push_back(static_cast<int>(f));
    if (before < 3 || !box.intersects(view_)) continue;
    bounds_[f] = box;
    each_cell(f, [&](int cell) { ++cell_first_[cell + 1]; });
  }
  for (int cell = 0; cell < kGrid * kGrid; ++cell) cell_first_[cell + 1] += cell_first_[cell];
  in_cell_.resize(cell_first_.back());
  std::vector<int> used(cell_first_.begin(), cell_first_.end() - 1);
  for (size_t f = 0; f < faces.size(); ++f)
    each_cell(f, [&](int cell) { in_cell_[used[cell]++] = static_cast<int>(f); });
}

FaceRaster::Cells FaceRaster::CellsOf(const Eigen::AlignedBox2f& box) const {
  const Eigen::Array2f scale = static_cast<float>(kGrid) / view_.sizes().array().max(1e-12f);
  const auto cell = [&](const Eigen::Vector2f& p) -> Eigen::Array2i {
    return ((p - view_.min()).array() * scale).max(0.0f).min(kGrid - 0.5f).cast<int>();
  };
  const Eigen::Array2i first = cell(box.min()), last = cell(box.max());
  return {first.x(), first.y(), last.x(), last.y()};
}

std::vector<int> FaceRaster::FacesIn(const Eigen::AlignedBox2f& box) const {
  if (box.isEmpty() || view_.isEmpty()) return {};
  std::vector<int> out = near_;
  const Cells cells = CellsOf(box);
  for (int y = cells.y0; y <= cells.y1; ++y)
    for (int x = cells.x0; x <= cells.x1; ++x)
      for (int k = cell_first_[y * kGrid + x]; k < cell_first_[y * kGrid + x + 1]; ++k) {
        const int f = in_cell_[k];
        if (!bounds_[f].intersects(box)) continue;
        // It is in several cells, and taken in the first that it shares with the box.
        const Cells own = CellsOf(bounds_[f]);
        if (x == std::max(own.x0, cells.x0) && y == std::max(own.y0, cells.y0)) out.push_back(f);
      }
  const auto key = [&](int f) { return std::pair(corners_mm_[faces_[f][0]].z(), f); };
  std::sort(out.begin(), out.end(), [&](int f, int g) { return key(f) < key(g); });
  return out;
}

// Pixels of a tile as a linear function of the direction, and how wrong that is.
class FaceRaster::TileFrame {
 public:
  TileFrame(const std::vector<Eigen::Vector2f>& directions, int size) : size_(size) {
    const int m = size / 2;
    const auto at = [&](int x, int y) { return directions[static_cast<size_t>(y) * size + x]; };
    middle_direction_ = at(m, m);
    Eigen::Matrix2f by_pixel;
    by_pixel << (at(size - 1, m) - at(0, m)) / static_cast<float>(size - 1),
        (at(m, size - 1) - at(m, 0)) / static_cast<float>(size - 1);
    pixel_by_direction_ = by_pixel.inverse();
    for (int y = 0; y < size; y += 7)
      for (int x = 0; x < size; x += 7) {
        const float off = (PixelOf(at(x, y)) - Eigen::Vector2i(x, y).cast<float>()).cwiseAbs().maxCoeff();
        known_ = known_ && off < static_cast<float>(size);  // false where directions are missing
        slack_px_ = std::max(slack_px_, off);
      }
    // Between the places that were looked at it may be a little more.
    slack_px_ = 1.5f * slack_px_ + 0.05f;
  }

  // The pixels, last included, that are within `margin_px` of the points; all where that is not known.
  template <typename Points>
  Cells PixelsNear(const Points& points_mm, float margin_px) const {
    const Eigen::Vector2f most = Eigen::Vector2f::Constant(static_cast<float>(size_ - 1));
    Eigen::AlignedBox2f box;
    bool before = known_;
    for (const Eigen::Vector3f& p : points_mm) {
      before = before && p.z() > kNear_mm;
      if (before) box.extend(PixelOf(p.head<2>() / p.z()));
    }
    if (!before) return {0, 0, size_ - 1, size_ - 1};
    const Eigen::Array2f slack = Eigen::Array2f::Constant(slack_px_ + margin_px);
    const Eigen::Array2f low = (box.min().array() - slack).max(0.0f);
    const Eigen::Array2f high = (box.max().array() + slack).min(most.array());
    return {static_cast<int>(std::ceil(low.x())), static_cast<int>(std::ceil(low.y())),
            static_cast<int>(std::floor(high.x())), static_cast<int>(std::floor(high.y()))};
  }

 private:
  Eigen::Vector2f PixelOf(const Eigen::Vector2f& d) const {
    return pixel_by_direction_ * (d - middle_direction_) +
           Eigen::Vector2f::Constant(static_cast<float>(size_ / 2));
  }

  int size_;
  Eigen::Vector2f middle_direction_;
  Eigen::Matrix2f pixel_by_direction_;
  float slack_px_ = 0;
  bool known_ = true;
};

void FaceRaster::Draw(const std::vector<int>& faces, const std::vector<Eigen::Vector2f>& directions, int size,
                      std::vector<RayHit>* hits) const {
  hits->assign(directions.size(), RayHit());
  const TileFrame frame(directions, size);
  for (size_t i = 0; i < faces.size(); ++i) {
    const Face& face = faces_[faces[i]];
    const std::array<Eigen::Vector3f, 3> p = {corners_mm_[face[0]], corners_mm_[face[1]],
                                              corners_mm_[face[2]]};
    const Cells pixels = frame.PixelsNear(p, 0);
    const FaceEdges edges(p[0], p[1], p[2]);
    const float nearest_mm = std::min({p[0].z(), p[1].z(), p[2].z()});
    for (int y = pixels.y0; y <= pixels.y1; ++y)
      for (int x = pixels.x0; x <= pixels.x1; ++x) {
        const size_t place = static_cast<size_t>(y) * size + x;
        RayHit& hit = (*hits)[place];
        if (hit.distance_mm < nearest_mm) continue;
        const Eigen::Vector3f ray = directions[place].homogeneous();
        const float sum = edges.normal.dot(ray);
        const float scale = 1 / sum;
        const float weight_b = scale * edges.b.dot(ray), weight_c = scale * edges.c.dot(ray);
        if (!(weight_b > -kOverlap && weight_c > -kOverlap && weight_b + weight_c < 1 + kOverlap)) continue;
        const float distance = scale * edges.plane;
        if (!(distance > 0 && distance < hit.distance_mm)) continue;
        hit = {static_cast<int>(i), distance, weight_b, weight_c, sum < 0};
      }
  }
}

void FaceRaster::DrawSamples(const std::vector<int>& faces, const std::vector<Eigen::Vector2f>& directions,
                             int size, const std::vector<int>& slot_of_pixel, const RaySamples& samples,
                             const std::vector<Eigen::Vector3f>& paths_mm, std::vector<RayHit>* hits) const {
  const int slots = 1 + *std::max_element(slot_of_pixel.begin(), slot_of_pixel.end());
  hits->assign(static_cast<size_t>(slots) * RaySamples::kCount, RayHit());
  const TileFrame frame(directions, size);
  Samples dx, dy;
  for (int k = 0; k < RaySamples::kCount; ++k) dx[k] = samples.offset[k].x(), dy[k] = samples.offset[k].y();
  for (size_t i = 0; i < faces.size(); ++i) {
    // Where the corners are when the shutter opens and when it closes.
    std::array<Eigen::Vector3f, 6> p;
    for (int c = 0; c < 3; ++c) {
      const int v = faces_[faces[i]][c];
      const Eigen::Vector3f path = paths_mm.empty() ? Eigen::Vector3f::Zero().eval() : paths_mm[v];
      p[c] = corners_mm_[v] - 0.5f * path, p[c + 3] = corners_mm_[v] + 0.5f * path;
    }
    const Cells pixels = frame.PixelsNear(p, 0.5f);
    std::optional<SampledEdges> edges;  // of faces that meet a pixel with a slot
    for (int y = pixels.y0; y <= pixels.y1; ++y)
      for (int x = pixels.x0; x <= pixels.x1; ++x) {
        const size_t place = static_cast<size_t>(y) * size + x;
        if (slot_of_pixel[place] < 0) continue;
        if (!edges) edges.emplace(p, samples.moment);
        edges->Meet(directions[place].x() + dx, directions[place].y() + dy, static_cast<int>(i),
                    &(*hits)[static_cast<size_t>(slot_of_pixel[place]) * RaySamples::kCount]);
      }
  }
}

}  // namespace weft
