#include "services/evaluation/evaluation_inputs.h"

#include <filesystem>
#include <map>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "capture/open_dump.h"
#include "services/files/atomic_file.h"
#include "services/files/frame_folders.h"
#include "services/files/json_file.h"
#include "services/files/rig_file.h"
#include "services/files/template_file.h"
#include "services/synthetic/truth_file.h"
#include "weft/v1/job.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

bool Exists(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

// A path that was given, or else the one of the job where something stands there.
std::string PathOf(const std::string& given, const std::string& of_job) {
  if (!given.empty()) return given;
  return !of_job.empty() && Exists(of_job) ? of_job : "";
}

absl::Status CheckHash(const char* what, const std::string& path, const std::string& of_job,
                       const std::string& found) {
  if (of_job.empty() || of_job == found) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(path, ": the ", what, " has hash ", found,
                                                    ", but the result was computed with ", of_job,
                                                    "; give the ", what, " of the job"));
}

absl::Status LoadRig(const std::string& path, const v1::Job& job, EvaluationInputs& inputs) {
  if (path.empty()) {
    inputs.remarks.push_back({"reprojection, texture drift", "there is no rig; give --rig"});
    return absl::OkStatus();
  }
  absl::StatusOr<Rig> rig = ReadRig(path);
  if (!rig.ok()) return rig.status();
  inputs.rig = *std::move(rig);
  return CheckHash("rig", path, job.inputs().rig(), inputs.rig->ContentHash());
}

absl::Status LoadTemplate(const std::string& path, const v1::Job& job, EvaluationInputs& inputs) {
  if (path.empty()) {
    inputs.remarks.push_back({"geodesic distortion, drift", "there is no template; give --template"});
    return absl::OkStatus();
  }
  absl::StatusOr<Template> garment = ReadTemplate(path);
  if (!garment.ok()) return garment.status();
  inputs.garment = *std::move(garment);
  return CheckHash("template", path, job.inputs().garment(), inputs.garment->ContentHash());
}

absl::Status OpenDump(const std::string& path, bool is_required, EvaluationInputs& inputs) {
  if (path.empty() || !inputs.rig) {
    inputs.remarks.push_back({"texture drift", "there are no pictures; give --take and --rig"});
    return absl::OkStatus();
  }
  absl::StatusOr<std::unique_ptr<FrameSource>> dump = OpenDump(path, *inputs.rig);
  if (dump.ok()) {
    inputs.dump = *std::move(dump);
    inputs.dump_path = path;
    return absl::OkStatus();
  }
  if (is_required) return dump.status();
  inputs.remarks.push_back({"texture drift", std::string(dump.status().message())});
  return absl::OkStatus();
}

// Frames per second by the times of the pictures of a camera in <truth>/pictures.csv
// (frame,camera,mid_exposure_ns,lost); 0 where they do not tell.
double FpsOfTruth(const std::string& truth) {
  if (truth.empty()) return 0;
  const absl::StatusOr<std::string> csv = ReadWholeFile((fs::path(truth) / "pictures.csv").string());
  if (!csv.ok()) return 0;
  std::string camera;
  std::vector<double> times_ns;
  for (const auto line : absl::StrSplit(*csv, '\n')) {
    const std::vector<std::string> fields = absl::StrSplit(line, ',');
    double time_ns = 0;
    if (fields.size() < 3 || !absl::SimpleAtod(fields[2], &time_ns)) continue;
    if (camera.empty()) camera = fields[1];
    if (fields[1] == camera) times_ns.push_back(time_ns);
  }
  if (times_ns.size() < 2 || !(times_ns.back() > times_ns.front())) return 0;
  return 1e9 * static_cast<double>(times_ns.size() - 1) / (times_ns.back() - times_ns.front());
}

absl::Status ListFrames(EvaluationInputs& inputs) {
  const absl::StatusOr<std::vector<std::string>> names =
      inputs.truth.empty() ? ListFrameFolders(inputs.result) : ListTruthFrames(inputs.truth);
  if (!names.ok()) return names.status();
  std::map<std::string, int> in_dump;
  if (inputs.dump)
    for (size_t i = 0; i < inputs.dump->frame_names().size(); ++i)
      in_dump[inputs.dump->frame_names()[i]] = static_cast<int>(i);
  for (size_t i = 0; i < names->size(); ++i) {
    const auto at = in_dump.find((*names)[i]);
    const bool is_known = at != in_dump.end();
    inputs.frames.push_back(
        {(*names)[i], is_known ? at->second : static_cast<int>(i), is_known ? at->second : -1});
  }
  if (!inputs.frames.empty()) return absl::OkStatus();
  return absl::NotFoundError(
      absl::StrCat(inputs.result, ": holds no frames; give the --out folder of `weft register`"));
}

}  // namespace

absl::Status EvaluationRequest::Validate() const {
  if (result.empty()) return absl::InvalidArgumentError("the folder of the result is empty");
  if (!(fps >= 0)) return absl::InvalidArgumentError("fps must not be negative");
  if (samples < 0) return absl::InvalidArgumentError("samples must not be negative");
  for (const absl::Status& status :
       {scores.Validate(), geodesics.Validate(), texture.Validate(), cameras.Validate()})
    if (!status.ok()) return status;
  return absl::OkStatus();
}

absl::StatusOr<EvaluationInputs> LoadEvaluationInputs(const EvaluationRequest& request) {
  if (absl::Status status = request.Validate(); !status.ok()) return status;
  v1::Job job;
  if (const fs::path path = fs::path(request.result) / "job.json"; Exists(path))
    if (absl::Status status = ReadJsonFile(path.string(), job); !status.ok()) return status;
  EvaluationInputs inputs;
  inputs.result = request.result;
  const std::string dump = PathOf(request.dump, job.spec().dump());
  inputs.truth = request.truth;
  if (inputs.truth.empty() && !dump.empty() && Exists(fs::path(dump) / "truth"))
    inputs.truth = (fs::path(dump) / "truth").string();
  if (inputs.truth.empty())
    inputs.remarks.push_back(
        {"errors against the truth, exact drift", "there is no ground truth; give --truth"});
  inputs.fps = request.fps > 0 ? request.fps : FpsOfTruth(inputs.truth);
  if (inputs.fps == 0) {
    inputs.fps = 30;
    inputs.remarks.push_back({"drift per second", "30 frames a second are assumed; give --fps"});
  }
  if (absl::Status status = LoadRig(PathOf(request.rig, job.spec().rig()), job, inputs); !status.ok())
    return status;
  if (absl::Status status = LoadTemplate(PathOf(request.garment, job.spec().garment()), job, inputs);
      !status.ok())
    return status;
  if (absl::Status status = OpenDump(dump, !request.dump.empty(), inputs); !status.ok()) return status;
  if (absl::Status status = ListFrames(inputs); !status.ok()) return status;
  return inputs;
}

}  // namespace weft
