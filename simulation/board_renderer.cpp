#include "simulation/board_renderer.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/status_macros.h"
#include "capture/calibration/tag_detection.h"

namespace weft {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

// A board, or the tag at one end of a scale bar, in camera axes.
class Surface {
 public:
  static absl::StatusOr<Surface> Make(const TagBoard& board, const BoardWarp& warp,
                                      const RigidPose& camera_from_board, const BoardLookOptions& look) {
    Surface out(board, warp, camera_from_board, look);
    for (const int tag : board.tag_ids) {
      WEFT_ASSIGN_OR_RETURN(std::vector<uint8_t> modules, TagModules(board.family, tag));
      out.tags_.push_back(std::move(modules));
    }
    return out;
  }

  // Light from where the ray meets it and the depth there; kNone where it passes.
  double Meet(const Eigen::Vector3d& ray, double* light) const {
    const Eigen::Vector3d along = board_from_camera_.rotation * ray;
    const Eigen::Vector3d& from = board_from_camera_.translation_mm;
    if (std::abs(along.z()) < 1e-9) return kNone;
    Eigen::Vector2d flat = Eigen::Vector2d::Zero();
    double depth = -from.z() / along.z();
    for (int round = 0; round < 3; ++round) {
      const Eigen::Vector3d at = from + depth * along;
      flat = {at.x() / (1 + warp_.stretch / 2), at.y() / (1 - warp_.stretch / 2)};
      if (std::abs(flat.x()) > half_.x() || std::abs(flat.y()) > half_.y()) return kNone;
      depth = (WarpedPoint(board_, warp_, flat).z() - from.z()) / along.z();
    }
    if (!(depth > 0)) return kNone;
    *light = shade_ * (along.z() > 0 && IsBlack(flat) ? look_.black : look_.white);
    return depth;
  }

  // Pixels around everything that may show it.
  Eigen::AlignedBox2d Bounds(const CameraModel& camera) const {
    Eigen::AlignedBox2d box;
    const RigidPose camera_from_board = board_from_camera_.Inverse();
    for (int i = 0; i <= 8; ++i) {
      for (int j = 0; j <= 8; ++j) {
        const Eigen::Vector2d at = half_.cwiseProduct(Eigen::Vector2d(i / 4.0 - 1, j / 4.0 - 1));
        CameraModel own = camera;
        SetCameraFromWorld({}, &own);
        const auto pixel = own.Project(camera_from_board * Eigen::Vector3d(at.x(), at.y(), 0));
        // Outside of what the lens shows: anywhere.
        if (!pixel) return {Eigen::Vector2d(-1e9, -1e9), Eigen::Vector2d(1e9, 1e9)};
        box.extend(*pixel);
      }
    }
    const Eigen::Vector2d more = 0.05 * box.sizes() + Eigen::Vector2d(10, 10);
    return {box.min() - more, box.max() + more};
  }

 private:
  Surface(const TagBoard& board, const BoardWarp& warp, const RigidPose& camera_from_board,
          const BoardLookOptions& look)
      : board_(board),
        warp_(warp),
        look_(look),
        family_(*FindTagFamily(board.family)),
        board_from_camera_(camera_from_board.Inverse()),
        half_(board.width_mm() / 2 + look.margin_mm, board.height_mm() / 2 + look.margin_mm) {
    const double facing =
        camera_from_board.rotation.col(2).dot(camera_from_board.translation_mm.normalized());
    shade_ = 1 - 2 * look.shading * (1 - std::abs(facing));
  }

  bool IsBlack(const Eigen::Vector2d& flat) const {
    const double pitch = board_.tag_mm + board_.gap_mm, module = board_.tag_mm / family_.border_modules;
    const double x = flat.x() + board_.width_mm() / 2, y = flat.y() + board_.height_mm() / 2;
    const int col = static_cast<int>(std::floor((x + board_.gap_mm / 2) / pitch)),
              row = static_cast<int>(std::floor((y + board_.gap_mm / 2) / pitch));
    if (col < 0 || col >= board_.cols || row < 0 || row >= board_.rows) return false;
    const double quiet = (family_.width_modules - family_.border_modules) / 2;
    const int mx = static_cast<int>(std::floor((x - col * pitch) / module + quiet)),
              my = static_cast<int>(std::floor((y - row * pitch) / module + quiet));
    if (mx < 0 || my < 0 || mx >= family_.width_modules || my >= family_.width_modules) return false;
    return tags_[row * board_.cols + col][my * family_.width_modules + mx] == 0;
  }

