#include "services/work/job/split_job.h"

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/joint_template.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/files/template_file.h"
#include "services/results/report/job_frames.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/pipeline/stage_reports.h"
#include "weft/v1/job.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// A garment of the joint template as a template of the joint board.
Template TemplateOf(const Template& joint, int garment) {
  const GarmentSpan& one = joint.garments[static_cast<size_t>(garment)];
  Template out;
  out.id = one.id;
  out.board_hash = joint.board_hash;
  out.rest = MeshOfGarment(joint, garment, joint.rest.vertices_mm);
  const auto first = joint.node_of_vertex.begin() + one.first_vertex;
  out.node_of_vertex.assign(first, first + one.vertices);
  return out;
}

absl::Status CheckNames(const Template& joint) {
  for (const GarmentSpan& one : joint.garments)
    if (one.id == "." || one.id == ".." || one.id.find('/') != std::string::npos)
      return absl::InvalidArgumentError(absl::StrCat("the template ", joint.id, " calls a garment \"", one.id,
                                                     "\", which is no name of a folder; join it again"));
  return absl::OkStatus();
}

absl::StatusOr<v1::Job> ReadEndedJob(const std::string& result) {
  v1::Job job;
  const std::string file = (fs::path(result) / kJobFile).string();
  WEFT_RETURN_IF_ERROR(ReadJsonFile(file, job));
  if (job.state() != v1::JOB_STATE_DONE)
    return absl::FailedPreconditionError(
        absl::StrCat(file, ": the job has not ended well; let `weft register` finish it first"));
  return job;
}

class GarmentSplitter {
 public:
  GarmentSplitter(std::string result, v1::Job job, const Template& joint, int garment, const std::string& out)
      : result_(std::move(result)),
        job_(std::move(job)),
        place_(joint.garments[static_cast<size_t>(garment)]),
        garment_(TemplateOf(joint, garment)),
        out_((fs::path(out) / place_.id).string()),
        rows_(garment_) {}

  // Nobody else's result is written over.
  absl::Status Prepare() const {
    v1::Job there;
    const absl::Status status = ReadJsonFile((fs::path(out_) / kJobFile).string(), there);
    if (!absl::IsNotFound(status) && (!status.ok() || there.id() != job_.id()))
      return absl::FailedPreconditionError(
          absl::StrCat(out_, ": holds the result of another job; choose another folder with --out"));
    return CreateFolders(out_);
  }

  absl::Status WriteFrame(const v1::FrameReport& joint) const {
    WEFT_ASSIGN_OR_RETURN(FrameFolder folder,
                          FrameFolder::Open(Absolute(out_), joint.frame(), ConfinedFolder::IfMissing::kMake));
    WEFT_RETURN_IF_ERROR(folder.Clear());
    v1::FrameReport report;
    report.set_frame(joint.frame());
    report.set_state(joint.state());
    report.set_reason(joint.reason());
    *report.mutable_inputs() = job_.inputs();
    report.mutable_inputs()->set_garment(garment_.ContentHash());
    *report.mutable_options() = joint.options();
    report.set_images_fingerprint(joint.images_fingerprint());
    report.set_weft_version(joint.weft_version());
    report.mutable_temporal()->set_refined(joint.temporal().refined());
    report.mutable_temporal()->set_bridged(joint.temporal().bridged());
    absl::Status status = WriteCloudOf(joint, folder, report);
    if (status.ok()) status = WriteObservationsOf(joint, folder, report);
    if (status.ok()) status = WriteMeshOf(joint, folder, report);
    return status.ok() ? folder.Commit(std::move(report)) : status;
  }

  absl::Status Finish() const {
    WEFT_RETURN_IF_ERROR(WriteTemplate(TemplateFolder(), garment_, "weft split"));
    v1::Job job = job_;
    job.mutable_spec()->set_garment(Absolute(TemplateFolder()));
    job.mutable_spec()->set_out(Absolute(out_));
    job.mutable_spec()->mutable_expected()->clear_garment();
    job.mutable_inputs()->set_garment(garment_.ContentHash());
    job.clear_verdict();  // it judged all garments together
    job.clear_usage();
    return WriteJsonFile((fs::path(out_) / kJobFile).string(), job);
  }

  const std::string& out() const { return out_; }
  const std::string& id() const { return place_.id; }

 private:
  static std::string Absolute(const std::string& path) {
    return fs::absolute(path).lexically_normal().string();
  }
  std::string TemplateFolder() const { return (fs::path(out_) / "template").string(); }
  std::string PathOf(const v1::FrameReport& joint, FrameFile file) const {
    return FramePaths(result_, joint.frame()).Of(file);
  }

