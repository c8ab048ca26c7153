#include "triangulation/camera_agreement.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/status_macros.h"
#include "triangulation/exchange_search.h"

namespace weft {
namespace {

// Observations of a view that are looked at, spread evenly.
constexpr size_t kMaxObservations = 1000;

// Fewer say nothing of a camera.
constexpr int kLeastCompared = 30;

// A camera that sees its points so near is where the rig says.
constexpr double kPlacedPx = 1;

// Another place explains a camera where it leaves this share of the residuals.
constexpr double kExplainedShare = 0.25;

// The place or the lens alone is another's only where that explains clearly more: most rigs have one lens.
constexpr double kPartShare = 0.5;
// So near, too: principal points of cropped images differ by so much that one fits by chance.
constexpr double kPartPx = 2;

// Neighbouring nodes share their errors: the scatter is that of blocks of so many cells a side.
constexpr int kFitBlockCells = 16;
constexpr size_t kLeastFitBlocks = 6;

struct Match {
  BoardNode node;
  Eigen::Vector2d seen_px;
  Eigen::Vector3d point_mm;
  Eigen::Vector2d expected_px;
  double residual_px = 0;
};

constexpr double kBehind = std::numeric_limits<double>::infinity();  // of a point that the camera cannot see

double ResidualPx(const CameraModel& camera, const Eigen::Vector3d& point_mm,
                  const Eigen::Vector2d& seen_px) {
  const std::optional<Eigen::Vector2d> expected = camera.Project(point_mm);
  return expected ? (*expected - seen_px).norm() : kBehind;
}

// Observations of nodes whose point stands without this camera.
std::vector<Match> MatchesOf(const CameraModel& camera, const ViewObservations& view, const Cloud& cloud,
                             const TriangulationOptions& options) {
  const size_t step = std::max<size_t>(1, view.observations.size() / kMaxObservations);
  std::vector<Match> matches;
  for (size_t i = 0; i < view.observations.size(); i += step) {
    const Observation& o = view.observations[i];
    const CloudPoint* point = FindPoint(cloud, o.node);
    if (point == nullptr || point->views < options.consensus.min_views) continue;
    Match match{o.node, {o.x_px, o.y_px}, point->position_mm, Eigen::Vector2d::Constant(NAN), kBehind};
    if (const auto expected = camera.Project(point->position_mm)) {
      match.expected_px = *expected;
      match.residual_px = (match.expected_px - match.seen_px).norm();
    }
    // A point of just enough cameras would not be there if one of them disagreed.
    const double depth_mm = camera.rotation.row(2).dot(match.point_mm) + camera.translation_mm.z();
    const double limit_px =
        std::max(options.consensus.max_residual_sigmas * o.sigma_px, options.consensus.min_residual_px);
    const bool has_part = match.residual_px <= limit_px &&
                          match.residual_px * depth_mm <= options.consensus.inlier_radius_mm * camera.fx_px;
    if (has_part && point->views == options.consensus.min_views) continue;
    matches.push_back(match);
  }
  return matches;
}

double MedianResidual(const CameraModel& camera, const std::vector<Match>& matches, ImageTurn turn) {
  constexpr size_t kEnough = 200;
  const size_t step = std::max<size_t>(1, matches.size() / kEnough);
  std::vector<double> residuals_px;
  for (size_t i = 0; i < matches.size(); i += step) {
    Eigen::Vector2d seen_px = matches[i].seen_px;
    const bool across = turn == ImageTurn::kUpsideDown || turn == ImageTurn::kMirrored;
    const bool down = turn == ImageTurn::kUpsideDown || turn == ImageTurn::kMirroredUpsideDown;
    if (across) seen_px.x() = camera.width_px - 1 - seen_px.x();
    if (down) seen_px.y() = camera.height_px - 1 - seen_px.y();
    residuals_px.push_back(ResidualPx(camera, matches[i].point_mm, seen_px));
  }
  return Median(std::move(residuals_px));
}

CameraPart WholeIfSameSize(CameraPart part, const CameraModel& own, const CameraModel& other) {
  const bool same_size = own.width_px == other.width_px && own.height_px == other.height_px;
  return part == CameraPart::kPlaceAndLens && same_size ? CameraPart::kCamera : part;
}

std::optional<CameraPlace> FindPlace(const Rig& rig, int camera, double own_px,
                                     const std::vector<Match>& matches) {
  const CameraModel& own = rig.cameras[camera];
  CameraPlace best{.median_px = std::numeric_limits<double>::infinity()};
  const auto attempt = [&](const CameraModel& model, CameraPlace place, double share) {
    place.median_px = MedianResidual(model, matches, place.turn);
    if (place.median_px < share * best.median_px) best = place;
  };
  for (const CameraPart part : {CameraPart::kPlaceAndLens, CameraPart::kPlace, CameraPart::kLens}) {
    for (int place = 0; place < static_cast<int>(rig.cameras.size()); ++place) {
      if (place == camera) continue;
      const bool must_be_clear = part != CameraPart::kPlaceAndLens && part != best.part;
      attempt(WithPart(own, rig.cameras[place], part), {.camera = place, .part = part},
              must_be_clear ? kPartShare : 1);
    }
  }
  for (const ImageTurn turn : {ImageTurn::kUpsideDown, ImageTurn::kMirrored, ImageTurn::kMirroredUpsideDown})
    attempt(own, {.camera = camera, .turn = turn}, 1);
  if (best.turn == ImageTurn::kNone && best.part != CameraPart::kPlaceAndLens && best.median_px > kPartPx)
    return std::nullopt;
  best.part = WholeIfSameSize(best.part, own, rig.cameras[best.camera]);
  if (!(best.median_px <= kExplainedShare * own_px) || best.median_px > kAgreementPx) return std::nullopt;
  return best;
}

// Over pairs of matches in the same block of cells the mean product of their offsets: their errors are their
// own, so what is left is the square of the offset that they share. Without those far off the rest.
double CommonOffsetPx(const std::vector<Match>& matches, double median_px) {
  constexpr double kFarOff = 4;  // medians
  struct Block {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double squares = 0, count = 0;
  };
  std::map<std::pair<int, int>, Block> blocks;
  for (const Match& match : matches) {
    if (!(match.residual_px <= kFarOff * median_px)) continue;
    Block& block = blocks[{match.node.row / kFitBlockCells, match.node.col / kFitBlockCells}];
    const Eigen::Vector2d offset = match.seen_px - match.expected_px;
    block.sum += offset, block.squares += offset.squaredNorm(), ++block.count;
  }
  double products = 0, weights = 0;
  for (const auto& [place, block] : blocks) {
    if (block.count < 2) continue;
    products += (block.sum.squaredNorm() - block.squares) / (block.count - 1);
    weights += block.count;
  }
  return weights > 0 ? std::sqrt(std::max(0.0, products / weights)) : 0;
}

// Least squares of seen = shift + (size + perspective * w) * place, turned in the plane, without what is far
// off the rest. `place` is from the principal point, w the mean depth over the node's, minus 1.
class ViewFit {
 public:
  ViewFit(const CameraModel& camera, const std::vector<Match>& matches) {
    double depths = 0;
    for (const Match& m : matches) {
      if (!m.expected_px.allFinite()) continue;
      const double depth_mm = camera.rotation.row(2).dot(m.point_mm) + camera.translation_mm.z();
      const Eigen::Vector2d place = m.expected_px - Eigen::Vector2d(camera.cx_px, camera.cy_px);
      rows_.push_back({m.node, place, m.seen_px - m.expected_px, 1 / depth_mm});
      depths += 1 / depth_mm;
    }
    for (Row& row : rows_) row.w = row.w / (depths / static_cast<double>(rows_.size())) - 1;
  }