  TagBoard board_;
  BoardWarp warp_;
  BoardLookOptions look_;
  TagFamilyInfo family_;
  RigidPose board_from_camera_;
  Eigen::Vector2d half_;
  double shade_ = 1;
  std::vector<std::vector<uint8_t>> tags_;
};

absl::StatusOr<std::vector<Surface>> SurfacesOf(const MovedTarget& moved, int frame,
                                                const CameraModel& camera, const BoardLookOptions& look) {
  std::vector<Surface> out;
  const RigidPose camera_from_world = CameraFromWorld(camera);
  const auto add = [&](const TagBoard& board, const BoardWarp& warp, const RigidPose& pose) -> absl::Status {
    absl::StatusOr<Surface> surface = Surface::Make(board, warp, camera_from_world * pose, look);
    if (surface.ok()) out.push_back(*std::move(surface));
    return surface.status();
  };
  absl::Status status;
  for (const BoardPlacement& p : moved.placements) {
    if (p.frame == frame)
      status.Update(add(moved.target.boards[p.board], moved.warps[p.board], p.world_from_board));
  }
  for (size_t b = 0; b < moved.target.scale_bars.size(); ++b) {
    const ScaleBar& bar = moved.target.scale_bars[b];
    const RigidPose& pose =
        moved.world_from_bar[static_cast<size_t>(frame) * moved.target.scale_bars.size() + b];
    for (const double side : {-0.5, 0.5}) {
      const TagBoard end{
          bar.id, bar.family, 1, 1, look.bar_tag_mm, 0, {side < 0 ? bar.first_tag : bar.second_tag}};
      status.Update(
          add(end, {}, pose * RigidPose{Eigen::Matrix3d::Identity(), {side * bar.length_mm, 0, 0}}));
    }
  }
  if (!status.ok()) return status;
  return out;
}

// Rays (x, y, 1) in camera axes: exact every few pixels, interpolated between.
class Rays {
 public:
  explicit Rays(const CameraModel& camera)
      : cols_(camera.width_px / kStep + 3),
        exact_(static_cast<size_t>(cols_) * (camera.height_px / kStep + 3)) {
    tbb::parallel_for(size_t{0}, exact_.size() / cols_, [&](size_t row) {
      for (int col = 0; col < cols_; ++col) {
        const auto p = camera.Undistort({(col - 1) * kStep, (static_cast<double>(row) - 1) * kStep});
        exact_[row * cols_ + col] =
            p.value_or(Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
      }
    });
  }
  Eigen::Vector3d At(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d at = pixel / kStep + Eigen::Vector2d::Ones();
    const double fx = std::floor(at.x()), fy = std::floor(at.y()), u = at.x() - fx, v = at.y() - fy;
    const Eigen::Vector2d* p = &exact_[static_cast<size_t>(fy) * cols_ + static_cast<size_t>(fx)];
    const Eigen::Vector2d ray =
        (1 - v) * ((1 - u) * p[0] + u * p[1]) + v * ((1 - u) * p[cols_] + u * p[cols_ + 1]);
    return {ray.x(), ray.y(), 1};
  }

 private:
  static constexpr int kStep = 8;
  int cols_;
  std::vector<Eigen::Vector2d> exact_;
};

}  // namespace

absl::Status BoardLookOptions::Validate() const {
  if (!(margin_mm >= 0)) return absl::InvalidArgumentError("board look: margin_mm must not be negative");
  if (samples < 1 || samples > 16) return absl::InvalidArgumentError("board look: samples must be 1 to 16");
  if (!(bar_tag_mm > 0)) return absl::InvalidArgumentError("board look: bar_tag_mm must be positive");
  if (!(blur_along_px >= 0 && blur_along_px < 16))
    return absl::InvalidArgumentError("board look: blur_along_px must be 0 to 16");
  absl::Status status = lens.Validate();
  status.Update(sensor.Validate());
  return status;
}

absl::StatusOr<Frame> RenderBoards(const MovedTarget& moved, int frame, const CameraModel& camera,
                                   const BoardLookOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(const std::vector<Surface> surfaces, SurfacesOf(moved, frame, camera, options));
  const Rays rays(camera);
  std::vector<Eigen::AlignedBox2d> bounds;
  for (const Surface& surface : surfaces) bounds.push_back(surface.Bounds(camera));
  LinearImage image{camera.width_px, camera.height_px, {}};
  image.rgb.assign(size_t{3} * camera.width_px * camera.height_px, static_cast<float>(options.room));
  const int n = options.samples;
  tbb::parallel_for(0, camera.height_px, [&](int y) {
    for (int x = 0; x < camera.width_px; ++x) {
      std::vector<const Surface*> near;
      for (size_t s = 0; s < bounds.size(); ++s) {
        if (bounds[s].contains(Eigen::Vector2d(x, y))) near.push_back(&surfaces[s]);
      }
      if (near.empty()) continue;
      double sum = 0;
      for (int i = 0; i < n * n; ++i) {
        // Rows of samples are shifted against each other, and columns too, or edges along the pixels would
        // jump.
        const double along = (i % n + (i / n + 0.5) / n) / n, across = (i / n + (i % n + 0.5) / n) / n;
        Eigen::Vector2d at(x + along - 0.5, y + across - 0.5);
        // Moments of the exposure in an order that has nothing to do with the places in the pixel.
        const double moment = (i * 7 % (n * n) + 0.5) / (n * n) - 0.5;
        at += options.blur_along_px * moment * Eigen::Vector2d(0.8, 0.6);
        const Eigen::Vector3d ray =
            rays.At(at.cwiseMax(-7).cwiseMin(Eigen::Vector2d(camera.width_px + 7, camera.height_px + 7)));
        double nearest = kNone, light = options.room;
        for (const Surface* surface : near) {
          double here = 0;
          const double depth = surface->Meet(ray, &here);
          if (depth >= nearest) continue;
          nearest = depth;
          light = here;
        }
        sum += light;
      }
      std::fill_n(image.at(x, y), 3, static_cast<float>(sum / (n * n)));
    }
  });
  Vignette(options.lens.vignetting, &image);
  BlurGaussian(options.lens.point_spread_sigma_px, &image);
  const Frame color = ToFrame(DevelopImage(image, options.sensor, camera.id, frame));
  Frame grey = color;
  grey.format = PixelFormat::kGrey8;
  auto values = std::make_shared<std::vector<uint8_t>>(color.pixels->size() / 3);
  for (size_t i = 0; i < values->size(); ++i) (*values)[i] = (*color.pixels)[3 * i + 1];
  grey.pixels = std::move(values);
  return grey;
}

}  // namespace weft
