#include "capture/calibration/checks.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/median.h"
#include "capture/calibration/covisibility.h"

namespace weft {
namespace {

// "camera a", "cameras a, b and 3 more".
std::string Name(const std::vector<CalibrationCamera>& cameras, const std::vector<int>& which) {
  constexpr size_t kMost = 8;
  std::vector<std::string> ids;
  for (size_t i = 0; i < std::min(kMost, which.size()); ++i) ids.push_back(cameras[which[i]].id);
  std::string out = absl::StrCat(which.size() == 1 ? "camera " : "cameras ", absl::StrJoin(ids, ", "));
  if (which.size() > kMost) absl::StrAppend(&out, " and ", which.size() - kMost, " more");
  return out;
}

// How the tags of a view lie against the board's description: an affine map from board to picture.
struct Layout {
  bool checked = false;
  bool mirrored = false;
  double misfit = 0;  // root mean square, in parts of the view's own spread
};
Layout AssessLayout(const TagBoard& board, const BoardView& view) {
  std::vector<Eigen::Vector3d> on_board;
  std::vector<Eigen::Vector2d> in_picture;
  std::map<int, std::pair<Eigen::Vector2d, Eigen::Vector2d>> tags;  // sums over their corners
  for (const BoardCorner& corner : view.corners) {
    auto& [place, pixel] =
        tags.try_emplace(corner.index / 4, Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()).first->second;
    place += FlatCorner(board, corner.index).head<2>() / 4;
    pixel += corner.pixel_px / 4;
  }
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& [tag, sums] : tags) {
    on_board.emplace_back(sums.first.x() / board.width_mm(), sums.first.y() / board.height_mm(), 1);
    in_picture.push_back(sums.second);
    mean += sums.second / static_cast<double>(tags.size());
  }
  Layout out;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> rhs = Eigen::Matrix<double, 3, 2>::Zero();
  for (size_t i = 0; i < on_board.size(); ++i) {
    normal += on_board[i] * on_board[i].transpose();
    rhs += on_board[i] * in_picture[i].transpose();
  }
  // Tags on a line tell nothing.
  if (on_board.size() < 5 || normal.determinant() < 1e-4 * std::pow(static_cast<double>(on_board.size()), 3))
    return out;
  const Eigen::Matrix<double, 3, 2> affine = normal.ldlt().solve(rhs);
  double off = 0, spread = 0;
  for (size_t i = 0; i < on_board.size(); ++i) {
    off += (affine.transpose() * on_board[i] - in_picture[i]).squaredNorm();
    spread += (in_picture[i] - mean).squaredNorm();
  }
  out.checked = true;
  out.mirrored = affine.topRows<2>().determinant() < 0;
  out.misfit = std::sqrt(off / spread);
  return out;
}

class ViewChecks {
 public:
  ViewChecks(const CalibrationTarget& target, const CalibrationViews& views,
             const std::vector<CameraSightings>& sightings, const CalibrationCheckOptions& options)
      : target_(target),
        views_(views),
        sightings_(sightings),
        options_(options),
        count_(views.cameras.size()) {}

  std::vector<CalibrationIssue> Run() {
    const Covisibility covisibility = CountSharedViews(views_);
    Layouts();
    Blur();
    Unseen(covisibility);
    DisconnectedGroups(covisibility);
    Counts(covisibility);
    Coverage(covisibility);
    return issues_;
  }

 private:
  void Add(CalibrationFault fault, std::vector<int> cameras, std::string message) {
    issues_.push_back({fault, std::move(cameras), std::move(message)});
  }

  void Layouts() {
    for (size_t b = 0; b < target_.boards.size(); ++b) {
      int checked = 0, mirrored = 0, wrong = 0;
      for (const BoardView& view : views_.boards) {
        if (view.board != static_cast<int>(b)) continue;
        const Layout layout = AssessLayout(target_.boards[b], view);
        checked += layout.checked;
        mirrored += layout.checked && layout.mirrored;
        wrong += layout.checked && layout.misfit > 0.25;
      }
      const TagBoard& board = target_.boards[b];
      if (2 * wrong > checked) {
        Add(CalibrationFault::kWrongLayout, {},
            absl::StrCat("board ", board.id, ": its tags do not lie as target.json says in ", wrong, " of ",
                         checked, " views; give the rows, cols and tag_ids of the board that was printed"));
      } else if (2 * mirrored > checked) {
        Add(CalibrationFault::kMirroredBoard, {},
            absl::StrCat("board ", board.id, ": mirrored in ", mirrored, " of ", checked,
                         " views: its tags run the other way round than target.json says; correct the order "
                         "of tag_ids, or print the board again unmirrored"));
      }
    }
  }

