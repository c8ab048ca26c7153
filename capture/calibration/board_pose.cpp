#include "capture/calibration/board_pose.h"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace weft {

std::vector<BoardPoseGuess> GuessBoardPose(const TagBoard& board, const std::vector<BoardCorner>& corners,
                                           const CameraModel& camera) {
  std::vector<cv::Point3d> on_board;
  std::vector<cv::Point2d> in_camera;
  for (const BoardCorner& corner : corners) {
    const std::optional<Eigen::Vector2d> p = camera.Undistort(corner.pixel_px);
    if (!p) continue;
    const Eigen::Vector3d flat = FlatCorner(board, corner.index);
    on_board.emplace_back(flat.x(), flat.y(), 0);
    in_camera.emplace_back(p->x(), p->y());
  }
  if (on_board.size() < 4) return {};
  std::vector<cv::Mat> turns, shifts;
  try {
    cv::solvePnPGeneric(on_board, in_camera, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), turns, shifts, false,
                        cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return {};  // corners on a line
  }
  std::vector<BoardPoseGuess> out;
  for (size_t i = 0; i < turns.size(); ++i) {
    const Eigen::Vector3d turn(turns[i].at<double>(0), turns[i].at<double>(1), turns[i].at<double>(2));
    BoardPoseGuess guess;
    const double angle = turn.norm();
    if (angle > 0)
      guess.camera_from_board.rotation = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
    guess.camera_from_board.translation_mm = {shifts[i].at<double>(0), shifts[i].at<double>(1),
                                              shifts[i].at<double>(2)};
    double sum = 0;
    for (size_t k = 0; k < on_board.size(); ++k) {
      const Eigen::Vector3d x = guess.camera_from_board * Eigen::Vector3d(on_board[k].x, on_board[k].y, 0);
      sum += std::pow(camera.fx_px * (x.x() / x.z() - in_camera[k].x), 2) +
             std::pow(camera.fy_px * (x.y() / x.z() - in_camera[k].y), 2);
      if (!(x.z() > 0)) sum = std::numeric_limits<double>::infinity();
    }
    guess.rms_px = std::sqrt(sum / static_cast<double>(2 * on_board.size()));
    if (std::isfinite(guess.rms_px) && guess.camera_from_board.translation_mm.allFinite())
      out.push_back(guess);
  }
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.rms_px < b.rms_px; });
  return out;
}

}  // namespace weft
