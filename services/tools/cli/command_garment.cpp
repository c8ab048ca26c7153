// weft garment: meshes of garments that no board was printed on.
#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "alignment/template_build/mesh_topology.h"
#include "animation/atlas/atlas.h"
#include "animation/atlas/cloth_charts.h"
#include "base/length_unit.h"
#include "base/named_status.h"
#include "capture/image/image_encoders.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/garment_file.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/results/export/export_folder.h"
#include "services/results/export/export_transform.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/progress.h"
#include "services/work/job/import_meshes.h"
#include "weft/v1/export.pb.h"
#include "weft/v1/template.pb.h"

namespace weft {
namespace {

struct GarmentCheckOptions {
  std::string mesh;
  std::string unit = "mm";
  std::string atlas;
  AtlasOptions layout;
  bool json = false;
};

struct GarmentImportOptions {
  MeshImport request;
  std::string unit = "mm", up, world_up = "-y";
};

// Vertices at the place of another one: most programs split meshes so along seams, and the cloth then hangs
// together no more.
int CountDoubledVertices(const TriangleMesh& mesh) {
  std::set<std::tuple<double, double, double>> places;
  int doubled = 0;
  for (const Eigen::Vector3d& v : mesh.vertices_mm) doubled += !places.emplace(v.x(), v.y(), v.z()).second;
  return doubled;
}

void AddTopology(const GarmentMesh& garment, v1::GarmentMeshSummary& summary) {
  const std::vector<Eigen::Vector3d>& vertices_mm = garment.rest.vertices_mm;
  const absl::StatusOr<MeshTopology> topology =
      CheckTopology(static_cast<int>(vertices_mm.size()), garment.rest.faces);
  if (!topology.ok()) {
    summary.add_warnings(absl::StrCat(topology.status().message(),
                                      "; in Blender: Mesh, Normals, Recalculate Outside, or Select All by "
                                      "Trait, Non Manifold"));
    return;
  }
  summary.set_components(topology->components);
  std::vector<double> lengths_mm;
  for (const std::vector<int>& loop : topology->loops) lengths_mm.push_back(LoopLengthMm(loop, vertices_mm));
  std::sort(lengths_mm.begin(), lengths_mm.end(), std::greater<>());
  summary.mutable_openings_mm()->Assign(lengths_mm.begin(), lengths_mm.end());
}

// The garment at rest as colours: red, green and blue are x, y and z within its box. Empty texels are black.
absl::StatusOr<std::vector<uint8_t>> AtlasPicture(const GarmentMesh& garment, const Atlas& atlas) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : garment.rest.vertices_mm) box.extend(v);
  std::vector<float> colours;
  for (const Eigen::Vector3d& v : garment.rest.vertices_mm)
    for (int axis = 0; axis < 3; ++axis)
      colours.push_back(static_cast<float>((v[axis] - box.min()[axis]) / std::max(box.sizes()[axis], 1e-9)));
  const AtlasImage image = atlas.Gather(colours, 3);
  std::vector<uint8_t> pixels(3 * image.PlaneSize(), 0);
  for (size_t t = 0; t < image.PlaneSize(); ++t) {
    if (atlas.kinds()[t] == TexelKind::kEmpty) continue;
    for (size_t c = 0; c < 3; ++c)
      pixels[3 * t + c] = static_cast<uint8_t>(
          32 + 223 * std::clamp(image.values[c * image.PlaneSize() + t], 0.0f, 1.0f) + 0.5f);
  }
  return EncodePng({image.width, image.height, 3, 8, pixels}, PngEffort::kSmall);
}

