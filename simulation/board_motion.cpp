#include "simulation/board_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "base/angles.h"
#include "simulation/random.h"

namespace weft {
namespace {

// Random numbers of one use, one after the other.
class Dice {
 public:
  explicit Dice(uint64_t key) : key_(key) {}
  double Uniform(double low, double high) { return low + (high - low) * UniformOf(key_, next_++); }
  double Normal() { return NormalOf(key_, next_++); }
  Eigen::Vector3d InBox(const Eigen::Vector3d& reach) {
    const double x = Uniform(-1, 1), y = Uniform(-1, 1), z = Uniform(-1, 1);
    return Eigen::Vector3d(x, y, z).cwiseProduct(reach);
  }

 private:
  uint64_t key_;
  uint64_t next_ = 0;
};

// A board at `place` whose printed side faces `camera` but for a tilt, turned in its plane at random.
RigidPose FacePlace(const Eigen::Vector3d& place, const Eigen::Vector3d& camera, double tilt_deg,
                    Dice& dice) {
  const Eigen::Matrix3d facing =
      Eigen::Quaterniond::FromTwoVectors(-Eigen::Vector3d::UnitZ(), (camera - place).normalized())
          .toRotationMatrix();
  const double about = dice.Uniform(0, 2 * std::numbers::pi), tilt = kRadPerDeg * dice.Uniform(0, tilt_deg),
               roll = dice.Uniform(0, 2 * std::numbers::pi);
  const Eigen::Vector3d axis(std::cos(about), std::sin(about), 0);
  return {facing * Eigen::AngleAxisd(tilt, axis).toRotationMatrix() *
              Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
          place};
}

bool Faces(const RigidPose& world_from_board, const CameraModel& camera, double max_facing_deg) {
  const Eigen::Vector3d to_camera = (camera.CenterWorld() - world_from_board.translation_mm).normalized();
  return -world_from_board.rotation.col(2).dot(to_camera) > std::cos(kRadPerDeg * max_facing_deg);
}

class Sight {
 public:
  Sight(const Rig& rig, const BoardSightOptions& options) : rig_(rig), options_(options) {}

  std::optional<Eigen::Vector2d> Pixel(int camera, const Eigen::Vector3d& world, Dice& noise) const {
    const CameraModel& model = rig_.cameras[camera];
    const std::optional<Eigen::Vector2d> pixel = model.Project(world);
    if (!pixel || !model.Contains(*pixel)) return std::nullopt;
    const double x = noise.Normal(), y = noise.Normal();
    return *pixel + options_.noise_px * Eigen::Vector2d(x, y);
  }

  BoardView See(int camera, const BoardPlacement& placement, const TagBoard& board,
                const BoardWarp& warp) const {
    BoardView view{camera, placement.frame, placement.board, 0, {}};
    if (!Faces(placement.world_from_board, rig_.cameras[camera], options_.max_facing_deg)) return view;
    Dice noise(
        KeyOf(options_.seed, absl::StrCat("corners ", camera, " ", placement.frame, " ", placement.board)));
    for (int tag = 0; tag < board.rows * board.cols; ++tag) {
      std::vector<BoardCorner> corners;
      for (int k = 0; k < 4; ++k) {
        const int index = 4 * tag + k;
        const Eigen::Vector3d at = WarpedPoint(board, warp, FlatCorner(board, index).head<2>());
        if (const auto pixel = Pixel(camera, placement.world_from_board * at, noise))
          corners.push_back({index, *pixel});
      }
      if (corners.size() == 4) view.corners.insert(view.corners.end(), corners.begin(), corners.end());
    }
    return view;
  }