  void Blur() {
    for (size_t c = 0; c < sightings_.size(); ++c) {
      const CameraSightings& s = sightings_[c];
      const int all = s.tags + s.blurred_tags;
      if (all < 20 || s.blurred_tags <= options_.max_blurred_share * all) continue;
      unsharp_.push_back(static_cast<int>(c));
      Add(CalibrationFault::kBlurred, {static_cast<int>(c)},
          absl::StrFormat(
              "camera %s: %d of %d tags are blurred (typically %.1f px); move the board more slowly, expose "
              "for a shorter time, or focus the camera",
              views_.cameras[c].id, s.blurred_tags, all, s.blurred_px));
    }
  }

  void Unseen(const Covisibility& covisibility) {
    for (size_t c = 0; c < count_; ++c) {
      if (covisibility.shared[c][c] > 0) continue;
      unseen_.push_back(static_cast<int>(c));
      const CameraSightings seen = c < sightings_.size() ? sightings_[c] : CameraSightings{};
      const std::string& id = views_.cameras[c].id;
      if (seen.mirrored) {
        Add(CalibrationFault::kMirroredImages, {static_cast<int>(c)},
            absl::StrCat("camera ", id,
                         ": its images are mirrored, tags are found only with left and right exchanged; "
                         "switch off the camera's flip (ReverseX)"));
        continue;
      }
      if (std::find(unsharp_.begin(), unsharp_.end(), static_cast<int>(c)) != unsharp_.end()) continue;
      const bool blurred = seen.moving_edge_px > options_.max_moving_edge_px;
      Add(blurred ? CalibrationFault::kBlurred : CalibrationFault::kCameraUnseen, {static_cast<int>(c)},
          blurred
              ? absl::StrFormat("camera %s: no tag can be read in %d images, they are too blurred: what "
                                "moves in them has edges of about %.1f px; focus the camera, move the board "
                                "more slowly, or expose for a shorter time",
                                id, seen.images, seen.moving_edge_px)
              : absl::StrCat("camera ", id, ": saw no board in ", seen.images, " images", WhyUnseen(seen)));
    }
  }

  // What speaks for one cause or another where no blur does.
  static std::string WhyUnseen(const CameraSightings& seen) {
    if (seen.small_tags > seen.unclear_tags) {
      return absl::StrCat(" (", seen.small_tags, " tags are too small, ", seen.unclear_tags,
                          " hidden or without contrast); bring the boards nearer, or print larger tags");
    }
    if (seen.unclear_tags > 0) {
      return absl::StrCat(" (", seen.small_tags, " tags are too small, ", seen.unclear_tags,
                          " hidden or without contrast); check its light");
    }
    if (seen.moving_edge_px > 0) {
      return absl::StrFormat(
          ", though something moves there and is sharp (edges of %.1f px); turn the boards' printed side to "
          "it, and check that they are those of target.json and their tags large enough",
          seen.moving_edge_px);
    }
    return "; nothing moves in them: show it the boards, or check its light, cover and direction";
  }

  // Behind a count of views: what was refused.
  std::string Refused(size_t camera) const {
    if (camera >= sightings_.size()) return "";
    const CameraSightings& seen = sightings_[camera];
    if (seen.small_tags + seen.blurred_tags + seen.unclear_tags == 0) return "";
    return absl::StrCat(" (of its tags ", seen.small_tags, " are too small, ", seen.blurred_tags,
                        " blurred, ", seen.unclear_tags, " hidden or without contrast)");
  }

  void DisconnectedGroups(const Covisibility& covisibility) {
    std::vector<std::vector<int>> groups;
    for (const std::vector<int>& group : covisibility.groups) {
      if (covisibility.shared[group[0]][group[0]] > 0) groups.push_back(group);
    }
    for (size_t i = 1; i < groups.size(); ++i) {
      Add(CalibrationFault::kDisconnected, groups[i],
          absl::StrCat(Name(views_.cameras, groups[i]), groups[i].size() == 1 ? " shares" : " share",
                       " no board with ", Name(views_.cameras, groups[0]),
                       "; show boards where cameras of both groups see them at the same moment"));
    }
    groups_ = groups.size();
  }

  void Counts(const Covisibility& covisibility) {
    const std::vector<int> shared = SharedViews(views_);
    for (size_t c = 0; c < count_; ++c) {
      const int views = covisibility.shared[c][c];
      if (views == 0) continue;
      const std::string& id = views_.cameras[c].id;
      if (views < options_.min_views) {
        Add(CalibrationFault::kTooFewViews, {static_cast<int>(c)},
            absl::StrCat("camera ", id, ": ", views, " views of boards, at least ", options_.min_views,
                         " are needed", Refused(c), "; show it the boards from more sides and distances"));
      } else if (shared[c] < options_.min_shared_views && groups_ <= 1) {
        Add(CalibrationFault::kTooFewViews, {static_cast<int>(c)},
            absl::StrCat("camera ", id, ": shares ", shared[c], " of its ", views,
                         " views with another camera, at least ", options_.min_shared_views,
                         " are needed; show boards where its neighbours see them too"));
      }
    }
  }