  void Describe(CameraAgreement* out) {
    constexpr int kRounds = 3;
    constexpr double kFarOff = 4;  // medians of what is left
    constexpr double kLeastShare = 0.5, kFittedPx = 5;
    const size_t least = std::max<size_t>(kLeastCompared, static_cast<size_t>(kLeastShare * rows_.size()));
    double left_px = 0;
    for (int round = 0; round <= kRounds; ++round) {
      if (rows_.size() < least || !Solve()) return;
      std::vector<double> all_px;
      for (const Row& row : rows_) all_px.push_back(Left(row).norm());
      left_px = Median(std::move(all_px));
      if (round < kRounds)
        std::erase_if(rows_, [&](const Row& row) { return Left(row).norm() > kFarOff * left_px; });
    }
    if (left_px > kFittedPx) return;  // it is not the size that differs
    std::map<std::pair<int, int>, Unknowns> blocks;
    for (const Row& row : rows_) {
      Unknowns& block =
          blocks.try_emplace({row.node.row / kFitBlockCells, row.node.col / kFitBlockCells}, Unknowns::Zero())
              .first->second;
      block += DerivativeOf(row).transpose() * Left(row);
    }
    if (blocks.size() < kLeastFitBlocks) return;
    Eigen::Matrix<double, 5, 5> scatter = Eigen::Matrix<double, 5, 5>::Zero();
    for (const auto& [place, block] : blocks) scatter += block * block.transpose();
    const double count = static_cast<double>(blocks.size());
    const Eigen::Matrix<double, 5, 5> covariance = inverse_ * scatter * inverse_ * count / (count - 1);
    out->scale = 1 + solved_[2];
    out->scale_sigma = std::sqrt(covariance(2, 2));
    out->perspective = solved_[3];
    out->perspective_sigma = std::sqrt(covariance(3, 3));
  }

