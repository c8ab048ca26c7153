#include "services/pipeline/second_look.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <numeric>
#include <utility>

namespace weft {
namespace {

// What a view is asked: cells that it decoded, at their places, and cells that it should show.
struct Question {
  std::vector<PredictedCell> known, wanted;
};

Question Ask(const PredictedSurface& surface, const RegisteredMesh& mesh, const CameraModel& camera,
             const std::vector<Observation>& observations, int enough_views) {
  std::map<std::pair<int, int>, const Observation*> decoded;
  for (const Observation& o : observations) {
    if (o.node.kind == NodeKind::kCenter) decoded[{o.node.row, o.node.col}] = &o;
  }
  Question question;
  for (const CellInView& seen : surface.CellsIn(camera)) {
    PredictedCell cell = seen.cell;
    if (const auto at = decoded.find({cell.row, cell.col}); at != decoded.end()) {
      cell.frame.x = static_cast<float>(at->second->x_px);
      cell.frame.y = static_cast<float>(at->second->y_px);
      cell.sigma_px = at->second->sigma_px;
      question.known.push_back(cell);
    } else if (mesh.views[seen.vertex] < enough_views) {
      question.wanted.push_back(cell);
    }
  }
  return question;
}

void Merge(std::vector<Observation> found, std::vector<Observation>* observations) {
  observations->insert(observations->end(), found.begin(), found.end());
  std::sort(observations->begin(), observations->end(), [](const Observation& a, const Observation& b) {
    return std::tuple(a.node.kind, a.node.row, a.node.col) < std::tuple(b.node.kind, b.node.row, b.node.col);
  });
}

void Describe(const GuidedResult& result, v1::ViewReport& report) {
  std::map<std::string, int> rejected;
  int found = 0;
  for (const GuidedCell& cell : result.cells) {
    if (cell.verdict == GuidedVerdict::kFound) {
      ++found;
    } else {
      ++rejected[std::string(GuidedVerdictName(cell.verdict))];
    }
  }
  report.set_second_look_found(found);
  report.set_centers(report.centers() + found);
  report.set_corners(report.corners() + static_cast<int>(result.observations.size()) - found);
  for (const auto& [reason, count] : rejected) {
    v1::ReasonCount& entry = *report.add_second_look_rejected();
    entry.set_reason(reason);
    entry.set_count(count);
  }
}

}  // namespace

absl::StatusOr<int> LookAgain(const RegistrationInputs& inputs, size_t index, const RegisteredMesh& mesh,
                              const SecondLookOptions& options, const std::stop_token& stop,
                              std::vector<ViewObservations>* views, std::vector<v1::ViewReport*> reports) {
  const absl::StatusOr<PredictedSurface> surface =
      PredictedSurface::Build(inputs.garment, inputs.neighborhoods, mesh, options.prediction);
  if (!surface.ok()) return surface.status();
  std::vector<int> added(views->size(), 0);
  const auto look = [&](size_t camera) {
    if (stop.stop_requested() || !reports[camera]->missing_reason().empty()) return;
    const auto start = std::chrono::steady_clock::now();
    std::vector<Observation>& observations = (*views)[camera].observations;
    const Question question =
        Ask(*surface, mesh, inputs.rig.cameras[camera], observations, options.enough_views);
    if (question.wanted.empty()) return;
    const absl::StatusOr<Frame> frame = inputs.dump->ReadView(index, camera);
    if (!frame.ok()) return;
    absl::StatusOr<GuidedResult> result =
        DecodePredicted(*frame, inputs.board.board(), question.known, question.wanted, options.guided);
    if (!result.ok()) return;
    Describe(*result, *reports[camera]);
    added[camera] = reports[camera]->second_look_found();
    Merge(std::move(result->observations), &observations);
    const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - start;
    reports[camera]->set_second_look_ms(elapsed.count());
  };
  tbb::parallel_for(size_t{0}, views->size(), look, tbb::simple_partitioner());
  if (stop.stop_requested()) return absl::CancelledError("the registration was cancelled");
  return std::accumulate(added.begin(), added.end(), 0);
}

}  // namespace weft
