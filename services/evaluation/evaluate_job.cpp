#include "services/evaluation/evaluate_job.h"

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/files/cloud_file.h"
#include "services/files/mesh_file.h"
#include "services/files/observations_file.h"
#include "services/synthetic/truth_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// The three pieces of a frame; names of those that are not there are appended to `missing`.
absl::StatusOr<ResultPieces> ReadFrameResult(const fs::path& folder, std::vector<std::string>& missing) {
  const auto path_of = [&](const char* name) -> std::string {
    std::error_code error;
    if (fs::exists(folder / name, error)) return (folder / name).string();
    missing.emplace_back(name);
    return "";
  };
  ResultPieces result;
  if (const std::string path = path_of("observations.csv"); !path.empty()) {
    absl::StatusOr<std::vector<ImageObservations>> images = ReadObservations(path);
    if (!images.ok()) return images.status();
    result.observations.emplace();
    for (ImageObservations& image : *images)
      result.observations->push_back({std::move(image.image), std::move(image.observations)});
  }
  if (const std::string path = path_of("cloud.ply"); !path.empty()) {
    absl::StatusOr<Cloud> cloud = ReadCloud(path);
    if (!cloud.ok()) return cloud.status();
    result.cloud = *std::move(cloud);
  }
  if (const std::string path = path_of("mesh.ply"); !path.empty()) {
    absl::StatusOr<TriangleMesh> mesh = ReadMesh(path);
    if (!mesh.ok()) return mesh.status();
    result.mesh_mm = std::move(mesh->vertices_mm);
  }
  return result;
}

}  // namespace

absl::StatusOr<JobEvaluation> EvaluateJob(const std::string& result_folder, const std::string& truth_folder,
                                          const EvaluationOptions& options,
                                          const std::function<void(size_t, size_t)>& on_frame) {
  const absl::StatusOr<std::vector<std::string>> names = ListTruthFrames(truth_folder);
  if (!names.ok()) return names.status();
  JobEvaluation out;
  bool any = false;
  for (const std::string& name : *names) {
    EvaluatedFrame frame;
    frame.frame = name;
    const fs::path folder = fs::path(result_folder) / name;
    const absl::StatusOr<ResultPieces> result = ReadFrameResult(folder, frame.missing);
    if (!result.ok()) return result.status();
    if (result->observations || result->cloud || result->mesh_mm) {
      any = true;
      const absl::StatusOr<FrameTruth> truth = ReadFrameTruth((fs::path(truth_folder) / name).string());
      if (!truth.ok()) return truth.status();
      absl::StatusOr<FrameScore> score = Evaluate(*truth, *result, options);
      if (!score.ok())
        return absl::Status(score.status().code(),
                            absl::StrCat(folder.string(), ": ", score.status().message()));
      frame.score = *std::move(score);
      out.total += frame.score;
    }
    out.frames.push_back(std::move(frame));
    if (on_frame) on_frame(out.frames.size(), names->size());
  }
  if (any) return out;
  return absl::NotFoundError(
      absl::StrCat(result_folder, ": holds no observations.csv, cloud.ply or mesh.ply of any of the ",
                   names->size(), " frames of ", truth_folder, "; give the --out folder of `weft register`"));
}

}  // namespace weft