absl::Status AddAtlas(const GarmentCheckOptions& options, const GarmentMesh& garment,
                      v1::GarmentMeshSummary& summary) {
  if (garment.texture.empty() && options.atlas.empty()) {
    summary.add_warnings(
        "it has no texture coordinates, so it has no atlas; unwrap it (in Blender: UV, Unwrap) "
        "and export it with UVs");
    return absl::OkStatus();
  }
  WEFT_ASSIGN_OR_RETURN(const ClothCharts charts, ChartsOfTexture(garment));
  WEFT_ASSIGN_OR_RETURN(const Atlas atlas, Atlas::Build(garment, charts, options.layout));
  summary.set_edge_mm(charts.cell_mm);
  summary.set_charts(charts.charts);
  summary.set_seam_edges(charts.seam_edges);
  summary.set_seam_mm(charts.seam_mm);
  summary.set_atlas_width_px(atlas.width());
  summary.set_atlas_height_px(atlas.height());
  if (options.atlas.empty()) return absl::OkStatus();
  WEFT_ASSIGN_OR_RETURN(const std::vector<uint8_t> png, AtlasPicture(garment, atlas));
  return WriteFileAtomically(options.atlas, std::string(png.begin(), png.end()));
}

void PrintGarment(const v1::GarmentMeshSummary& summary) {
  absl::PrintF("mesh     %s: %d vertices, %d faces, hash %s\n", summary.id(), summary.vertices(),
               summary.faces(), summary.mesh_hash());
  std::vector<std::string> openings;
  for (const double length_mm : summary.openings_mm())
    openings.push_back(absl::StrFormat("%.0f mm", length_mm));
  absl::PrintF("openings %s\n", openings.empty() ? "none" : absl::StrJoin(openings, ", "));
  if (summary.charts() > 0)
    absl::PrintF("texture  %d %s, %d seam edges (%.0f mm); atlas of %d x %d px\n", summary.charts(),
                 summary.charts() == 1 ? "chart" : "charts", summary.seam_edges(), summary.seam_mm(),
                 summary.atlas_width_px(), summary.atlas_height_px());
  for (const std::string& warning : summary.warnings()) PrintWarning(warning);
}

absl::Status CheckGarment(const GarmentCheckOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const GarmentMesh garment,
                        ReadGarmentMesh(options.mesh, LengthUnitNamed(options.unit).value().mm));
  v1::GarmentMeshSummary summary;
  summary.set_id(garment.id);
  summary.set_mesh_hash(garment.MeshHash());
  summary.set_vertices(static_cast<int>(garment.rest.vertices_mm.size()));
  summary.set_faces(static_cast<int>(garment.rest.faces.size()));
  AddTopology(garment, summary);
  WEFT_RETURN_IF_ERROR(Naming(options.mesh, AddAtlas(options, garment, summary)));
  if (const int doubled = CountDoubledVertices(garment.rest); doubled > 0)
    summary.add_warnings(absl::StrCat(doubled,
                                      " vertices lie where another one does, so the cloth is open "
                                      "there; in Blender: Merge by Distance"));
  if (options.json) return PrintJsonMessage(summary);
  PrintGarment(summary);
  return absl::OkStatus();
}

// Meshes of `weft export` lie beside export.json, which has their axes and unit.
void WarnOfOtherAxes(const MeshImport& request) {
  const std::filesystem::path folder = std::filesystem::path(request.meshes.front()).parent_path();
  const std::string file = (folder / kExportFile).string();
  v1::Export exported;
  if (!ReadJsonFile(file, exported).ok() || exported.transform().export_from_world_size() != 16) return;
  const Eigen::Matrix4d world_from_export =
      Eigen::Matrix4d::Map(exported.transform().export_from_world().data()).transpose().inverse();
  const Eigen::Matrix3d as_read = request.unit_mm * request.world_from_mesh;
  if (as_read.isApprox(world_from_export.topLeftCorner<3, 3>(), 1e-6)) return;
  PrintWarning(absl::StrCat(
      file, ": the meshes were exported with --up ", exported.transform().up(), " --unit ",
      exported.transform().unit(),
      "; they come back turned or scaled unless import gets the same, and the export's --world-up"));
}