  absl::Status WriteCloudOf(const v1::FrameReport& joint, const FrameFolder& folder,
                            v1::FrameReport& report) const {
    if (!Lists(joint, FrameFile::kCloud)) return absl::OkStatus();
    WEFT_ASSIGN_OR_RETURN(Cloud cloud, ReadCloud(PathOf(joint, FrameFile::kCloud)));
    std::erase_if(cloud.points, [this](const CloudPoint& p) { return !rows_.Contains(p.node); });
    std::erase_if(cloud.rays, [this](const CloudRay& r) { return !rows_.Contains(r.node); });
    DescribeCloud(cloud, *report.mutable_cloud());
    return folder.Put(
        FrameFile::kCloud,
        [&](const std::string& path) { return WriteCloud(path, cloud, CloudColumns::kWithCovariance); },
        report);
  }

  absl::Status WriteObservationsOf(const v1::FrameReport& joint, const FrameFolder& folder,
                                   v1::FrameReport& report) const {
    if (!Lists(joint, FrameFile::kObservations)) return absl::OkStatus();
    WEFT_ASSIGN_OR_RETURN(auto images, ReadObservations(PathOf(joint, FrameFile::kObservations)));
    for (ImageObservations& image : images)
      std::erase_if(image.observations, [this](const Observation& o) { return !rows_.Contains(o.node); });
    return folder.Put(
        FrameFile::kObservations, [&](const std::string& path) { return WriteObservations(path, images); },
        report);
  }

  absl::Status WriteMeshOf(const v1::FrameReport& joint, const FrameFolder& folder,
                           v1::FrameReport& report) const {
    if (!Lists(joint, FrameFile::kMesh)) return absl::OkStatus();
    const std::string path = PathOf(joint, FrameFile::kMesh);
    WEFT_ASSIGN_OR_RETURN(const RegisteredMesh all, ReadRegisteredMesh(path));
    if (all.vertices_mm.size() < static_cast<size_t>(place_.first_vertex + place_.vertices))
      return absl::InvalidArgumentError(absl::StrCat(path, ": has ", all.vertices_mm.size(),
                                                     " vertices, fewer than the template of its job"));
    const RegisteredMesh mesh = MeshOfSpan(place_, all);
    DescribeMesh(mesh, garment_, *report.mutable_mesh());
    return folder.PutMesh(
        kGarmentMesh, mesh.vertices_mm.size(), garment_.rest.faces,
        [&](const std::string& to) { return WriteRegisteredMesh(to, mesh, garment_.rest.faces); }, report);
  }

  std::string result_;
  v1::Job job_;
  GarmentSpan place_;
  Template garment_;
  std::string out_;
  GarmentRows rows_;
};

}  // namespace

absl::StatusOr<std::vector<SplitGarment>> SplitJob(const std::string& result, const std::string& out,
                                                   const SplitProgress& progress,
                                                   const std::stop_token& stop) {
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, ReadEndedJob(result));
  WEFT_ASSIGN_OR_RETURN(const Template joint, ReadTemplate(job.spec().garment()));
  if (joint.ContentHash() != job.inputs().garment())
    return absl::FailedPreconditionError(
        absl::StrCat(job.spec().garment(), ": the template has hash ", joint.ContentHash(), ", the job had ",
                     job.inputs().garment(), "; put the template back that it was registered with"));
  if (joint.garments.empty())
    return absl::FailedPreconditionError(
        absl::StrCat(result, ": the template ", joint.id,
                     " is of one garment; `weft template join` makes those that can be split"));
  WEFT_RETURN_IF_ERROR(CheckNames(joint));
  std::vector<std::string> notes;
  WEFT_ASSIGN_OR_RETURN(const std::vector<v1::FrameReport> frames, ReadJobFrames(result, job, notes));
  std::vector<GarmentSplitter> splitters;
  for (size_t i = 0; i < joint.garments.size(); ++i) {
    splitters.emplace_back(result, job, joint, static_cast<int>(i), out);
    WEFT_RETURN_IF_ERROR(splitters.back().Prepare());
  }
  std::vector<SplitGarment> done;
  int written = 0;
  const int all = static_cast<int>(frames.size() * splitters.size());
  for (const GarmentSplitter& splitter : splitters) {
    SplitGarment garment{splitter.id(), splitter.out(), 0};
    for (const v1::FrameReport& frame : frames) {
      if (stop.stop_requested()) return absl::CancelledError("stopped; the same command begins again");
      WEFT_RETURN_IF_ERROR(splitter.WriteFrame(frame));
      garment.frames += Lists(frame, FrameFile::kMesh);
      if (progress) progress(++written, all);
    }
    WEFT_RETURN_IF_ERROR(splitter.Finish());
    done.push_back(std::move(garment));
  }
  return done;
}

}  // namespace weft
