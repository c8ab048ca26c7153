#include "capture/calibration/rig_initialization.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/calibration/board_pose.h"
#include "capture/calibration/bundle_adjustment.h"

namespace weft {
namespace {

constexpr double kAmbiguousRatio = 3;  // of the residuals of the two poses of a flat board
constexpr size_t kBoardsPerPair = 12;  // looked at for the relative pose of two cameras
constexpr double kSameTurn = 0.03;     // rad, between estimates that confirm each other ...
constexpr double kSameShift = 0.03;    // ... and of the distance to the board
constexpr double kResidualCapPx = 50;

using Hypotheses = std::vector<RigidPose>;  // camera_from_board, best first

// The estimate that most groups confirm, each by any of its own; `groups` are boards, `reach_mm` the distance
// at which their poses matter.
struct Consensus {
  RigidPose pose;
  int confirmed = 0;
};
Consensus MostConfirmed(const std::vector<std::vector<RigidPose>>& groups, double reach_mm) {
  Consensus best;
  double best_spread = std::numeric_limits<double>::infinity();
  for (const std::vector<RigidPose>& group : groups) {
    for (const RigidPose& candidate : group) {
      int confirmed = 0;
      double spread = 0;
      for (const std::vector<RigidPose>& others : groups) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const RigidPose& other : others) {
          const double turn = (candidate.rotation - other.rotation).norm() / std::sqrt(2.0) / kSameTurn;
          const double shift =
              (candidate.translation_mm - other.translation_mm).norm() / (kSameShift * reach_mm);
          nearest = std::min(nearest, std::max(turn, shift));
        }
        if (nearest > 1) continue;
        ++confirmed;
        spread += nearest;
      }
      if (confirmed > best.confirmed || (confirmed == best.confirmed && spread < best_spread)) {
        best = {candidate, confirmed};
        best_spread = spread;
      }
    }
  }
  return best;
}

class Initializer {
 public:
  explicit Initializer(CalibrationBundle& bundle) : bundle_(bundle), hypotheses_(bundle.views.size()) {
    tbb::parallel_for(size_t{0}, bundle.views.size(),
                      [&](size_t v) { hypotheses_[v] = PosesOf(bundle.views[v]); });
    views_of_camera_.resize(bundle.cameras.size());
    views_of_placement_.resize(bundle.placements.size());
    for (size_t v = 0; v < bundle.views.size(); ++v) {
      if (hypotheses_[v].empty()) continue;
      views_of_camera_[bundle.views[v].camera].push_back(static_cast<int>(v));
      views_of_placement_[bundle.views[v].placement].push_back(static_cast<int>(v));
    }
  }

  absl::Status Run() {
    WEFT_RETURN_IF_ERROR(LinkCameras());
    PlaceBoards();
    for (int round = 0; round < 2; ++round) {
      WEFT_RETURN_IF_ERROR(AdjustPoses());
      if (!ResetBadCameras()) return absl::OkStatus();
      PlaceBoards();
    }
    return AdjustPoses();
  }

 private:
  struct Link {
    int a = 0, b = 0;
    RigidPose a_from_b;
    int confirmed = 0;
    size_t corners = 0;
  };

  Hypotheses PosesOf(const BundleView& view) const {
    const TagBoard& board = bundle_.boards[bundle_.placements[view.placement].board];
    Hypotheses out;
    const std::vector<BoardPoseGuess> guesses =
        GuessBoardPose(board, view.corners, bundle_.cameras[view.camera]);
    for (const BoardPoseGuess& guess : guesses) {
      if (guess.rms_px <= kAmbiguousRatio * guesses[0].rms_px + 0.1) out.push_back(guess.camera_from_board);
    }
    return out;
  }

  // The link of two cameras from the boards that both see best.
  Link LinkOf(int a, int b, std::vector<std::pair<int, int>> shared) const {
    const auto corners = [&](const std::pair<int, int>& s) {
      return std::min(bundle_.views[s.first].corners.size(), bundle_.views[s.second].corners.size());
    };
    std::stable_sort(shared.begin(), shared.end(),
                     [&](const auto& x, const auto& y) { return corners(x) > corners(y); });
    if (shared.size() > kBoardsPerPair) shared.resize(kBoardsPerPair);
    Link link{a, b, {}, 0, 0};
    std::vector<std::vector<RigidPose>> groups;
    double reach_mm = 0;
    for (const auto& [view_a, view_b] : shared) {
      std::vector<RigidPose>& group = groups.emplace_back();
      for (const RigidPose& pose_a : hypotheses_[view_a]) {
        for (const RigidPose& pose_b : hypotheses_[view_b]) group.push_back(pose_a * pose_b.Inverse());
      }
      link.corners += corners({view_a, view_b});
      reach_mm += hypotheses_[view_a][0].translation_mm.norm() / static_cast<double>(shared.size());
    }
    const Consensus consensus = MostConfirmed(groups, reach_mm);
    link.a_from_b = consensus.pose;
    link.confirmed = consensus.confirmed;
    return link;
  }

