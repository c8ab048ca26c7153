#include "simulation/view_tracer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "simulation/face_raster.h"
#include "simulation/random.h"
#include "simulation/tile_directions.h"
#include "simulation/tile_room.h"

namespace weft {
namespace {

constexpr int kTile = TileDirections::kTile;  // pixels of a tile on each side, with its margin
constexpr int kMaxReach = 15;                 // pixels that a surface may move on either side of the middle
constexpr int kMaxSamples = 64;
constexpr float kEvenCells = 0.12f;  // a surface goes on evenly when its print is this near where expected
constexpr float kEven_mm = 1;        // the same for what has no print

// A place within the pixel, -0.5 to 0.5, and a moment of the exposure, -0.5 to 0.5.
struct Sample {
  Eigen::Vector2f offset_px;
  float moment = 0;
};

// Hammersley's points; moments are as even, in an order that has nothing to do with the places.
std::vector<Sample> SpreadSamples(int count) {
  int stride = std::max(1, static_cast<int>(0.618 * count));
  while (std::gcd(stride, count) != 1) ++stride;
  std::vector<Sample> out;
  Eigen::Vector2f mean = Eigen::Vector2f::Zero();
  for (int i = 0; i < count; ++i) {
    const auto share = [count](int k) { return (static_cast<float>(k) + 0.5f) / static_cast<float>(count); };
    out.push_back({{share(i), RadicalInverse(i)}, share(i * stride % count) - 0.5f});
    mean += out.back().offset_px / static_cast<float>(count);
  }
  for (Sample& s : out) s.offset_px -= mean;  // centred exactly, so that no place of the picture is off
  return out;
}

// A face as this camera sees it. Directions are (x, y, 1) in camera axes.
struct Facet {
  int face = -1;
  Eigen::Vector3f normal;  // of any length
  float plane = 0;         // normal . first corner
  Eigen::Vector2f board_at_corner;
  std::array<Eigen::Vector3f, 2> to_board;

  Eigen::Vector2f BoardIn(const Eigen::Vector2f& d) const {
    const Eigen::Vector3f ray = d.homogeneous();
    const float scale = 1 / normal.dot(ray);
    return board_at_corner + scale * Eigen::Vector2f(to_board[0].dot(ray), to_board[1].dot(ray));
  }
  float DepthIn(const Eigen::Vector2f& d) const { return plane / normal.dot(d.homogeneous()); }
};

// What the ray through its middle met.
struct Pixel {
  Eigen::Vector2f direction;
  int facet = -1;  // of the tile
  bool from_outside = false;
  bool printed = false;
  bool edge = false;
  Eigen::Vector2f board;      // at the direction
  Eigen::Vector2f streak_px;  // way in the picture during the exposure
  Eigen::Vector3f plain;      // light of what is not printed
  float gain = 0;             // from reflectance to light
  float fuzz = 0;
  float depth_mm = std::numeric_limits<float>::infinity();
};

class ViewTracer {
 public:
  ViewTracer(const StudioScene& scene, const CameraModel& camera, const TraceOptions& options)
      : scene_(scene),
        camera_(camera),
        world_from_camera_(camera.rotation.transpose().cast<float>()),
        eye_mm_(camera.CenterWorld().cast<float>()),
        focal_px_(static_cast<float>(camera.fx_px), static_cast<float>(camera.fy_px)) {
    corners_mm_.reserve(scene.places_mm().size());
    for (const Eigen::Vector3d& p : scene.places_mm())
      corners_mm_.emplace_back((camera.rotation * p + camera.translation_mm).cast<float>());
    for (const Eigen::Vector3d& p : scene.paths_mm())
      paths_mm_.emplace_back((camera.rotation * p).cast<float>());
    float longest = 0;
    for (size_t v = 0; v < paths_mm_.size(); ++v)
      longest = std::max(longest, StreakPx(corners_mm_[v], paths_mm_[v]).norm());
    reach_ = 1 + std::min(static_cast<int>(std::ceil(longest / 2)), kMaxReach);
    if (longest < 0.01f) reach_ = 1;
    const int for_motion = std::min(static_cast<int>(std::ceil(2 * longest)), kMaxSamples);
    samples_ = SpreadSamples(std::max(options.samples, for_motion));
    edge_batches_ = std::max(1, (for_motion + RaySamples::kCount - 1) / RaySamples::kCount);
  }

