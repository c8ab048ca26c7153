// How well a few cameras find a garment of which the template alone is known, at one moment whose mesh is
// known: the carrier is the template as it is. Nothing is learnt, so this is the least that rays and polish
// can do. `accuracy_one_mesh --help`.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "alignment/mesh_graph.h"
#include "alignment/placement.h"
#include "animation/sparse_view/sigma_calibration.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "services/work/animation/avatar_text.h"
#include "services/work/animation/driving_views.h"
#include "services/work/animation/observed_take.h"
#include "services/work/animation/score_table.h"
#include "services/work/animation/truth_views.h"

namespace weft {
namespace {

struct Options {
  std::string garment, truth, rig;
  std::vector<std::string> cameras;
  double left_mm = 15;          // per axis, of cloth in a pose like that of the template
  double stretch_share = 0.01;  // of edges
  uint64_t seed = 1;
};

// The template as an avatar: one component that changes next to nothing.
SparseViewAvatar Untrained(const Template& garment, const MeshGraph& graph, const Options& options) {
  SparseViewAvatar out;
  const std::vector<Eigen::Vector3d>& x = garment.rest.vertices_mm;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : x) middle += p / static_cast<double>(x.size());
  out.template_hash = garment.ContentHash();
  out.board_hash = garment.board_hash;
  out.training_frames = 1;
  out.space.vertices = static_cast<int>(x.size());
  const auto share = static_cast<float>(1 / std::sqrt(3.0 * static_cast<double>(x.size())));
  for (const Eigen::Vector3d& p : x)
    for (int axis = 0; axis < 3; ++axis) {
      out.space.mean_mm.push_back(static_cast<float>(p[axis] - middle[axis]));
      out.space.basis.push_back(share);
    }
  out.space.sigma_mm = {1e-3f};
  out.training.components = 1;
  out.acceleration = {1};
  for (const MeshEdge& edge : graph.edges) {
    out.edge_mm.push_back(static_cast<float>((x[edge.a] - x[edge.b]).norm()));
    out.edge_follow.push_back(0);
    out.edge_spread_mm.push_back(static_cast<float>(options.stretch_share) * out.edge_mm.back());
  }
  out.left_mm.assign(x.size(), static_cast<float>(options.left_mm));
  out.sigma = TypicalSigmaScale();
  return out;
}

absl::StatusOr<Rig> ChosenCameras(const Options& options) {
  const absl::StatusOr<Rig> all = ReadRig(options.rig);
  if (!all.ok()) return all.status();
  Rig out;
  out.id = all->id;
  for (const std::string& id : options.cameras) {
    const auto found = std::find_if(all->cameras.begin(), all->cameras.end(),
                                    [&](const CameraModel& camera) { return camera.id == id; });
    if (found == all->cameras.end()) return absl::NotFoundError(options.rig + " has no camera " + id);
    out.cameras.push_back(*found);
  }
  return out;
}

absl::Status Run(Options options) {
  const absl::StatusOr<Template> garment = ReadTemplate(options.garment);
  if (!garment.ok()) return garment.status();
  const absl::StatusOr<TriangleMesh> truth = ReadMesh(options.truth);
  if (!truth.ok()) return truth.status();
  if (truth->vertices_mm.size() != garment->rest.vertices_mm.size())
    return absl::InvalidArgumentError(options.truth + " has other vertices than the template");
  const absl::StatusOr<Rig> rig = ChosenCameras(options);
  if (!rig.ok()) return rig.status();
  const TruthViews cloth(*garment, BodyShape());
  const auto seen = cloth.Observe({0, truth->vertices_mm, {}}, *rig, options.seed);
  if (!seen.ok()) return seen.status();

  const NodeVertices nodes(*garment);
  const std::vector<DrivingView> views = DrivingViewsOf(*seen, *rig);
  const VertexRays directions = DirectionsOf(*seen, *rig, *garment, nodes);
  for (const DrivingView& view : views)
    std::printf("%s: %zu cells\n", view.camera->id.c_str(), view.observations.size());
  const SparseViewAvatar avatar = Untrained(*garment, BuildMeshGraph(garment->rest), options);

  ScoreTable table;
  const auto add = [&](const char* method, const std::vector<Eigen::Vector3d>& vertices_mm) {
    DrivingScore& score = table.At("one mesh", static_cast<int>(views.size()), method).score;
    return score.Add({vertices_mm, {}}, truth->vertices_mm, directions, false);
  };
  // Where the truth says that the template is, which nobody knows.
  std::vector<Eigen::Vector3d> placed = garment->rest.vertices_mm;
  const Eigen::Isometry3d place = RigidFit(placed, truth->vertices_mm);
  for (Eigen::Vector3d& p : placed) p = place * p;
  absl::Status status = add("mean shape", placed);
  // Where the tracker finds it.
  absl::StatusOr<SparseViewDriver> driver = SparseViewDriver::Create(*garment, avatar);
  if (!driver.ok()) return driver.status();
  const absl::StatusOr<DrivenFrame> driven = driver->Drive(1, views);
  if (!driven.ok()) return driven.status();
  if (driven->lost) std::printf("lost: %s\n", driven->reason.c_str());
  std::printf("%d rays, %d set aside\n", driven->rays, driven->rejected_rays);
  status.Update(add("carrier", driven->carrier_mm));
  status.Update(add("driven", driven->mesh.vertices_mm));
  v1::AvatarEvaluation evaluation;
  table.WriteTo(1, evaluation);
  std::fputs(AvatarEvaluationText(evaluation).c_str(), stdout);
  return status;
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  weft::Options o;
  CLI::App app("Drives a garment's template to a mesh of it, which cameras see with the decoder imitated");
  app.add_option("--template", o.garment, "Folder that `weft template import` wrote")->required();
  app.add_option("--truth", o.truth, "PLY with the template's vertices at that moment")->required();
  app.add_option("--rig", o.rig, "rig.json, in mm")->required();
  app.add_option("--cameras", o.cameras, "Names of those that look")->required()->delimiter(',');
  app.add_option("--left", o.left_mm);
  app.add_option("--stretch-share", o.stretch_share);
  app.add_option("--seed", o.seed);
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = weft::Run(o);
  if (!status.ok()) std::fprintf(stderr, "%s\n", std::string(status.message()).c_str());
  return status.ok() ? 0 : 1;
}
