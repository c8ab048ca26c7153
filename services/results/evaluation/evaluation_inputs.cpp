#include "services/results/evaluation/evaluation_inputs.h"

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/take/open_dump.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/garment_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/synthetic/truth_file.h"
#include "services/results/report/job_frames.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// A path that was given, or else the one of the job where something stands there.
std::string PathOf(const std::string& given, const std::string& of_job) {
  if (!given.empty()) return given;
  return !of_job.empty() && PathExists(of_job) ? of_job : "";
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
  WEFT_ASSIGN_OR_RETURN(inputs.rig, ReadRig(path));
  return CheckHash("rig", path, job.inputs().rig(), inputs.rig->ContentHash());
}

absl::Status LoadGarment(const std::string& path, const v1::Job& job, EvaluationInputs& inputs) {
  if (path.empty()) {
    inputs.remarks.push_back({"geodesic distortion, drift", "there is no template; give --template"});
    return absl::OkStatus();
  }
  if (IsMeshName(path)) {
    WEFT_ASSIGN_OR_RETURN(GarmentMesh garment, ReadGarmentMesh(path));
    inputs.garment = std::make_shared<const GarmentMesh>(std::move(garment));
    return CheckHash("garment's mesh", path, job.inputs().garment(), inputs.garment->MeshHash());
  }
  WEFT_ASSIGN_OR_RETURN(Template garment, ReadTemplate(path));
  inputs.printed = std::make_shared<const Template>(std::move(garment));
  inputs.garment = inputs.printed;
  return CheckHash("template", path, job.inputs().garment(), inputs.printed->ContentHash());
}

absl::Status OpenDump(const std::string& path, const std::string& mosaic, bool is_required,
                      EvaluationInputs& inputs) {
  if (path.empty() || !inputs.rig) {
    inputs.remarks.push_back({"texture drift", "there are no pictures; give --take and --rig"});
    return absl::OkStatus();
  }
  absl::StatusOr<std::unique_ptr<FrameSource>> dump = OpenDump(path, *inputs.rig, mosaic);
  if (dump.ok()) {
    inputs.dump = *std::move(dump);
    inputs.dump_path = path;
    return absl::OkStatus();
  }
  if (is_required) return dump.status();
  inputs.remarks.push_back({"texture drift", std::string(dump.status().message())});
  return absl::OkStatus();
}

// A truth that nobody named and that does not fit is no reason to refuse the result.
void LeaveTruth(const absl::Status& why, EvaluationInputs& inputs) {
  inputs.remarks.push_back({"errors against the truth, exact drift",
                            absl::StrCat(inputs.truth, " beside the take was not used: ", why.message())});
  inputs.truth.clear();
}

// Finds which vertex of the truth is which of the result. Needs the template of the take beside its truth.
absl::Status MatchTruth(EvaluationInputs& inputs) {
  const fs::path of_truth = (fs::path(inputs.truth) / "../template").lexically_normal();
  if (!inputs.garment || !PathExists(of_truth / "template.json")) return absl::OkStatus();
  WEFT_ASSIGN_OR_RETURN(const Template truth, ReadTemplate(of_truth.string()));
  if (!inputs.printed && HaveSameFaces(*inputs.garment, truth)) return absl::OkStatus();
  if (!inputs.printed)
    return absl::FailedPreconditionError(
        absl::StrCat(inputs.truth,
                     ": the result's mesh has other faces than the take's template, and no board "
                     "relates them; give --template with a template of the take's board"));
  if (HaveSameVertices(*inputs.printed, truth)) return absl::OkStatus();
  absl::StatusOr<TruthByNode> by_node = TruthByNode::Build(*inputs.printed, truth);
  if (!by_node.ok())
    return absl::Status(by_node.status().code(),
                        absl::StrCat(inputs.truth, ": ", by_node.status().message(),
                                     "; give the truth of the take that was registered"));
  inputs.remarks.push_back(
      {"vertex error, exact drift",
       absl::StrCat("the result's template is not that of ", of_truth.string(),
                    "; its vertices are compared by board cell, which ", by_node->matched(), " of ",
                    by_node->vertices(), " have in common with the truth")});
  inputs.truth_by_node = *std::move(by_node);
  if (!truth.garments.empty() && inputs.printed->garments.empty())
    inputs.rows_of_garment = GarmentRows(*inputs.printed);
  return absl::OkStatus();
}