  void Trace(TracedView* view) const {
    const int step = kTile - 2 * reach_;
    const int across = (camera_.width_px + step - 1) / step, down = (camera_.height_px + step - 1) / step;
    std::vector<std::optional<TileDirections>> tiles(static_cast<size_t>(across) * down);
    tbb::parallel_for(size_t{0}, tiles.size(), [&](size_t t) {
      const auto i = static_cast<int>(t);
      tiles[t].emplace(camera_, i % across * step - reach_, i / across * step - reach_);
    });
    Eigen::AlignedBox2f all;
    for (const auto& tile : tiles) all.extend(tile->Bounds());
    const FaceRaster raster(corners_mm_, scene_.faces(), all);
    tbb::parallel_for(size_t{0}, tiles.size(), [&](size_t t) {
      const auto i = static_cast<int>(t);
      TraceTile(i % across * step, i / across * step, *tiles[t], raster, view);
    });
  }

 private:
  struct Tile {
    explicit Tile(TileRoom behind) : room(std::move(behind)) {}

    std::vector<Pixel> pixels;  // [kTile][kTile]
    std::vector<Facet> facets;  // of the faces that may be seen
    TileRoom room;
    std::vector<Eigen::Vector3f> edges;  // light of the pixels at outlines, in their order
    Eigen::Matrix2f direction_by_pixel;  // in the middle of the tile
    Pixel& at(int x, int y) { return pixels[static_cast<size_t>(y) * kTile + x]; }
    const Pixel& at(int x, int y) const { return pixels[static_cast<size_t>(y) * kTile + x]; }
  };

  // The tile whose inner part begins at pixel (x0, y0).
  void TraceTile(int x0, int y0, const TileDirections& directions, const FaceRaster& raster,
                 TracedView* view) const {
    Tile tile(TileRoom(scene_.room(), directions, eye_mm_, world_from_camera_));
    const std::vector<int> faces = raster.FacesIn(directions.Bounds());
    if (!faces.empty()) DrawFaces(faces, directions, raster, tile);
    size_t next_edge = 0;
    const int x_end = std::min(x0 + kTile - 2 * reach_, view->image.width_px);
    const int y_end = std::min(y0 + kTile - 2 * reach_, view->image.height_px);
    for (int y = y0; y < y_end; ++y)
      for (int x = x0; x < x_end; ++x) {
        const size_t place = static_cast<size_t>(y) * view->image.width_px + x;
        const int tx = x - x0 + reach_, ty = y - y0 + reach_;
        Eigen::Map<Eigen::Vector3f> light(&view->image.rgb[3 * place]);
        view->depth_mm[place] = std::numeric_limits<float>::infinity();
        if (faces.empty()) {
          light = tile.room.At(tx, ty);
          continue;
        }
        const Pixel& pixel = tile.at(tx, ty);
        view->depth_mm[place] = pixel.depth_mm;
        if (pixel.edge)
          light = tile.edges[next_edge++];
        else
          light = pixel.facet < 0 ? tile.room.At(tx, ty) : EvenLight(tile, tx, ty);
      }
  }

  void DrawFaces(const std::vector<int>& faces, const TileDirections& directions, const FaceRaster& raster,
                 Tile& tile) const {
    const std::vector<Eigen::Vector2f> all = directions.All();
    constexpr int m = kTile / 2;
    tile.direction_by_pixel << all[m * kTile + m + 1] - all[m * kTile + m],
        all[(m + 1) * kTile + m] - all[m * kTile + m];
    tile.pixels.resize(all.size());
    tile.facets.resize(faces.size());
    std::vector<RayHit> hits;
    raster.Draw(faces, all, kTile, &hits);
    for (size_t p = 0; p < all.size(); ++p) {
      tile.pixels[p].direction = all[p];
      if (hits[p].face >= 0) SetSurface(tile, hits[p], faces[hits[p].face], tile.pixels[p]);
    }
    MarkEdges(tile);
    LightEdges(faces, all, raster, tile);
  }