  void Coverage(const Covisibility& covisibility) {
    static constexpr const char* kPlaces[9] = {
        "top left", "top", "top right", "left", "middle", "right", "bottom left", "bottom", "bottom right"};
    for (size_t c = 0; c < count_; ++c) {
      if (covisibility.shared[c][c] < options_.min_views) continue;
      const std::array<int, 9> coverage = CornerCoverage(views_, static_cast<int>(c));
      std::vector<std::string> bare;
      for (int i = 0; i < 9; ++i) {
        if (coverage[i] == 0) bare.push_back(kPlaces[i]);
      }
      if (9 - static_cast<int>(bare.size()) >= options_.min_covered_cells) continue;
      Add(CalibrationFault::kPoorCoverage, {static_cast<int>(c)},
          absl::StrCat("camera ", views_.cameras[c].id, ": ",
                       views_.boards.empty() ? 0 : covisibility.shared[c][c], " views leave the ",
                       absl::StrJoin(bare, ", "),
                       " of its image bare, where its lens stays unknown; show boards there"));
    }
  }

  const CalibrationTarget& target_;
  const CalibrationViews& views_;
  const std::vector<CameraSightings>& sightings_;
  const CalibrationCheckOptions& options_;
  const size_t count_;
  size_t groups_ = 0;
  std::vector<int> unsharp_, unseen_;
  std::vector<CalibrationIssue> issues_;
};

}  // namespace

std::string CalibrationFaultName(CalibrationFault fault) {
  switch (fault) {
    case CalibrationFault::kCameraUnseen:
      return "camera_unseen";
    case CalibrationFault::kMirroredImages:
      return "mirrored_images";
    case CalibrationFault::kMirroredBoard:
      return "mirrored_board";
    case CalibrationFault::kWrongLayout:
      return "wrong_layout";
    case CalibrationFault::kBlurred:
      return "blurred";
    case CalibrationFault::kTooFewViews:
      return "too_few_views";
    case CalibrationFault::kDisconnected:
      return "disconnected";
    case CalibrationFault::kPoorCoverage:
      return "poor_coverage";
    case CalibrationFault::kHighResidual:
      return "high_residual";
    case CalibrationFault::kWrongScale:
      return "wrong_scale";
    case CalibrationFault::kUncertain:
      return "uncertain";
    case CalibrationFault::kChanged:
      return "changed";
    case CalibrationFault::kWrongUnit:
      return "wrong_unit";
  }
  return "";
}

absl::Status CalibrationCheckOptions::Validate() const {
  if (min_views < 3) return absl::InvalidArgumentError("min_views must be at least 3");
  if (min_covered_cells < 1 || min_covered_cells > 9) {
    return absl::InvalidArgumentError("min_covered_cells must be 1 to 9");
  }
  if (!(max_rms_px > 0)) return absl::InvalidArgumentError("max_rms_px must be positive");
  if (!(max_scale_error > 0)) return absl::InvalidArgumentError("max_scale_error must be positive");
  return absl::OkStatus();
}

std::array<int, 9> CornerCoverage(const CalibrationViews& views, int camera) {
  std::array<int, 9> out{};
  const CalibrationCamera& size = views.cameras[camera];
  for (const BoardView& view : views.boards) {
    if (view.camera != camera) continue;
    for (const BoardCorner& corner : view.corners) {
      const int col = std::clamp(static_cast<int>(3 * (corner.pixel_px.x() + 0.5) / size.width_px), 0, 2);
      const int row = std::clamp(static_cast<int>(3 * (corner.pixel_px.y() + 0.5) / size.height_px), 0, 2);
      ++out[3 * row + col];
    }
  }
  return out;
}

std::vector<CalibrationIssue> CheckViews(const CalibrationTarget& target, const CalibrationViews& views,
                                         const std::vector<CameraSightings>& sightings,
                                         const CalibrationCheckOptions& options) {
  return ViewChecks(target, views, sightings, options).Run();
}

absl::Status IssuesStatus(const std::vector<CalibrationIssue>& issues) {
  if (issues.empty()) return absl::OkStatus();
  std::vector<std::string> lines;
  constexpr size_t kMost = 12;
  for (size_t i = 0; i < std::min(kMost, issues.size()); ++i) lines.push_back(issues[i].message);
  if (issues.size() > kMost) lines.push_back(absl::StrCat("and ", issues.size() - kMost, " more"));
  return absl::FailedPreconditionError(absl::StrJoin(lines, "\n  "));
}

}  // namespace weft
