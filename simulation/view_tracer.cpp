#include "simulation/view_tracer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr int kTile = 64;  // pixels of a tile on each side, with its margin
constexpr int kBlock = 4;  // pixels of a packet of rays, and of the lens grid, on each side
constexpr int kGrid = kTile / kBlock + 1;
constexpr int kMaxReach = 15;  // pixels that a surface may move on either side of the middle
constexpr int kEdgeSamples = 16;
constexpr int kMaxSamples = 64;
constexpr float kEvenCells = 0.12f;  // a surface goes on evenly when its print is this near where expected
constexpr float kEven_mm = 1;        // the same for what has no print
static_assert(kBlock * kBlock == RayScene::kPacket && kEdgeSamples == RayScene::kPacket);

// A place within the pixel, -0.5 to 0.5, and a moment of the exposure, -0.5 to 0.5.
struct Sample {
  Eigen::Vector2f offset_px;
  float moment = 0;
};

// Van der Corput's sequence.
float RadicalInverse(int i) {
  float out = 0, digit = 0.5f;
  for (; i > 0; i >>= 1, digit *= 0.5f) out += digit * static_cast<float>(i & 1);
  return out;
}

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

// What one ray met, and how the surface goes on around it. Directions are (x, y, 1) in camera axes.
struct Pixel {
  Eigen::Vector2f direction;
  int face = -1;
  bool from_outside = false;
  bool printed = false;
  bool edge = false;
  Eigen::Vector2f board;            // at the direction
  Eigen::Vector2f board_at_corner;  // of the face's first corner
  Eigen::Vector3f normal;           // of the face, any length
  std::array<Eigen::Vector3f, 2> to_board;
  float plane = 0;            // normal . first corner
  Eigen::Vector2f streak_px;  // way in the picture during the exposure
  Eigen::Vector3f plain;      // light of what is not printed
  float gain = 0;             // from reflectance to light
  float fuzz = 0;
  float depth_mm = std::numeric_limits<float>::infinity();