  // Way in the picture of a point at `place` (camera axes) that moves along `path`; 0 behind the camera.
  Eigen::Vector2f StreakPx(const Eigen::Vector3f& place, const Eigen::Vector3f& path) const {
    if (!(place.z() > 1)) return Eigen::Vector2f::Zero();
    const Eigen::Vector2f d = place.head<2>() / place.z();
    return (path.head<2>() - path.z() * d).cwiseProduct(focal_px_) / place.z();
  }

  Facet FacetOf(int f) const {
    const Face& face = scene_.faces()[f];
    const Eigen::Vector3f& a = corners_mm_[face[0]];
    const Eigen::Vector3f ab = corners_mm_[face[1]] - a, ac = corners_mm_[face[2]] - a;
    Facet out;
    out.face = f;
    out.normal = ab.cross(ac);
    out.plane = out.normal.dot(a);
    if (!scene_.IsCloth(f)) return out;
    const auto& board = scene_.print().of_face[f];
    const Eigen::Vector2f b = (board[1] - board[0]).cast<float>(), c = (board[2] - board[0]).cast<float>();
    const Eigen::Vector3f to_b = ac.cross(a), to_c = a.cross(ab);
    for (int i = 0; i < 2; ++i) out.to_board[i] = b[i] * to_b + c[i] * to_c;
    out.board_at_corner = board[0].cast<float>();
    return out;
  }

  // `hit.face` is the facet's number in the tile.
  void SetSurface(Tile& tile, const RayHit& hit, int f, Pixel& pixel) const {
    Facet& facet = tile.facets[hit.face];
    if (facet.face < 0) facet = FacetOf(f);
    const Eigen::Vector3f weights(1 - hit.weight_b - hit.weight_c, hit.weight_b, hit.weight_c);
    pixel.facet = hit.face;
    pixel.from_outside = hit.from_outside;
    pixel.depth_mm = hit.distance_mm;
    pixel.streak_px.setZero();
    if (!paths_mm_.empty()) {
      const Face& face = scene_.faces()[f];
      Eigen::Vector3f path = Eigen::Vector3f::Zero();
      for (int i = 0; i < 3; ++i) path += weights[i] * paths_mm_[face[i]];
      pixel.streak_px = StreakPx(pixel.depth_mm * pixel.direction.homogeneous(), path);
    }
    const ShadedPoint point = scene_.ShadeAt(f, hit.from_outside, weights);
    pixel.printed = point.printed;
    float footprint_mm = pixel.depth_mm / focal_px_.x();
    if (point.printed) {
      pixel.board = point.board;
      const auto cell_mm = static_cast<float>(scene_.board().cell_mm);
      const auto& step = tile.direction_by_pixel;
      footprint_mm = cell_mm * std::max((facet.BoardIn(pixel.direction + step.col(0)) - point.board).norm(),
                                        (facet.BoardIn(pixel.direction + step.col(1)) - point.board).norm());
    }
    const Coat coat = CoatOf(point, facet.normal, pixel.direction, footprint_mm);
    pixel.gain = coat.gain, pixel.fuzz = coat.fuzz;
    pixel.plain = point.plain * coat.gain;
  }

  // How a place of the surface turns reflectance into light.
  struct Coat {
    float gain = 0, fuzz = 0;
  };
  Coat CoatOf(const ShadedPoint& point, const Eigen::Vector3f& normal, const Eigen::Vector2f& direction,
              float footprint_mm) const {
    constexpr float kLeastShare = 0.2f;  // of the light, in the steepest wrinkles
    if (!point.printed) return {point.light, 0};
    const auto cell_mm = static_cast<float>(scene_.board().cell_mm);
    const FabricLookOptions& fabric = scene_.options().fabric;
    const FabricTexture texture =
        FabricAt(fabric, cell_mm * point.board.x(), cell_mm * point.board.y(), footprint_mm);
    const float light =
        std::max(point.light + texture.slope.dot(point.light_by_slope), kLeastShare * point.light);
    const Eigen::Vector3f ray = direction.homogeneous();
    const float cosine = std::abs(normal.dot(ray)) / std::sqrt(normal.squaredNorm() * ray.squaredNorm());
    const float rim = 1 - cosine;
    return {light * std::max(texture.shade, 0.1f), light * static_cast<float>(fabric.fuzz) * rim * rim * rim};
  }

