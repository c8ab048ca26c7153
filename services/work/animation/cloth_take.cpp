#include "services/work/animation/cloth_take.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "services/formats/figure/body_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/frame_folders.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/synthetic/dataset_file.h"
#include "services/formats/synthetic/truth_file.h"
#include "services/results/evaluation/listed_frames.h"
#include "simulation/dataset_presets.h"
#include "weft/v1/dataset.pb.h"
#include "weft/v1/job.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr double kUsualFps = 30;

std::string TemplateIn(const fs::path& folder) {
  const fs::path garment = folder / "template";
  return PathExists(garment / "template.json") ? garment.string() : "";
}

absl::StatusOr<std::string> HashOfTemplate(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const Template garment, ReadTemplate(folder));
  return garment.ContentHash();
}

absl::StatusOr<BodyShape> BodyOf(const v1::Dataset& dataset, const std::string& source_name) {
  WEFT_ASSIGN_OR_RETURN(const std::string json, ToJson(dataset.body()));
  WEFT_ASSIGN_OR_RETURN(const NamedBody body, ParseBody(json, source_name + ": body"));
  return body.shape;
}

absl::StatusOr<ClothSource> OpenDataset(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const v1::Dataset dataset, ReadDatasetFile(folder));
  WEFT_ASSIGN_OR_RETURN(const BodyShape body, BodyOf(dataset, folder));
  ClothSource out;
  out.is_dataset = true;
  for (const v1::DatasetTake& about : dataset.takes()) {
    if (about.frames_hash().empty() || about.split() == NameOf(DatasetSplit::kChaos)) continue;
    const fs::path of_take = fs::path(folder) / "takes" / about.name();
    WEFT_ASSIGN_OR_RETURN(ClothTake take,
                          ClothTake::OfFramesFile((fs::path(folder) / about.name()).string(),
                                                  (of_take / "truth" / "frames.bin").string()));
    take.split = about.split();
    take.motion = about.motion();
    take.folder = of_take.string();
    take.body = body;
    if (out.garment.empty()) out.garment = TemplateIn(of_take);
    out.takes.push_back(std::move(take));
  }
  if (!out.takes.empty()) return out;
  return absl::NotFoundError(
      absl::StrCat(folder, ": no take of the data set is complete; `weft dataset make` goes on with it"));
}

absl::StatusOr<ClothSource> OpenClothWithoutPictures(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(
      ClothTake take, ClothTake::OfFramesFile(folder, (fs::path(folder) / "truth" / "frames.bin").string()));
  take.folder = folder;
  ClothSource out;
  out.garment = TemplateIn(folder);
  out.takes.push_back(std::move(take));
  return out;
}

double FpsOr(double told, double given) { return given > 0 ? given : told > 0 ? told : kUsualFps; }

absl::StatusOr<ClothSource> OpenTruthMeshes(const std::string& folder, double fps) {
  const fs::path truth = fs::path(folder) / "truth";
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> names, ListTruthFrames(truth.string()));
  ClothSource out;
  out.garment = TemplateIn(folder);
  std::string hash;
  if (!out.garment.empty()) {
    WEFT_ASSIGN_OR_RETURN(hash, HashOfTemplate(out.garment));
  }
  std::vector<std::string> paths;
  for (const std::string& name : names) paths.push_back((truth / name / "mesh.ply").string());
  out.takes.push_back(ClothTake::OfMeshes(folder, std::move(paths), names,
                                          FpsOr(TimesOfTake(folder, truth.string()).fps, fps), hash));
  out.takes.back().folder = folder;
  return out;
}

// A frame whose mesh was registered from its own images.
bool IsRegistered(const std::string& folder, const std::string& frame) {
  v1::FrameReport report;
  const FramePaths paths(folder, frame);
  if (!PathExists(paths.Of(FrameFile::kMesh))) return false;
  if (!ReadJsonFile(paths.Of(FrameFile::kReport), report).ok()) return false;
  return report.state() == v1::FRAME_STATE_DONE || report.state() == v1::FRAME_STATE_DEGRADED;
}

absl::StatusOr<ClothSource> OpenResults(const std::string& folder, double fps) {
  v1::Job job;
  const std::string job_path = (fs::path(folder) / kJobFile).string();
  WEFT_RETURN_IF_ERROR(ReadJsonFile(job_path, job));
  if (job.has_driven())
    return absl::FailedPreconditionError(
        absl::StrCat(job_path, ": these frames were driven by the avatar ", job.driven().avatar(),
                     "; an avatar learns from results of `weft register` or from simulated takes"));
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> frames, ListFrameFolders(folder, FrameFile::kReport));
  const TakeTimes times = TimesOfTake(job.spec().dump(), (fs::path(job.spec().dump()) / "truth").string());
  ClothSource out;
  if (PathExists(job.spec().garment())) out.garment = job.spec().garment();
  std::vector<std::string> paths, names;
  const auto end_run = [&] {
    if (paths.empty()) return;
    const std::string name = out.takes.empty() ? folder : absl::StrCat(folder, " from ", names.front());
    out.takes.push_back(ClothTake::OfMeshes(name, std::exchange(paths, {}), std::exchange(names, {}),
                                            FpsOr(times.fps, fps), job.inputs().garment()));
  };
  for (const std::string& frame : frames) {
    if (!IsRegistered(folder, frame)) {
      end_run();
      continue;
    }
    paths.push_back(FramePaths(folder, frame).Of(FrameFile::kMesh));
    names.push_back(frame);
  }
  end_run();
  if (!out.takes.empty()) return out;
  return absl::NotFoundError(absl::StrCat(folder, ": no frame was registered; look at its report.html"));
}