  Eigen::Vector2f BoardIn(const Eigen::Vector2f& d) const {
    const Eigen::Vector3f ray = d.homogeneous();
    const float scale = 1 / normal.dot(ray);
    return board_at_corner + scale * Eigen::Vector2f(to_board[0].dot(ray), to_board[1].dot(ray));
  }
  float DepthIn(const Eigen::Vector2f& d) const { return plane / normal.dot(d.homogeneous()); }
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
    edge_samples_ =
        SpreadSamples(std::max(kEdgeSamples, (for_motion + kEdgeSamples - 1) / kEdgeSamples * kEdgeSamples));
  }

  int step() const { return kTile - 2 * reach_; }

  // The tile whose inner part begins at pixel (x0, y0).
  void TraceTile(int x0, int y0, TracedView* view) const {
    Tile tile;
    tile.x0 = x0 - reach_, tile.y0 = y0 - reach_;
    tile.pixels.resize(static_cast<size_t>(kTile) * kTile);
    SetDirections(tile);
    for (int by = 0; by < kTile; by += kBlock)
      for (int bx = 0; bx < kTile; bx += kBlock) CastBlock(tile, bx, by);
    MarkEdges(tile);
    const int x_end = std::min(x0 + step(), view->image.width_px);
    const int y_end = std::min(y0 + step(), view->image.height_px);
    for (int y = y0; y < y_end; ++y)
      for (int x = x0; x < x_end; ++x) {
        const size_t place = static_cast<size_t>(y) * view->image.width_px + x;
        const int tx = x - tile.x0, ty = y - tile.y0;
        const Pixel& pixel = tile.at(tx, ty);
        Eigen::Map<Eigen::Vector3f>(&view->image.rgb[3 * place]) =
            pixel.edge ? EdgeLight(tile, pixel) : EvenLight(tile, tx, ty);
        view->depth_mm[place] = pixel.depth_mm;
      }
  }

 private:
  struct Tile {
    int x0 = 0, y0 = 0;
    std::vector<Pixel> pixels;           // [kTile][kTile]
    Eigen::Matrix2f direction_by_pixel;  // in the middle of the tile
    Pixel& at(int x, int y) { return pixels[static_cast<size_t>(y) * kTile + x]; }
    const Pixel& at(int x, int y) const { return pixels[static_cast<size_t>(y) * kTile + x]; }
  };

  // Way in the picture of a point at `place` (camera axes) that moves along `path`; 0 behind the camera.
  Eigen::Vector2f StreakPx(const Eigen::Vector3f& place, const Eigen::Vector3f& path) const {
    if (!(place.z() > 1)) return Eigen::Vector2f::Zero();
    const Eigen::Vector2f d = place.head<2>() / place.z();
    return (path.head<2>() - path.z() * d).cwiseProduct(focal_px_) / place.z();
  }

  void SetDirections(Tile& tile) const {
    std::array<Eigen::Vector2f, kGrid * kGrid> grid;
    for (int j = 0; j < kGrid; ++j)
      for (int i = 0; i < kGrid; ++i) {
        const auto p = camera_.Undistort({tile.x0 + i * kBlock - 0.5, tile.y0 + j * kBlock - 0.5});
        grid[j * kGrid + i] = p ? Eigen::Vector2f(p->cast<float>())
                                : Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
      }
    for (int y = 0; y < kTile; ++y)
      for (int x = 0; x < kTile; ++x) {
        const Eigen::Vector2f* const g = &grid[y / kBlock * kGrid + x / kBlock];
        const float u = (static_cast<float>(x % kBlock) + 0.5f) / kBlock;
        const float v = (static_cast<float>(y % kBlock) + 0.5f) / kBlock;
        tile.at(x, y).direction =
            (1 - v) * ((1 - u) * g[0] + u * g[1]) + v * ((1 - u) * g[kGrid] + u * g[kGrid + 1]);
      }
    const int m = kTile / 2;
    tile.direction_by_pixel << tile.at(m + 1, m).direction - tile.at(m, m).direction,
        tile.at(m, m + 1).direction - tile.at(m, m).direction;
  }

  Eigen::Vector3f WorldDirection(const Eigen::Vector2f& d) const {
    return world_from_camera_ * d.homogeneous();
  }

  void CastBlock(Tile& tile, int bx, int by) const {
    RayScene::Packet packet;
    packet.time.fill(0.5f);
    for (int k = 0; k < RayScene::kPacket; ++k)
      packet.direction[k] = WorldDirection(tile.at(bx + k % kBlock, by + k / kBlock).direction);
    std::array<RayHit, RayScene::kPacket> hits;
    scene_.rays().CastPacket(eye_mm_, packet, &hits);
    for (int k = 0; k < RayScene::kPacket; ++k)
      SetSurface(tile, hits[k], tile.at(bx + k % kBlock, by + k / kBlock));
  }

  void SetSurface(const Tile& tile, const RayHit& hit, Pixel& pixel) const {
    pixel.face = hit.face;
    pixel.from_outside = hit.from_outside;
    pixel.streak_px.setZero();
    if (hit.face < 0) return;
    const Face& face = scene_.faces()[hit.face];
    const Eigen::Vector3f& a = corners_mm_[face[0]];
    const Eigen::Vector3f ab = corners_mm_[face[1]] - a, ac = corners_mm_[face[2]] - a;
    const Eigen::Vector3f weights(1 - hit.weight_b - hit.weight_c, hit.weight_b, hit.weight_c);
    pixel.normal = ab.cross(ac);
    pixel.plane = pixel.normal.dot(a);
    pixel.depth_mm = hit.distance_mm;  // directions have z = 1
    if (!paths_mm_.empty()) {
      Eigen::Vector3f path = Eigen::Vector3f::Zero();
      for (int i = 0; i < 3; ++i) path += weights[i] * paths_mm_[face[i]];
      pixel.streak_px = StreakPx(pixel.depth_mm * pixel.direction.homogeneous(), path);
    }
    const ShadedPoint point = scene_.ShadeAt(hit.face, hit.from_outside, weights);
    pixel.printed = point.printed;
    float footprint_mm = pixel.depth_mm / focal_px_.x();
    if (point.printed) {
      const auto& board = scene_.print().of_face[hit.face];
      const Eigen::Vector2f b = (board[1] - board[0]).cast<float>(), c = (board[2] - board[0]).cast<float>();
      const Eigen::Vector3f to_b = ac.cross(a), to_c = a.cross(ab);
      for (int i = 0; i < 2; ++i) pixel.to_board[i] = b[i] * to_b + c[i] * to_c;
      pixel.board_at_corner = board[0].cast<float>();
      pixel.board = point.board;
      const auto cell_mm = static_cast<float>(scene_.board().cell_mm);
      const auto& step = tile.direction_by_pixel;
      footprint_mm = cell_mm * std::max((pixel.BoardIn(pixel.direction + step.col(0)) - point.board).norm(),
                                        (pixel.BoardIn(pixel.direction + step.col(1)) - point.board).norm());
    }
    const Coat coat = CoatOf(point, pixel.normal, pixel.direction, footprint_mm);
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

  bool GoesOn(const Pixel& p, const Pixel& q) const {
    if (p.face == q.face && p.from_outside == q.from_outside) return true;
    if (p.face < 0 || q.face < 0 || p.from_outside != q.from_outside || p.printed != q.printed) return false;
    if (scene_.IsCloth(p.face) != scene_.IsCloth(q.face)) return false;
    if (p.printed) return (p.BoardIn(q.direction) - q.board).cwiseAbs().maxCoeff() < kEvenCells;
    return std::abs(p.DepthIn(q.direction) - q.depth_mm) < kEven_mm;
  }

  // A pixel is an edge when the surface does not go on evenly to one of its neighbours, or where a surface
  // that ends nearby may pass through it during the exposure.
  void MarkEdges(Tile& tile) const {
    for (int y = 0; y < kTile; ++y)
      for (int x = 0; x < kTile; ++x) {
        Pixel& p = tile.at(x, y);
        if (x + 1 < kTile && !(GoesOn(p, tile.at(x + 1, y)) && GoesOn(tile.at(x + 1, y), p)))
          p.edge = tile.at(x + 1, y).edge = true;
        if (y + 1 < kTile && !(GoesOn(p, tile.at(x, y + 1)) && GoesOn(tile.at(x, y + 1), p)))
          p.edge = tile.at(x, y + 1).edge = true;
      }
    if (reach_ > 1) WidenEdges(tile);
  }

  void WidenEdges(Tile& tile) const {
    for (const bool across : {true, false}) {
      std::vector<char> edge(tile.pixels.size());
      for (size_t i = 0; i < edge.size(); ++i) edge[i] = tile.pixels[i].edge ? 1 : 0;
      for (int y = 0; y < kTile; ++y)
        for (int x = 0; x < kTile; ++x)
          for (int k = -reach_ + 1; k < reach_ && !tile.at(x, y).edge; ++k) {
            const int fx = across ? x + k : x, fy = across ? y : y + k;
            if (fx < 0 || fy < 0 || fx >= kTile || fy >= kTile) continue;
            tile.at(x, y).edge = edge[static_cast<size_t>(fy) * kTile + fx] != 0;
          }
    }
  }

  Eigen::Vector3f RoomLight(const Eigen::Vector2f& direction) const {
    const bool known = !std::isnan(direction.x());
    const Eigen::Vector3f world = known ? Eigen::Vector3f(WorldDirection(direction).normalized())
                                        : Eigen::Vector3f(world_from_camera_.col(2));
    return scene_.room().See(eye_mm_, world);
  }

  Eigen::Vector3f EvenLight(const Tile& tile, int x, int y) const {
    const Pixel& pixel = tile.at(x, y);
    if (pixel.face < 0) return RoomLight(pixel.direction);
    if (!pixel.printed) return pixel.plain;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const Sample& s : samples_) {
      // The place of the cloth that passes the sample at its moment is seen there at the middle of the
      // exposure.
      const Eigen::Vector2f away = s.offset_px - s.moment * pixel.streak_px;
      const int dx = static_cast<int>(std::lround(away.x())), dy = static_cast<int>(std::lround(away.y()));
      const Pixel& near = tile.at(std::clamp(x + dx, 0, kTile - 1), std::clamp(y + dy, 0, kTile - 1));
      const Pixel& on = near.printed && near.face >= 0 ? near : pixel;
      const Eigen::Vector2f board = on.BoardIn(pixel.direction + tile.direction_by_pixel * away);
      sum += on.gain * scene_.ink().At(board.x(), board.y()) + Eigen::Vector3f::Constant(on.fuzz);
    }
    return sum / static_cast<float>(samples_.size());
  }

  Eigen::Vector3f EdgeLight(const Tile& tile, const Pixel& pixel) const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    RayScene::Packet packet;
    std::array<RayHit, RayScene::kPacket> hits;
    for (size_t first = 0; first < edge_samples_.size(); first += kEdgeSamples) {
      std::array<Eigen::Vector2f, kEdgeSamples> directions;
      for (int k = 0; k < kEdgeSamples; ++k) {
        const Sample& s = edge_samples_[first + k];
        directions[k] = pixel.direction + tile.direction_by_pixel * s.offset_px;
        packet.direction[k] = WorldDirection(directions[k]);
        packet.time[k] = std::clamp(0.5f + s.moment, 0.0f, 1.0f);
      }
      scene_.rays().CastPacket(eye_mm_, packet, &hits);
      for (int k = 0; k < kEdgeSamples; ++k) sum += HitLight(hits[k], directions[k]);
    }
    return sum / static_cast<float>(edge_samples_.size());
  }

  Eigen::Vector3f HitLight(const RayHit& hit, const Eigen::Vector2f& direction) const {
    if (hit.face < 0) return RoomLight(direction);
    const Eigen::Vector3f weights(1 - hit.weight_b - hit.weight_c, hit.weight_b, hit.weight_c);
    const ShadedPoint point = scene_.ShadeAt(hit.face, hit.from_outside, weights);
    const Face& face = scene_.faces()[hit.face];
    const Eigen::Vector3f& a = corners_mm_[face[0]];
    const Eigen::Vector3f normal = (corners_mm_[face[1]] - a).cross(corners_mm_[face[2]] - a);
    const Coat coat = CoatOf(point, normal, direction, hit.distance_mm / focal_px_.x());
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
  std::vector<Sample> samples_, edge_samples_;
  int reach_ = 1;  // margin of the tiles
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
  const ViewTracer tracer(scene, camera, options);
  const int step = tracer.step();
  const int across = (camera.width_px + step - 1) / step, down = (camera.height_px + step - 1) / step;
  tbb::parallel_for(0, across * down,
                    [&](int t) { tracer.TraceTile(t % across * step, t / across * step, &view); });
  return view;
}

}  // namespace weft