  bool GoesOn(const Tile& tile, const Pixel& p, const Pixel& q) const {
    if (p.facet == q.facet && p.from_outside == q.from_outside) return true;
    if (p.facet < 0 || q.facet < 0 || p.from_outside != q.from_outside || p.printed != q.printed)
      return false;
    const Facet& facet = tile.facets[p.facet];
    if (scene_.IsCloth(facet.face) != scene_.IsCloth(tile.facets[q.facet].face)) return false;
    if (p.printed) return (facet.BoardIn(q.direction) - q.board).cwiseAbs().maxCoeff() < kEvenCells;
    return std::abs(facet.DepthIn(q.direction) - q.depth_mm) < kEven_mm;
  }

  // A pixel is an edge where the surface is not smooth towards one of its neighbours, or where the end of
  // a surface may pass through it during the exposure.
  void MarkEdges(Tile& tile) const {
    std::vector<char> spread(tile.pixels.size(), -1);  // pixels around that are edges too
    const auto mark = [&](int x, int y, int nx, int ny) {
      const size_t here = static_cast<size_t>(y) * kTile + x, there = static_cast<size_t>(ny) * kTile + nx;
      const Pixel &p = tile.pixels[here], &q = tile.pixels[there];
      if (GoesOn(tile, p, q) && GoesOn(tile, q, p)) return;
      // The outline itself lies between the two middles.
      const float streak = std::sqrt(std::max(p.streak_px.squaredNorm(), q.streak_px.squaredNorm()));
      const auto far =
          static_cast<char>(std::clamp(static_cast<int>(std::ceil(streak / 2 - 0.5f)), 0, reach_));
      spread[here] = std::max(spread[here], far), spread[there] = std::max(spread[there], far);
    };
    for (int y = 0; y < kTile; ++y)
      for (int x = 0; x < kTile; ++x) {
        if (x + 1 < kTile) mark(x, y, x + 1, y);
        if (y + 1 < kTile) mark(x, y, x, y + 1);
      }
    for (int y = 0; y < kTile; ++y)
      for (int x = 0; x < kTile; ++x) {
        const int far = spread[static_cast<size_t>(y) * kTile + x];
        for (int ey = std::max(0, y - far); ey <= std::min(kTile - 1, y + far); ++ey)
          for (int ex = std::max(0, x - far); ex <= std::min(kTile - 1, x + far); ++ex)
            tile.at(ex, ey).edge = true;
      }
  }

  // Light of the edge pixels within the margin, from rays all over each.
  void LightEdges(const std::vector<int>& faces, const std::vector<Eigen::Vector2f>& directions,
                  const FaceRaster& raster, Tile& tile) const {
    std::vector<int> slot_of_pixel(tile.pixels.size(), -1);
    std::vector<int> edges;
    for (int y = reach_; y < kTile - reach_; ++y)
      for (int x = reach_; x < kTile - reach_; ++x) {
        const int place = y * kTile + x;
        if (!tile.pixels[place].edge) continue;
        slot_of_pixel[place] = static_cast<int>(edges.size());
        edges.push_back(place);
      }
    if (edges.empty()) return;
    tile.edges.assign(edges.size(), Eigen::Vector3f::Zero());
    const std::vector<Sample> samples = SpreadSamples(edge_batches_ * RaySamples::kCount);
    std::vector<RayHit> hits;
    for (int batch = 0; batch < edge_batches_; ++batch) {
      RaySamples rays;
      for (int k = 0; k < RaySamples::kCount; ++k) {
        const Sample& s = samples[batch * RaySamples::kCount + k];
        rays.offset[k] = tile.direction_by_pixel * s.offset_px;
        rays.moment[k] = s.moment;
      }
      raster.DrawSamples(faces, directions, kTile, slot_of_pixel, rays, paths_mm_, &hits);
      for (size_t e = 0; e < edges.size(); ++e)
        tile.edges[e] += SumOfLight(faces, directions[edges[e]], rays, &hits[e * RaySamples::kCount], tile) /
                         static_cast<float>(samples.size());
    }
  }

