#include "tests/benchmark/decode_score.h"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "absl/strings/str_cat.h"
#include "capture/image/image_file.h"
#include "services/formats/files/board_file.h"
#include "services/formats/synthetic/truth_file.h"
#include "simulation/take_presets.h"

namespace weft::testing {

absl::StatusOr<TrueTake> ReadTrueTake(const std::string& folder) {
  TrueTake take;
  take.name = folder;
  const auto board = ReadBoard(folder + "/board.json");
  if (!board.ok()) return board.status();
  take.board = *board;
  const auto frames = ListTruthFrames(folder + "/truth");
  if (!frames.ok()) return frames.status();
  for (const size_t f : std::set<size_t>{0, frames->size() / 2}) {
    const std::string& frame = (*frames)[f];
    auto truth = ReadFrameTruth(absl::StrCat(folder, "/truth/", frame));
    if (!truth.ok()) return truth.status();
    for (ViewTruth& view : truth->views) {
      const std::string picture = absl::StrCat(folder, "/", frame, "/", view.camera_id);
      auto image = ReadImageFile(picture + ".png");
      if (absl::IsNotFound(image.status())) image = ReadImageFile(picture + ".jpg");
      if (!image.ok()) {
        // A picture that the camera lost.
        if (absl::IsNotFound(image.status())) continue;
        return image.status();
      }
      take.views.push_back({frame, *std::move(image), std::move(view)});
    }
  }
  if (!take.views.empty()) return take;
  return absl::NotFoundError(
      absl::StrCat(folder,
                   ": no pictures <frame>/<camera>.png beside the truth; film them with "
                   "`weft simulate --image-format png`"));
}

TrueTake MakeSmallTake() {
  SyntheticTakeOptions options = *SyntheticPreset("quickstart", 1);
  options.performance.frames = 1;
  SyntheticTake filmed = *SyntheticTake::Make(options);
  const TakeFrame frame = *filmed.Next();
  TrueTake take{"quickstart", filmed.board(), {}};
  for (int camera = 0; camera < static_cast<int>(filmed.rig().cameras.size()); camera += 4) {
    FilmedView view = *filmed.Film(frame, camera);
    take.views.push_back({"0000", ToFrame(*view.picture), std::move(view.truth)});
  }
  return take;
}

size_t DecodeScore::CellsOf(double least_px, double most_px) const {
  return static_cast<size_t>(std::count_if(cells.begin(), cells.end(), [&](const ScoredCell& cell) {
    return cell.pitch_px >= least_px && cell.pitch_px < most_px;
  }));
}

double DecodeScore::Recall(double least_px, double most_px) const {
  const auto found = std::count_if(cells.begin(), cells.end(), [&](const ScoredCell& cell) {
    return cell.found && cell.pitch_px >= least_px && cell.pitch_px < most_px;
  });
  return static_cast<double>(found) / static_cast<double>(std::max<size_t>(CellsOf(least_px, most_px), 1));
}

size_t DecodeScore::WrongCells() const {
  return static_cast<size_t>(
      std::count_if(observations.begin(), observations.end(),
                    [](const ScoredObservation& o) { return o.node.kind == NodeKind::kCenter && !o.right; }));
}

size_t DecodeScore::WrongOnCrest() const {
  return static_cast<size_t>(std::count_if(
      observations.begin(), observations.end(),
      [](const ScoredObservation& o) { return o.node.kind == NodeKind::kCenter && o.on_crest; }));
}

double DecodeScore::Precision() const {
  const auto all = std::count_if(observations.begin(), observations.end(),
                                 [](const ScoredObservation& o) { return o.node.kind == NodeKind::kCenter; });
  return all == 0 ? 1 : 1 - static_cast<double>(WrongCells()) / static_cast<double>(all);
}

std::vector<double> DecodeScore::ErrorsPx(NodeKind kind) const {
  std::vector<double> errors;
  for (const ScoredObservation& o : observations) {
    if (o.right && o.node.kind == kind) errors.push_back(o.error_px);
  }
  return errors;
}

NodesOfView::NodesOfView(const TrueView& view) : view_(view) {
  for (const NodeTruth& node : view.truth.nodes) nodes_[node.node] = &node;
}

const NodeTruth* NodesOfView::Find(const BoardNode& node) const {
  const auto at = nodes_.find(node);
  return at == nodes_.end() ? nullptr : at->second;
}

Verdict NodesOfView::Assess(const BoardNode& node, double x_px, double y_px) const {
  const NodeTruth* truth = Find(node);
  if (truth == nullptr) {
    constexpr double kNear = 0.5;  // to the middles of the outermost pixels
    const bool inside = x_px > kNear && y_px > kNear && x_px < view_.image.width_px - 1 - kNear &&
                        y_px < view_.image.height_px - 1 - kNear;
    return inside ? Verdict::kWrong : Verdict::kUnjudged;
  }
  const double error_px = std::hypot(x_px - truth->pixel_px.x(), y_px - truth->pixel_px.y());
  if (error_px < 0.5 * truth->pitch_px) return Verdict::kRight;
  return error_px < 0.5 * LargestPitchAround(node) ? Verdict::kOnCrest : Verdict::kWrong;
}

double NodesOfView::LargestPitchAround(const BoardNode& node) const {
  double largest_px = 0;
  for (const auto& [dr, dc] : {std::pair{0, 1}, {1, 0}, {0, -1}, {-1, 0}}) {
    const NodeTruth* near = Find({node.row + dr, node.col + dc, node.kind});
    if (near != nullptr) largest_px = std::max(largest_px, near->pitch_px);
  }
  return largest_px;
}

void Score(const DecodeResult& result, const TrueView& view, DecodeScore* score) {
  const NodesOfView truth(view);
  std::map<BoardNode, bool> observed;  // and whether rightly
  for (const Observation& o : result.observations) observed[o.node] = false;
  for (const Observation& o : result.observations) {
    const Verdict verdict = truth.Assess(o.node, o.x_px, o.y_px);
    if (verdict == Verdict::kUnjudged) continue;
    ScoredObservation scored{.node = o.node,
                             .right = verdict == Verdict::kRight,
                             .on_crest = verdict == Verdict::kOnCrest,
                             .sigma_px = o.sigma_px,
                             .confidence = o.confidence};
    for (int k = 0; k < 9; ++k) {
      const BoardNode near{o.node.row + k / 3 - 1, o.node.col + k % 3 - 1, o.node.kind};
      scored.neighbors += k != 4 && observed.contains(near);
    }
    if (const NodeTruth* at = truth.Find(o.node)) {
      scored.pitch_px = at->pitch_px;
      const double x_px = o.x_px - at->pixel_px.x(), y_px = o.y_px - at->pixel_px.y();
      scored.error_px = std::hypot(x_px, y_px);
      scored.beyond = (std::abs(x_px) > 3 * o.sigma_px) + (std::abs(y_px) > 3 * o.sigma_px);
    }
    observed[o.node] = scored.right;
    score->observations.push_back(scored);
  }
  for (const NodeTruth& node : view.truth.nodes) {
    if (!node.scoreable || node.node.kind != NodeKind::kCenter) continue;
    const auto at = observed.find(node.node);
    score->cells.push_back({node.pitch_px, at != observed.end() && at->second});
  }
  ++score->views;
}

absl::StatusOr<DecodeScore> DecodeAndScore(const TrueTake& take, const BoardIndex& index,
                                           const DecodeOptions& options,
                                           const std::function<void(size_t)>& on_view) {
  DecodeScore score;
  for (const TrueView& view : take.views) {
    const double start_s = UserSeconds();
    const auto result = DecodeView(view.image, index, options);
    if (!result.ok()) return result.status();
    score.user_s += UserSeconds() - start_s;
    Score(*result, view, &score);
    if (on_view) on_view(score.views);
  }
  return score;
}

double UserSeconds() {
  rusage usage;
  getrusage(RUSAGE_THREAD, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) + 1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

}  // namespace weft::testing