 private:
  const Rig& rig_;
  const BoardSightOptions& options_;
};

}  // namespace

absl::Status BoardMotionOptions::Validate() const {
  if (frames < 1) return absl::InvalidArgumentError("board motion: frames must be at least 1");
  if (!(reach_mm.minCoeff() >= 0))
    return absl::InvalidArgumentError("board motion: reach_mm must not be negative");
  if (!(tilt_deg >= 0 && tilt_deg < 90))
    return absl::InvalidArgumentError("board motion: tilt_deg must be 0 to 90");
  return absl::OkStatus();
}

absl::StatusOr<MovedTarget> MoveTarget(const CalibrationTarget& target, const Rig& rig,
                                       const BoardMotionOptions& options) {
  absl::Status status = options.Validate();
  status.Update(target.Validate());
  status.Update(rig.Validate());
  if (!status.ok()) return status;
  MovedTarget out;
  out.target = target;
  Dice shapes(KeyOf(options.seed, "shapes"));
  for (size_t b = 0; b < target.boards.size(); ++b) {
    BoardWarp& warp = out.warps.emplace_back();
    for (double* bend : {&warp.bend_xx_mm, &warp.bend_xy_mm, &warp.bend_yy_mm})
      *bend = options.bend_mm * shapes.Normal();
    warp.stretch = options.stretch * shapes.Normal();
  }
  Dice motion(KeyOf(options.seed, "motion"));
  size_t faced = 0;
  for (int frame = 0; frame < options.frames; ++frame) {
    for (size_t b = 0; b < target.boards.size(); ++b) {
      // Steps with a common divisor would leave cameras out.
      const Eigen::Vector3d camera = rig.cameras[faced++ % rig.cameras.size()].CenterWorld();
      const Eigen::Vector3d place = options.middle_mm + motion.InBox(options.reach_mm);
      out.placements.push_back(
          {frame, static_cast<int>(b), FacePlace(place, camera, options.tilt_deg, motion)});
    }
    for (size_t bar = 0; bar < target.scale_bars.size(); ++bar) {
      const Eigen::Vector3d camera = rig.cameras[faced++ % rig.cameras.size()].CenterWorld();
      const Eigen::Vector3d place = options.middle_mm + 0.5 * motion.InBox(options.reach_mm);
      out.world_from_bar.push_back(FacePlace(place, camera, options.tilt_deg, motion));
    }
  }
  return out;
}

CalibrationViews SeeTarget(const MovedTarget& moved, const Rig& rig, const BoardSightOptions& options) {
  CalibrationViews out;
  int frames = 0;
  for (const BoardPlacement& p : moved.placements) frames = std::max(frames, p.frame + 1);
  for (int frame = 0; frame < frames; ++frame) out.frames.push_back(absl::StrCat(frame));
  for (const CameraModel& camera : rig.cameras)
    out.cameras.push_back({camera.id, camera.width_px, camera.height_px});
  const Sight sight(rig, options);
  for (const BoardPlacement& placement : moved.placements) {
    for (int c = 0; c < static_cast<int>(rig.cameras.size()); ++c) {
      BoardView view =
          sight.See(c, placement, moved.target.boards[placement.board], moved.warps[placement.board]);
      if (!view.corners.empty()) out.boards.push_back(std::move(view));
    }
  }
  const size_t bars = moved.target.scale_bars.size();
  for (size_t i = 0; i < moved.world_from_bar.size(); ++i) {
    const int frame = static_cast<int>(i / bars), bar = static_cast<int>(i % bars);
    const RigidPose& pose = moved.world_from_bar[i];
    for (int c = 0; c < static_cast<int>(rig.cameras.size()); ++c) {
      if (!Faces(pose, rig.cameras[c], options.max_facing_deg)) continue;
      Dice noise(KeyOf(options.seed, absl::StrCat("bar ", c, " ", frame, " ", bar)));
      for (int end = 0; end < 2; ++end) {
        const double along_mm = (end - 0.5) * moved.target.scale_bars[bar].length_mm;
        const auto pixel = sight.Pixel(c, pose * Eigen::Vector3d(along_mm, 0, 0), noise);
        if (pixel) out.bar_ends.push_back({c, frame, bar, end, *pixel});
      }
    }
  }
  return out;
}

}  // namespace weft
