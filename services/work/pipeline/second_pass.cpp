#include "services/work/pipeline/second_pass.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <optional>

#include "alignment/placement.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "pattern/image/pixel_allocator.h"

namespace weft {
namespace {

// Of the vertices of a joint template, whether their garment has a place: that of a garment that no camera
// saw is a guess, and to look for its cells finds none but wrong ones. Empty: all have one.
std::vector<bool> Placed(const SecondPassInputs& pass) {
  std::vector<bool> placed;
  for (const GarmentSpan& garment : pass.inputs.garment.garments) {
    const auto first = pass.mesh.views.begin() + garment.first_vertex;
    const auto measured = std::count_if(first, first + garment.vertices, [](int views) { return views > 0; });
    const double least = LeastTargets(garment.vertices, AlignOptions().min_target_share);
    placed.insert(placed.end(), garment.vertices, static_cast<double>(measured) >= least);
  }
  return placed;
}

// The cells that a view should show, did not decode, and that too few cameras measured.
std::vector<PredictedCell> Wanted(const std::vector<CellInView>& in_view, const SecondPassInputs& pass,
                                  const std::vector<bool>& placed, const BoardState& decoded) {
  std::vector<PredictedCell> wanted;
  for (const CellInView& seen : in_view) {
    if (pass.mesh.views[seen.vertex] >= pass.options.enough_views) continue;
    if (!placed.empty() && !placed[seen.vertex]) continue;
    if (decoded.At(seen.cell.row, seen.cell.col) < 0) wanted.push_back(seen.cell);
  }
  return wanted;
}

// Counts why predicted cells were not found; returns how many were.
int Describe(const std::vector<std::optional<WhyMissing>>& missing, v1::ViewReport& report) {
  std::map<std::string, int> rejected;
  for (const std::optional<WhyMissing>& why : missing) {
    if (why) ++rejected[std::string(NameOf(*why))];
  }
  int found = static_cast<int>(missing.size());
  for (const auto& [reason, count] : rejected) {
    v1::ReasonCount& entry = *report.add_second_pass_rejected();
    entry.set_reason(reason);
    entry.set_count(count);
    found -= count;
  }
  return found;
}

// Looks into one view again, and counts in its report; returns whether its cells are others then.
bool LookInto(const SecondPassInputs& pass, const std::vector<PredictedCell>& wanted, size_t camera,
              ViewDecoder& view, v1::ViewReport& report) {
  const Stopwatch watch;
  if (!view.has_image()) {
    const absl::StatusOr<Frame> frame = pass.inputs.dump->ReadView(pass.frame, camera);
    if (!frame.ok() || !view.ReadAgain(*frame).ok()) return false;
  }
  const auto before = static_cast<int>(view.state().cells().size());
  const auto missing = view.Find(wanted, pass.options.guided);
  if (!missing.ok()) return false;
  report.clear_second_pass_rejected();  // of the round before
  const int found = Describe(*missing, report);
  const auto centers = static_cast<int>(view.state().cells().size());
  report.set_centers(centers);
  // Predicted ones, and those that have grown from there.
  report.set_second_pass_found(report.second_pass_found() + std::max(centers - before, 0));
  report.set_second_pass_ms(report.second_pass_ms() + watch.Ms());
  return found > 0 || centers != before;
}

int Centers(const v1::FrameReport& report) {
  int centers = 0;
  for (const v1::ViewReport& view : report.views()) centers += view.centers();
  return centers;
}

}  // namespace

absl::StatusOr<SecondPassResult> SecondPass(Computes<Stage::kSecondPass>, const SecondPassInputs& pass,
                                            const std::stop_token& stop,
                                            const std::vector<std::unique_ptr<ViewDecoder>>& decoders,
                                            std::vector<ViewObservations>* views, v1::FrameReport& report) {
  WEFT_ASSIGN_OR_RETURN(const PredictedSurface surface,
                        PredictedSurface::Build(pass.inputs.garment, pass.inputs.neighborhoods, pass.mesh,
                                                pass.options.prediction));
  const std::vector<bool> placed = Placed(pass);
  std::vector<uint8_t> changed(views->size(), 0);
  const auto look = [&](size_t camera) {
    if (stop.stop_requested() || decoders[camera] == nullptr) return;
    ViewDecoder& view = *decoders[camera];
    const bool keeps_image = view.has_image();
    view.Wake();
    const std::vector<PredictedCell> wanted =
        Wanted(surface.CellsIn(pass.inputs.rig.cameras[camera]), pass, placed, view.state());
    v1::ViewReport& counts = *report.mutable_views(static_cast<int>(camera));
    changed[camera] = !wanted.empty() && LookInto(pass, wanted, camera, view, counts);
    if (changed[camera]) {
      (*views)[camera].observations = view.Observations();
      counts.set_corners(static_cast<int>((*views)[camera].observations.size()) - counts.centers());
    }
    view.Rest(keeps_image);
  };
  const int before = Centers(report);
  tbb::parallel_for(size_t{0}, views->size(), look, tbb::simple_partitioner());
  ReleasePixels();  // what follows needs other memory
  if (stop.stop_requested()) return absl::CancelledError("the registration was cancelled");
  const int centers = Centers(report);
  return SecondPassResult{.changed = std::ranges::find(changed, true) != changed.end(),
                          .added_share = static_cast<double>(centers - before) / std::max(centers, 1)};
}

}  // namespace weft
