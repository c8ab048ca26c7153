#include "services/work/animation/score_table.h"

#include <algorithm>

#include "base/median.h"
#include "base/status_macros.h"
#include "services/formats/synthetic/dataset_file.h"

namespace weft {
namespace {

double MeanOf(const ErrorTally& errors) { return errors.Summary().value_or(ErrorSummary()).mean; }

void Fill(const ScoreTally& tally, v1::AvatarScore& row) {
  const DrivingScore& score = tally.score;
  row.set_frames(score.frames());
  row.set_lost_frames(tally.lost_frames);
  const ErrorSummary all = score.all_mm().Summary().value_or(ErrorSummary());
  row.set_mean_mm(all.mean);
  row.set_median_mm(all.median);
  row.set_p95_mm(all.p95);
  row.set_across_mm(MeanOf(score.across_mm()));
  row.set_seen_mm(MeanOf(score.seen_mm()));
  row.set_crossed_mm(MeanOf(score.crossed_mm()));
  row.set_unseen_mm(MeanOf(score.unseen_mm()));
  row.set_unseen_share(score.UnseenShare().value_or(0));
  row.set_chamfer_mm(MeanOf(score.chamfer_mm()));
  row.set_error_jitter_seen_mm(MeanOf(score.error_jitter_seen_mm()));
  row.set_error_jitter_unseen_mm(MeanOf(score.error_jitter_unseen_mm()));
  row.set_share_within_sigma(score.ShareWithin(1).value_or(-1));
  row.set_share_within_two_sigma(score.ShareWithin(2).value_or(-1));
  row.set_lost_vertices(score.lost());
  row.set_at_seams_mm(MeanOf(tally.at_seams_mm));
  row.set_off_seams_mm(MeanOf(tally.off_seams_mm));
  if (tally.views > 0)
    row.set_cells_a_view(static_cast<double>(tally.cells) / static_cast<double>(tally.views));
  if (!tally.from_registered_mm.empty()) row.set_from_registered_mm(MeanOf(tally.from_registered_mm));
}

}  // namespace

ScoreTally& ScoreTally::operator+=(const ScoreTally& other) {
  score += other.score;
  from_registered_mm += other.from_registered_mm;
  at_seams_mm += other.at_seams_mm;
  off_seams_mm += other.off_seams_mm;
  lost_frames += other.lost_frames;
  cells += other.cells;
  views += other.views;
  ms.insert(ms.end(), other.ms.begin(), other.ms.end());
  return *this;
}

void ScoreTally::AddViews(const std::vector<ViewObservations>& seen) {
  views += static_cast<int64_t>(seen.size());
  for (const ViewObservations& view : seen)
    cells += std::ranges::count_if(view.observations,
                                   [](const Observation& o) { return o.node.kind == NodeKind::kCenter; });
}

ScoreTally& ScoreTable::At(const std::string& split, int cameras, const std::string& method) {
  for (auto& [key, tally] : rows_)
    if (key == Key{split, cameras, method}) return tally;
  rows_.push_back({{split, cameras, method}, {}});
  return rows_.back().second;
}

ScoreTable& ScoreTable::operator+=(const ScoreTable& other) {
  for (const auto& [key, tally] : other.rows_) At(key.split, key.cameras, key.method) += tally;
  return *this;
}

void ScoreTable::WriteTo(int threads, v1::AvatarEvaluation& out) const {
  for (const auto& [key, tally] : rows_) {
    if (tally.score.frames() == 0 && tally.lost_frames == 0) continue;
    v1::AvatarScore& row = *out.add_scores();
    row.set_split(key.split);
    row.set_cameras(key.cameras);
    row.set_method(key.method);
    Fill(tally, row);
    if (tally.ms.empty()) continue;
    row.set_ms_a_frame(Median(tally.ms));
    row.set_threads(threads);
  }
}

absl::Status AddChaosFloor(const std::string& folder, v1::AvatarEvaluation& out) {
  WEFT_ASSIGN_OR_RETURN(const v1::Dataset dataset, ReadDatasetFile(folder));
  WEFT_ASSIGN_OR_RETURN(const std::vector<TakeFloor> floor, MeasureFloor(dataset, folder));
  for (const TakeFloor& take : floor) {
    v1::AvatarFloor& to = *out.add_floor();
    to.set_take(take.take);
    to.set_frames(take.frames);
    to.set_mean_mm(take.distance_mm.mean);
    to.set_median_mm(take.distance_mm.median);
    to.set_error_jitter_mm(take.error_jitter_mm);
  }
  return absl::OkStatus();
}

}  // namespace weft