  std::vector<Link> AllLinks() const {
    std::map<std::pair<int, int>, std::vector<std::pair<int, int>>> shared;  // cameras to views
    for (const std::vector<int>& views : views_of_placement_) {
      for (const int v : views) {
        for (const int w : views) {
          const int a = bundle_.views[v].camera, b = bundle_.views[w].camera;
          if (a < b) shared[{a, b}].push_back({v, w});
        }
      }
    }
    const std::vector<std::pair<std::pair<int, int>, std::vector<std::pair<int, int>>>> pairs(shared.begin(),
                                                                                              shared.end());
    std::vector<Link> links(pairs.size());
    tbb::parallel_for(size_t{0}, pairs.size(), [&](size_t i) {
      links[i] = LinkOf(pairs[i].first.first, pairs[i].first.second, pairs[i].second);
    });
    std::stable_sort(links.begin(), links.end(), [](const Link& x, const Link& y) {
      return x.confirmed != y.confirmed ? x.confirmed > y.confirmed : x.corners > y.corners;
    });
    return links;
  }

  // Prim's algorithm on links sorted by strength, from the camera with the strongest link.
  absl::Status LinkCameras() {
    const std::vector<Link> links = AllLinks();
    std::vector<bool> reached(bundle_.cameras.size(), false);
    const int root = links.empty() ? 0 : links[0].a;
    reached[root] = true;
    SetCameraFromWorld({}, &bundle_.cameras[root]);
    for (size_t linked = 1; linked < bundle_.cameras.size(); ++linked) {
      const auto next = std::find_if(links.begin(), links.end(),
                                     [&](const Link& link) { return reached[link.a] != reached[link.b]; });
      if (next == links.end()) {
        std::string lonely;
        for (size_t c = 0; c < reached.size(); ++c) {
          if (!reached[c]) absl::StrAppend(&lonely, lonely.empty() ? "" : ", ", bundle_.cameras[c].id);
        }
        return absl::FailedPreconditionError(
            absl::StrCat("no board links cameras ", lonely,
                         " to the others; show boards where both see them at the same moment"));
      }
      const int from = reached[next->a] ? next->a : next->b, to = reached[next->a] ? next->b : next->a;
      const RigidPose to_from_from = to == next->a ? next->a_from_b : next->a_from_b.Inverse();
      SetCameraFromWorld(to_from_from * CameraFromWorld(bundle_.cameras[from]), &bundle_.cameras[to]);
      reached[to] = true;
    }
    return absl::OkStatus();
  }

  double CostOf(const BundleView& view) const {
    double cost = 0;
    for (const Eigen::Vector2d& r : ViewResiduals(bundle_, view)) {
      const double length = r.norm();
      cost += std::isfinite(length) ? std::min(length, kResidualCapPx) : kResidualCapPx;
    }
    return cost;
  }

  void PlaceBoards() {
    tbb::parallel_for(size_t{0}, bundle_.placements.size(), [&](size_t p) {
      RigidPose& pose = bundle_.placements[p].world_from_board;
      RigidPose best = pose;
      double best_cost = std::numeric_limits<double>::infinity();
      for (const int v : views_of_placement_[p]) {
        for (const RigidPose& camera_from_board : hypotheses_[v]) {
          pose = CameraFromWorld(bundle_.cameras[bundle_.views[v].camera]).Inverse() * camera_from_board;
          double cost = 0;
          for (const int w : views_of_placement_[p]) cost += CostOf(bundle_.views[w]);
          if (cost >= best_cost) continue;
          best_cost = cost;
          best = pose;
        }
      }
      pose = best;
    });
  }

  absl::Status AdjustPoses() {
    BundleOptions options;
    options.lens = LensFreedom::kNone;
    options.free_warps = false;
    options.tolerance = 1e-4;
    options.max_iterations = 20;
    return AdjustBundle(options, &bundle_).status();
  }

  // Cameras most of whose corners are far off stand where the chain went wrong; true if any was set again.
  bool ResetBadCameras() {
    bool any = false;
    for (size_t c = 0; c < bundle_.cameras.size(); ++c) {
      double cost = 0;
      size_t corners = 0;
      std::vector<std::vector<RigidPose>> groups;
      double reach_mm = 0;
      for (const int v : views_of_camera_[c]) {
        const BundleView& view = bundle_.views[v];
        cost += CostOf(view);
        corners += view.corners.size();
        std::vector<RigidPose>& group = groups.emplace_back();
        const RigidPose board_from_world = bundle_.placements[view.placement].world_from_board.Inverse();
        for (const RigidPose& pose : hypotheses_[v]) group.push_back(pose * board_from_world);
        reach_mm += hypotheses_[v][0].translation_mm.norm() / static_cast<double>(views_of_camera_[c].size());
      }
      if (corners == 0 || cost / static_cast<double>(corners) < kBadCameraPx) continue;
      any = true;
      SetCameraFromWorld(MostConfirmed(groups, reach_mm).pose, &bundle_.cameras[c]);
    }
    return any;
  }

  static constexpr double kBadCameraPx = 10;  // mean residual

  CalibrationBundle& bundle_;
  std::vector<Hypotheses> hypotheses_;  // [views]
  std::vector<std::vector<int>> views_of_camera_, views_of_placement_;
};

}  // namespace

absl::Status InitializePoses(CalibrationBundle* bundle) {
  if (bundle->cameras.empty()) return absl::FailedPreconditionError("no cameras");
  return Initializer(*bundle).Run();
}

}  // namespace weft