  Eigen::Vector3f SumOfLight(const std::vector<int>& faces, const Eigen::Vector2f& direction,
                             const RaySamples& rays, const RayHit* hits, Tile& tile) const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int free = 0;  // rays that end in the room, which is even within a pixel
    for (int k = 0; k < RaySamples::kCount; ++k) {
      if (hits[k].face < 0) {
        ++free;
        continue;
      }
      Facet& facet = tile.facets[hits[k].face];
      if (facet.face < 0) facet = FacetOf(faces[hits[k].face]);
      sum += HitLight(facet, hits[k], direction + rays.offset[k]);
    }
    if (free > 0) sum += static_cast<float>(free) * tile.room.In(direction);
    return sum;
  }

  Eigen::Vector3f EvenLight(const Tile& tile, int x, int y) const {
    const Pixel& pixel = tile.at(x, y);
    if (!pixel.printed) return pixel.plain;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const Sample& s : samples_) {
      // The place of the cloth that passes the sample at its moment is seen there at the middle of the
      // exposure.
      const Eigen::Vector2f away = s.offset_px - s.moment * pixel.streak_px;
      const int dx = static_cast<int>(std::lround(away.x())), dy = static_cast<int>(std::lround(away.y()));
      const Pixel& near = tile.at(std::clamp(x + dx, 0, kTile - 1), std::clamp(y + dy, 0, kTile - 1));
      const Pixel& on = near.printed && near.facet >= 0 ? near : pixel;
      const Eigen::Vector2f board =
          tile.facets[on.facet].BoardIn(pixel.direction + tile.direction_by_pixel * away);
      sum += on.gain * scene_.ink().At(board.x(), board.y()) + Eigen::Vector3f::Constant(on.fuzz);
    }
    return sum / static_cast<float>(samples_.size());
  }

  Eigen::Vector3f HitLight(const Facet& facet, const RayHit& hit, const Eigen::Vector2f& direction) const {
    const Eigen::Vector3f weights(1 - hit.weight_b - hit.weight_c, hit.weight_b, hit.weight_c);
    const ShadedPoint point = scene_.ShadeAt(facet.face, hit.from_outside, weights);
    const Coat coat = CoatOf(point, facet.normal, direction, hit.distance_mm / focal_px_.x());
    if (!point.printed) return coat.gain * point.plain;
    return coat.gain * scene_.ink().At(point.board.x(), point.board.y()) +
           Eigen::Vector3f::Constant(coat.fuzz);
  }

  const StudioScene& scene_;
  const CameraModel& camera_;
  const Eigen::Matrix3f world_from_camera_;
  const Eigen::Vector3f eye_mm_;
  const Eigen::Vector2f focal_px_;
  std::vector<Eigen::Vector3f> corners_mm_, paths_mm_;  // camera axes; paths empty at rest
  std::vector<Sample> samples_;
  int edge_batches_ = 1;  // of a pixel at an outline, times RaySamples::kCount
  int reach_ = 1;         // margin of the tiles
};

}  // namespace

absl::Status TraceOptions::Validate() const {
  if (samples >= 1 && samples <= kMaxSamples) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("tracing: samples is ", samples, ", expected 1 to ", kMaxSamples));
}

absl::StatusOr<TracedView> TraceView(const StudioScene& scene, const CameraModel& camera,
                                     const TraceOptions& options) {
  absl::Status status = camera.Validate();
  status.Update(options.Validate());
  if (!status.ok()) return status;
  TracedView view;
  view.image.width_px = camera.width_px, view.image.height_px = camera.height_px;
  const size_t pixels = static_cast<size_t>(camera.width_px) * camera.height_px;
  view.image.rgb.resize(3 * pixels);
  view.depth_mm.resize(pixels);
  ViewTracer(scene, camera, options).Trace(&view);
  return view;
}

}  // namespace weft