 private:
  using Unknowns = Eigen::Matrix<double, 5, 1>;  // shift x y, size - 1, perspective, turn
  struct Row {
    BoardNode node;
    Eigen::Vector2d place_px, off_px;
    double w = 0;
  };

  static Eigen::Matrix<double, 2, 5> DerivativeOf(const Row& row) {
    Eigen::Matrix<double, 2, 5> by;
    by << Eigen::Matrix2d::Identity(), row.place_px, row.w * row.place_px,
        Eigen::Vector2d(-row.place_px.y(), row.place_px.x());
    return by;
  }

  bool Solve() {
    Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
    Unknowns right = Unknowns::Zero();
    for (const Row& row : rows_) {
      const Eigen::Matrix<double, 2, 5> by = DerivativeOf(row);
      normal += by.transpose() * by;
      right += by.transpose() * row.off_px;
    }
    const Unknowns unit = normal.diagonal().cwiseSqrt().cwiseInverse();
    if (!unit.allFinite()) return false;
    const Eigen::FullPivLU<Eigen::Matrix<double, 5, 5>> solver(unit.asDiagonal() * normal *
                                                               unit.asDiagonal());
    if (!(solver.rcond() > 1e-9)) return false;
    inverse_ = unit.asDiagonal() * solver.inverse() * unit.asDiagonal();
    solved_ = inverse_ * right;
    return true;
  }

  Eigen::Vector2d Left(const Row& row) const { return row.off_px - DerivativeOf(row) * solved_; }