absl::Status LoadTruth(const EvaluationRequest& request, const std::string& dump, EvaluationInputs& inputs) {
  const bool is_named = !request.truth.empty();
  inputs.truth = request.truth;
  if (request.no_truth) {
    inputs.remarks.push_back({"errors against the truth, exact drift", "left out on request (--no-truth)"});
    return absl::OkStatus();
  }
  if (!is_named && !dump.empty() && PathExists(fs::path(dump) / "truth"))
    inputs.truth = (fs::path(dump) / "truth").string();
  if (inputs.truth.empty()) {
    inputs.remarks.push_back(
        {"errors against the truth, exact drift", "there is no ground truth; give --truth"});
    return absl::OkStatus();
  }
  absl::Status status = ListTruthFrames(inputs.truth).status();
  if (status.ok()) status = MatchTruth(inputs);
  if (!status.ok() && !is_named) {
    LeaveTruth(status, inputs);
    return absl::OkStatus();
  }
  return status;
}

// By --fps, else by the times of the take.
void FindFrameRate(const EvaluationRequest& request, const TakeTimes& times, EvaluationInputs& inputs) {
  inputs.fps = request.fps > 0 ? request.fps : times.fps;
  inputs.fps_source = request.fps > 0 ? "--fps" : times.source;
  if (inputs.fps == 0)
    inputs.remarks.push_back({"drift per second",
                              "the frame rate of the take is unknown, so drift is given per frame; --fps "
                              "gives it per second"});
}

// What is not of this job is no part of its evaluation, and said.
absl::Status LoadReports(EvaluationInputs& inputs) {
  if (!IsFolder(inputs.result)) return absl::OkStatus();
  std::vector<std::string> notes;
  WEFT_ASSIGN_OR_RETURN(std::vector<v1::FrameReport> reports,
                        ReadJobFrames(inputs.result, inputs.job, notes));
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> without,
                        FramesWithoutReport(inputs.result, inputs.job, reports));
  for (v1::FrameReport& report : reports) inputs.reports[report.frame()] = std::move(report);
  if (!inputs.job.has_spec()) return absl::OkStatus();
  for (std::string& note : notes) inputs.remarks.push_back({"frames", std::move(note)});
  for (const std::string& frame : without)
    inputs.remarks.push_back(
        {"frames",
         absl::StrCat("frame ", frame, ": its report.json is missing, damaged, or of other inputs, so ",
                      "its files are not used; `weft register` with the same inputs computes it again")});
  return absl::OkStatus();
}

}  // namespace

absl::Status EvaluationRequest::Validate() const {
  if (result.empty()) return absl::InvalidArgumentError("the folder of the result is empty");
  if (no_truth && !truth.empty()) return absl::InvalidArgumentError("a truth is named and left out at once");
  if (!(fps >= 0)) return absl::InvalidArgumentError("fps must not be negative");
  if (samples < 0) return absl::InvalidArgumentError("samples must not be negative");
  for (const absl::Status& status :
       {scores.Validate(), geodesics.Validate(), texture.Validate(), cameras.Validate()})
    if (!status.ok()) return status;
  return absl::OkStatus();
}

absl::StatusOr<EvaluationInputs> LoadEvaluationInputs(const EvaluationRequest& request) {
  WEFT_RETURN_IF_ERROR(request.Validate());
  v1::Job job;
  if (const fs::path path = fs::path(request.result) / kJobFile; PathExists(path))
    WEFT_RETURN_IF_ERROR(ReadJsonFile(path.string(), job));
  EvaluationInputs inputs;
  inputs.result = request.result;
  const std::string dump = PathOf(request.dump, job.spec().dump());
  WEFT_RETURN_IF_ERROR(LoadRig(PathOf(request.rig, job.spec().rig()), job, inputs));
  WEFT_RETURN_IF_ERROR(LoadGarment(PathOf(request.garment, job.spec().garment()), job, inputs));
  const std::string mosaic = dump == job.spec().dump() ? job.spec().options().mosaic() : "";
  WEFT_RETURN_IF_ERROR(OpenDump(dump, mosaic, !request.dump.empty(), inputs));
  WEFT_RETURN_IF_ERROR(LoadTruth(request, dump, inputs));
  const fs::path beside = fs::path(dump) / "truth";
  const TakeTimes times = TimesOfTake(dump, !inputs.truth.empty()                 ? inputs.truth
                                            : !dump.empty() && PathExists(beside) ? beside.string()
                                                                                  : "");
  FindFrameRate(request, times, inputs);
  WEFT_ASSIGN_OR_RETURN(inputs.frames,
                        ListFrames(inputs.result, inputs.truth, job, inputs.dump.get(), times));
  inputs.job = std::move(job);
  WEFT_RETURN_IF_ERROR(LoadReports(inputs));
  return inputs;
}

}  // namespace weft