absl::Status ImportGarment(const GarmentImportOptions& options, bool quiet) {
  const StopOnSignal stop;
  MeshImport request = options.request;
  request.unit_mm = LengthUnitNamed(options.unit).value().mm;
  if (!options.up.empty()) {
    WEFT_ASSIGN_OR_RETURN(const UpAxis up, UpAxisFromName(options.up));
    WEFT_ASSIGN_OR_RETURN(const ExportTransform mesh_from_world,
                          ExportTransform::Make(up, options.world_up, LengthUnit::kMillimetre));
    request.world_from_mesh = mesh_from_world.rotation.transpose();
  }
  WarnOfOtherAxes(request);
  WEFT_ASSIGN_OR_RETURN(const ImportedGarment imported, WithBar("import", quiet, 0, [&](const auto& tell) {
                          return ImportMeshes(request, tell, stop.token());
                        }));
  absl::PrintF("%s: %d frames of %d vertices and %d faces; the mesh at rest is %s\n", request.out,
               imported.frames.size(), imported.vertices, imported.faces, imported.garment);
  return absl::OkStatus();
}

void AddUnitOption(CLI::App& command, std::string& unit) {
  AddOption(command, "--unit UNIT", unit,
            "Unit of the mesh's coordinates, which OBJ and PLY do not say; Blender's is m", OneLengthUnit());
}

void AddGarmentCheckCommand(CLI::App& garment, CommandLine& line) {
  const auto [command, options] = AddCommand<GarmentCheckOptions>(
      garment, line, CheckGarment, "check",
      "Check the mesh of a garment: a template, or an OBJ or PLY of another "
      "program. Every edge has one or two "
      "faces; texture coordinates (vt of an OBJ) make charts with seams between "
      "them, and the charts an atlas. "
      "Prints what it is.",
      "  weft garment check shirt.obj --unit m\n"
      "  weft garment check shirt.obj --unit m --atlas atlas.png --json");
  AddRequired(*command, "mesh FILE", options->mesh, "OBJ or PLY, or folder of a template");
  AddUnitOption(*command, options->unit);
  AddOption(*command, "--atlas FILE", options->atlas,
            "Write the atlas as a PNG: the charts as they are packed, with the mesh's places as colours");
  AddOption(*command, "--level N", options->layout.level, "A texel of the atlas is 2^N edges wide",
            CLI::Range(0, 6));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.GarmentMeshSummary)");
}

void AddGarmentImportCommand(CLI::App& garment, CommandLine& line) {
  const auto [command, options] = AddCommand<GarmentImportOptions>(
      garment, line, ImportGarment, "import",
      "Make a result of meshes of other programs, one file of each frame: weft export, weft evaluate and "
      "--against read it like the result of a registration. All have the vertices and faces of the first. "
      "Frames are named by the numbers in the names of the files. DIR/garment.ply is the mesh at rest, in "
      "mm.",
      "  weft garment import shirt.obj --unit m --out shirt\n"
      "  weft garment import sim/shirt_*.obj --unit m --out simulated\n"
      "  weft export simulated --format glb --fps 25 --out web\n"
      "  weft evaluate result --against simulated --out comparison");
  AddRequired(*command, "meshes FILE", options->request.meshes, "OBJ or PLY");
  AddUnitOption(*command, options->unit);
  AddOption(
      *command, "--up UP", options->up,
      "The axis that points up in the files, as of weft export; by default they are in the world's axes",
      OneOf({"y", "z"}));
  AddOption(*command, "--world-up UP", options->world_up,
            "With --up: the axis of the rig's world that points up",
            OneOf({"x", "-x", "y", "-y", "z", "-z"}));
  command->get_option("--world-up")->needs("--up");
  AddOption(*command, "--rest FILE", options->request.rest,
            "The garment at rest; by default the mesh of the first frame");
  AddRequired(*command, "--out DIR", options->request.out, "Folder to write to");
}

}  // namespace

void AddGarmentCommand(CLI::App& app, CommandLine& line) {
  CLI::App* garment = AddGroup(app, "garment", "Meshes of garments from other programs, without a board");
  AddGarmentCheckCommand(*garment, line);
  AddGarmentImportCommand(*garment, line);
}

}  // namespace weft