  std::vector<Row> rows_;
  Unknowns solved_ = Unknowns::Zero();
  Eigen::Matrix<double, 5, 5> inverse_ = Eigen::Matrix<double, 5, 5>::Zero();
};

CameraAgreement AgreementOf(const Rig& rig, const ViewObservations& view, const Cloud& cloud,
                            const TriangulationOptions& options) {
  const std::vector<Match> matches = MatchesOf(rig.cameras[view.camera], view, cloud, options);
  CameraAgreement out;
  std::vector<double> residuals_px;
  for (const Match& match : matches) {
    residuals_px.push_back(match.residual_px);
    out.agreeing += match.residual_px <= kAgreementPx ? 1 : 0;
  }
  out.compared = static_cast<int>(matches.size());
  if (out.compared < kLeastCompared) return out;
  out.median_px = Median(std::move(residuals_px));
  if (out.median_px > kPlacedPx) out.fits = FindPlace(rig, view.camera, out.median_px, matches);
  // The residuals of points behind the camera are no numbers to be written.
  if (!std::isfinite(out.median_px)) out.median_px = 0;
  out.common_px = CommonOffsetPx(matches, out.median_px);
  ViewFit(rig.cameras[view.camera], matches).Describe(&out);
  return out;
}

// Do the rays of most nodes miss each other?
bool RaysMiss(const Cloud& cloud) {
  constexpr size_t kTellingNodes = 100;
  size_t missing = 0;
  for (const RejectedNode& node : cloud.rejected) missing += node.reason == RejectReason::kNoConsensus;
  return missing > cloud.points.size() && missing >= kTellingNodes;
}

// About so many nodes of all views, the same in each of them.
std::vector<ViewObservations> Sample(const std::vector<ViewObservations>& views) {
  constexpr size_t kSampledNodes = 2000;
  constexpr unsigned kSpread = 2654435761u;  // Knuth's multiplicative hash
  size_t most = 0;
  for (const ViewObservations& view : views) most = std::max(most, view.observations.size());
  // Other views see other nodes: of a garment about four times as many as one camera.
  const unsigned step = static_cast<unsigned>(std::max<size_t>(1, 4 * most / kSampledNodes));
  std::vector<ViewObservations> sampled;
  for (const ViewObservations& view : views) {
    ViewObservations& out = sampled.emplace_back();
    out.camera = view.camera;
    for (const Observation& o : view.observations) {
      const unsigned key = static_cast<unsigned>(o.node.row) * 8192 + static_cast<unsigned>(o.node.col) * 2 +
                           static_cast<unsigned>(o.node.kind);
      if ((key * kSpread >> 16) % step == 0) out.observations.push_back(o);
    }
  }
  return sampled;
}

}  // namespace

absl::StatusOr<std::vector<CameraAgreement>> MeasureSampledAgreement(
    const Rig& rig, const std::vector<ViewObservations>& views, const TriangulationOptions& options) {
  const std::vector<ViewObservations> sampled = Sample(views);
  WEFT_ASSIGN_OR_RETURN(const Cloud cloud, Triangulate(rig, sampled, options));
  return MeasureCameraAgreement(rig, sampled, cloud, options);
}

absl::StatusOr<std::vector<CameraAgreement>> MeasureCameraAgreement(
    const Rig& rig, const std::vector<ViewObservations>& views, const Cloud& cloud,
    const TriangulationOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  std::vector<CameraAgreement> agreements(rig.cameras.size());
  for (const ViewObservations& view : views) {
    if (view.camera < 0 || view.camera >= static_cast<int>(rig.cameras.size()))
      return absl::InvalidArgumentError(absl::StrCat("view of camera ", view.camera, ": the rig has ",
                                                     rig.cameras.size(), " cameras, numbered from 0"));
    agreements[view.camera] = AgreementOf(rig, view, cloud, options);
  }
  if (!RaysMiss(cloud)) return agreements;
  const ExchangeSearch found = SearchExchanges(rig, views, options);
  for (size_t c = 0; c < agreements.size(); ++c) {
    CameraAgreement& agreement = agreements[c];
    if (agreement.fits || found.of_camera.empty()) continue;
    const SearchedCamera& searched = found.of_camera[c];
    // Where no exchange makes the rays meet, nobody knows who is wrong.
    if (found.found) {
      agreement.compared = searched.nodes;
      agreement.agreeing = searched.meeting;
    }
    if (found.found && searched.place != static_cast<int>(c))
      agreement.fits =
          CameraPlace{.camera = searched.place,
                      .part = WholeIfSameSize(found.part, rig.cameras[c], rig.cameras[searched.place])};
  }
  return agreements;
}

}  // namespace weft
