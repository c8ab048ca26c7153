// weft dataset meshes: the true cloth of a simulated take, and the person in it, as meshes.
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "alignment/garment_parts.h"
#include "alignment/mesh_texture.h"
#include "figure/body.h"
#include "services/formats/figure/body_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/results/export/export_transform.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/progress.h"
#include "services/work/animation/cloth_take.h"

namespace weft {
namespace {

struct DatasetMeshesOptions {
  std::string take, body, out, up = "y", unit = "m";
};

// Of the person whose pose the take keeps. recipe.txt has the hash of a body that is not the average one, and
// its factors are in a file of the user's.
absl::StatusOr<BodyShape> BodyOfTake(const DatasetMeshesOptions& options) {
  const std::string word = " body ";
  const absl::StatusOr<std::string> recipe = ReadWholeFile(absl::StrCat(options.take, "/recipe.txt"));
  const size_t at = recipe.ok() ? recipe->find(word) : std::string::npos;
  std::string hash = BodyHash(BodyShape());
  if (at != std::string::npos) hash = recipe->substr(at + word.size(), hash.size());
  BodyShape shape;
  if (!options.body.empty()) {
    WEFT_ASSIGN_OR_RETURN(const NamedBody body, ReadBody(options.body));
    shape = body.shape;
  }
  if (BodyHash(shape) == hash) return shape;
  return absl::FailedPreconditionError(absl::StrCat(
      options.take, ": its person has the body ", hash, ", not ",
      options.body.empty() ? "the average one" : absl::StrCat(options.body, ", ", BodyHash(shape)),
      "; give with --body the file that `weft simulate` was given"));
}

struct WrittenMeshes {
  int frames = 0;
  bool has_body = false;
};

void MoveAll(const ExportTransform& transform, std::vector<Eigen::Vector3d>& vertices) {
  for (Eigen::Vector3d& v : vertices) v = transform.unit_per_mm * (transform.rotation * v);
}

// <out>/cloth/<frame>.ply, and <out>/body/<frame>.ply where the take knows the pose.
absl::StatusOr<WrittenMeshes> WriteMeshes(const DatasetMeshesOptions& options, ClothTake& take,
                                          const Template& garment, const MeshTexture& texture,
                                          const ExportTransform& transform, Progress& progress) {
  const std::string& out = options.out;
  WrittenMeshes written;
  BodyShape shape;
  WEFT_RETURN_IF_ERROR(CreateFolders(absl::StrCat(out, "/cloth")));
  for (int k = 0; k < take.frames(); ++k) {
    WEFT_ASSIGN_OR_RETURN(ClothFrame frame, take.Read(k));
    const std::string name = take.frame_names().empty() ? absl::StrFormat("%04d", k) : take.frame_names()[k];
    if (frame.pose && !written.has_body) {  // before a file of the frame is there: it may be another body
      WEFT_ASSIGN_OR_RETURN(shape, BodyOfTake(options));
      WEFT_RETURN_IF_ERROR(CreateFolders(absl::StrCat(out, "/body")));
      written.has_body = true;
    }
    MoveAll(transform, frame.vertices_mm);
    absl::Status status = WriteMesh(absl::StrCat(out, "/cloth/", name, ".ply"),
                                    {std::move(frame.vertices_mm), garment.rest.faces}, texture);
    if (status.ok() && frame.pose) {
      std::vector<Eigen::Vector3d> body = Body(*frame.pose, shape).MeshVertices();
      MoveAll(transform, body);
      status = WriteMesh(absl::StrCat(out, "/body/", name, ".ply"), {std::move(body), Body::MeshFaces()});
    }
    if (!status.ok()) return status;
    ++written.frames;
    progress.Set(static_cast<uint64_t>(k) + 1, static_cast<uint64_t>(take.frames()));
  }
  return written;
}

absl::StatusOr<ExportTransform> TransformOf(const DatasetMeshesOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const UpAxis up, UpAxisFromName(options.up));
  WEFT_ASSIGN_OR_RETURN(const LengthUnit unit, LengthUnitFromName(options.unit));
  return ExportTransform::Make(up, "-y", unit);
}

absl::Status WriteTakeMeshes(const DatasetMeshesOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const ExportTransform transform, TransformOf(options));
  WEFT_ASSIGN_OR_RETURN(ClothSource source, OpenClothSource(options.take, 0));
  if (source.takes.size() != 1) {
    return absl::InvalidArgumentError(
        absl::StrCat(options.take, ": holds ", source.takes.size(),
                     " takes; give one of them, of a data set one of its folders takes/<take>"));
  }
  std::vector<ClothSource> sources;
  sources.push_back(std::move(source));
  ClothTake& take = sources.front().takes.front();
  WEFT_ASSIGN_OR_RETURN(const SharedTemplate garment, TemplateOfSources(sources, ""));
  WEFT_ASSIGN_OR_RETURN(const GarmentParts parts, ReadGarmentParts(garment.path));
  Progress progress("meshes", 1, ProgressVisible(quiet));
  WEFT_ASSIGN_OR_RETURN(
      const WrittenMeshes written,
      WriteMeshes(options, take, garment.garment, TextureOf(garment.garment, parts), transform, progress));
  std::printf("%s: the cloth of %d frames%s, %s, %s up, %g frames/s\n", options.out.c_str(), written.frames,
              written.has_body ? ", and the body" : "", options.unit.c_str(), options.up.c_str(), take.fps());
  if (!written.has_body && !quiet) {
    std::printf(
        "Its person's pose is not known: takes of `weft simulate --motion FILE --no-pictures` and of data "
        "sets keep it.\n");
  }
  return absl::OkStatus();
}

}  // namespace

void AddDatasetMeshesCommand(CLI::App& dataset, CommandLine& line) {
  const auto [command, options] = AddCommand<DatasetMeshesOptions>(
      dataset, line, WriteTakeMeshes, "meshes",
      "Write the true cloth of a simulated take as DIR/cloth/<frame>.ply, and the "
      "person who wears it as DIR/body/<frame>.ply where the take keeps the pose: "
      "those of `weft simulate --motion FILE --no-pictures` and of data sets do.",
      "  weft dataset meshes shirt-drive/takes/train-walk-104 --out walk\n"
      "  weft dataset meshes take --up z --out meshes");
  AddRequired(*command, "take DIR", options->take, "A take of `weft simulate`, or of a data set");
  AddOption(*command, "--body FILE", options->body,
            "The body that the take was simulated with, where one was given");
  AddRequired(*command, "--out DIR", options->out, "Folder to write to");
  AddOption(*command, "--up AXIS", options->up, "The axis that points up", OneOf({"y", "z"}));
  AddOption(*command, "--unit UNIT", options->unit, "Unit of lengths", OneOf({"m", "cm", "mm"}));
}

}  // namespace weft
