#include "services/work/animation/filmed_views.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "figure/body.h"
#include "pattern/decoder.h"
#include "simulation/renderer.h"
#include "simulation/studio_scene.h"
#include "simulation/take_presets.h"
#include "simulation/worn_garment.h"

namespace weft {
namespace {

ClothPrint PrintOf(const Template& garment, double cell_mm) {
  if (std::optional<ClothPrint> sewn = PrintOfWorn(garment.rest.faces, cell_mm)) return *std::move(sewn);
  return PrintFromVertexNodes(garment.rest.faces, garment.node_of_vertex);
}

// `seconds` between both; a single frame stands still.
std::vector<Eigen::Vector3d> VelocitiesOf(const std::vector<Eigen::Vector3d>& before,
                                          const std::vector<Eigen::Vector3d>& after, double seconds) {
  std::vector<Eigen::Vector3d> out(after.size(), Eigen::Vector3d::Zero());
  for (size_t v = 0; seconds > 0 && v < out.size(); ++v) out[v] = (after[v] - before[v]) / seconds;
  return out;
}

}  // namespace

FilmedViews::FilmedViews(const Template& garment, const BodyShape& body, BoardIndex index,
                         SyntheticTakeOptions studio)
    : faces_(garment.rest.faces),
      print_(PrintOf(garment, index.board().cell_mm)),
      body_(body),
      index_(std::move(index)),
      studio_(std::move(studio)) {}

absl::StatusOr<FilmedViews> FilmedViews::Create(const Template& garment, const Board& board,
                                                const BodyShape& body,
                                                const std::vector<Eigen::Vector3d>& first_mm, uint64_t seed) {
  if (board.ContentHash() != garment.board_hash)
    return absl::FailedPreconditionError(absl::StrCat("board ", board.id, " has the hash ",
                                                      board.ContentHash(), ", but the template's cells are ",
                                                      "of the board with hash ", garment.board_hash));
  WEFT_ASSIGN_OR_RETURN(SyntheticTakeOptions studio, SyntheticPreset("shirt-drive", seed));
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : first_mm) box.extend(v);
  studio.look.room.center_mm = box.center().cast<float>();
  WEFT_ASSIGN_OR_RETURN(BoardIndex index, BoardIndex::Build(board));
  return FilmedViews(garment, body, std::move(index), std::move(studio));
}

absl::StatusOr<std::vector<ViewObservations>> FilmedViews::Observe(const Moment& moment,
                                                                   const Rig& rig) const {
  const double seconds = 1e-9 * static_cast<double>(moment.after.time_ns - moment.before.time_ns);
  MovingMesh cloth{{moment.now.vertices_mm, faces_},
                   VelocitiesOf(moment.before.vertices_mm, moment.after.vertices_mm, seconds)};
  MovingMesh wearer;
  if (moment.now.pose && moment.before.pose && moment.after.pose)
    wearer = {{Body(*moment.now.pose, body_).MeshVertices(), Body::MeshFaces()},
              VelocitiesOf(Body(*moment.before.pose, body_).MeshVertices(),
                           Body(*moment.after.pose, body_).MeshVertices(), seconds)};
  WEFT_ASSIGN_OR_RETURN(const StudioScene lit, StudioScene::Build(std::move(cloth), print_, index_.board(),
                                                                  std::move(wearer), studio_.look));
  WEFT_ASSIGN_OR_RETURN(const StudioScene scene, lit.Exposed(0, studio_.shutter.exposure_ms / 1000));
  std::vector<ViewObservations> out(rig.cameras.size());
  std::vector<absl::Status> statuses(rig.cameras.size());
  tbb::parallel_for(size_t{0}, rig.cameras.size(), [&](size_t camera) {
    const absl::StatusOr<Picture> picture =
        RenderView(scene, rig.cameras[camera], studio_.camera, moment.number);
    absl::StatusOr<DecodeResult> decoded =
        picture.ok() ? DecodeView(ToFrame(*picture), index_, {}) : picture.status();
    statuses[camera] = decoded.status();
    if (decoded.ok()) out[camera] = {static_cast<int>(camera), std::move(decoded->observations)};
  });
  for (const absl::Status& status : statuses)
    if (!status.ok()) return status;
  return out;
}

}  // namespace weft