absl::StatusOr<ClothSource> OpenAnySource(const std::string& folder, double fps) {
  const fs::path path(folder);
  if (PathExists(path / "dataset.json")) return OpenDataset(folder);
  if (PathExists(path / kJobFile)) return OpenResults(folder, fps);
  if (PathExists(path / "truth" / "frames.bin")) return OpenClothWithoutPictures(folder);
  if (PathExists(path / "truth" / "frames.bin.part"))
    return absl::FailedPreconditionError(
        absl::StrCat(folder, ": the take is not complete; the command that makes it goes on with it"));
  if (PathExists(path / "truth")) return OpenTruthMeshes(folder, fps);
  return absl::NotFoundError(
      absl::StrCat(folder,
                   ": holds no meshes; give the results of `weft register`, a take of `weft simulate`, "
                   "or a data set of `weft dataset make`"));
}

}  // namespace

absl::StatusOr<ClothTake> ClothTake::OfFramesFile(std::string name, const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(FramesReader reader, FramesReader::Open(path));
  ClothTake out;
  out.name_ = std::move(name);
  out.path_ = path;
  out.template_hash_ = reader.head().template_hash;
  out.frames_ = reader.frames();
  out.fps_ = reader.head().fps;
  out.reader_ = std::move(reader);
  return out;
}

ClothTake ClothTake::OfMeshes(std::string name, std::vector<std::string> paths,
                              std::vector<std::string> names, double fps, std::string template_hash) {
  ClothTake out;
  out.name_ = std::move(name);
  out.frames_ = static_cast<int>(paths.size());
  out.meshes_ = std::move(paths);
  out.names_ = std::move(names);
  out.fps_ = fps;
  out.template_hash_ = std::move(template_hash);
  return out;
}

absl::StatusOr<ClothTake> ClothTake::OpenAgain() const {
  WEFT_ASSIGN_OR_RETURN(ClothTake out, reader_ ? OfFramesFile(name_, path_)
                                               : OfMeshes(name_, meshes_, names_, fps_, template_hash_));
  out.split = split;
  out.motion = motion;
  out.folder = folder;
  out.body = body;
  return out;
}

absl::StatusOr<std::string> ClothTake::FramesHash() const {
  if (!reader_) return std::string();
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path_));
  return absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size()));
}

absl::StatusOr<ClothFrame> ClothTake::Read(int frame) {
  if (reader_) return reader_->Read(frame);
  if (frame < 0 || frame >= frames_)
    return absl::OutOfRangeError(absl::StrCat(name_, ": holds frames 0 to ", frames_ - 1, ", not ", frame));
  WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, ReadMesh(meshes_[static_cast<size_t>(frame)]));
  return ClothFrame{static_cast<int64_t>(1e9 * frame / fps_), std::move(mesh.vertices_mm), {}};
}

absl::StatusOr<ClothSource> OpenClothSource(const std::string& folder, double fps) {
  WEFT_ASSIGN_OR_RETURN(ClothSource source, OpenAnySource(folder, fps));
  for (ClothTake& take : source.takes)
    if (take.motion.empty()) take.motion = folder;
  return source;
}

absl::StatusOr<SharedTemplate> TemplateOfSources(const std::vector<ClothSource>& sources,
                                                 const std::string& given) {
  SharedTemplate out;
  out.path = given;
  for (const ClothSource& source : sources)
    if (out.path.empty()) out.path = source.garment;
  if (out.path.empty())
    return absl::InvalidArgumentError("no source tells which template its meshes have; give --template");
  WEFT_ASSIGN_OR_RETURN(out.garment, ReadTemplate(out.path));
  const std::string hash = out.garment.ContentHash();
  for (const ClothSource& source : sources)
    for (const ClothTake& take : source.takes)
      if (!take.template_hash().empty() && take.template_hash() != hash)
        return absl::FailedPreconditionError(
            absl::StrCat(take.name(), ": its meshes are of the template with hash ", take.template_hash(),
                         ", but that of ", out.path, " has ", hash, "; use meshes of one template"));
  return out;
}

}  // namespace weft
