#include "services/results/export/export_result.h"

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/results/export/export_folder.h"
#include "services/results/export/garment_texture.h"
#include "services/results/export/sequence_writer.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kBetweenCheckpoints{2};
constexpr char kBaseMesh[] = "garment.obj";
constexpr char kAlbedo[] = "albedo.png";  // while the export is unfinished

std::string SequenceFile(const FormatTraits& traits) { return absl::StrCat("garment.", traits.name); }

bool IsPointCache(const FormatTraits& traits) { return traits.repeats_gaps; }

std::unique_ptr<FrameWriter> MakeFrameWriter(const ExportPlan& plan) {
  return plan.traits.format == ExportFormat::kPly ? MakePlyWriter(plan) : MakeObjWriter(plan);
}

std::unique_ptr<SequenceWriter> MakeSequenceWriter(const ExportPlan& plan) {
  switch (plan.traits.format) {
    case ExportFormat::kGlb:
      return MakeGlbWriter(plan);
    case ExportFormat::kMdd:
      return MakeMddWriter(plan);
    case ExportFormat::kPc2:
      return MakePc2Writer(plan);
    case ExportFormat::kUsda:
      return MakeUsdWriter(plan);
    default:
      return MakeNpzWriter(plan);
  }
}

// Of a vertex's measurement, which a mesh that was imported has not.
bool IsOfMeasurement(ExportAttribute attribute) {
  return attribute == ExportAttribute::kState || attribute == ExportAttribute::kSigma ||
         attribute == ExportAttribute::kViews || attribute == ExportAttribute::kCoverage;
}

// What the request asks for and the result can give.
std::vector<ExportAttribute> AttributesOf(const ExportRequest& request, const ExportSource& source) {
  std::vector<ExportAttribute> attributes =
      request.has_attributes_named ? request.attributes : TraitsOf(request.format).ByDefault();
  // Without normals readers of glTF shade every face flat, which a normal map is not made for.
  if (request.normal_map_px > 0 &&
      std::ranges::find(attributes, ExportAttribute::kNormal) == attributes.end())
    attributes.push_back(ExportAttribute::kNormal);
  std::erase_if(attributes, [&](ExportAttribute attribute) {
    return (attribute == ExportAttribute::kVelocity && source.fps() == 0) ||
           (attribute == ExportAttribute::kUv && source.topology().texture.empty()) ||
           (IsOfMeasurement(attribute) && !source.topology().is_measured);
  });
  return attributes;
}

std::vector<std::string> MissingAttributes(const ExportRequest& request, const ExportSource& source) {
  const FormatTraits& traits = TraitsOf(request.format);
  const auto wanted = [&](ExportAttribute attribute) {
    const std::vector<ExportAttribute> all =
        request.has_attributes_named ? request.attributes : traits.ByDefault();
    return std::ranges::find(all, attribute) != all.end();
  };
  std::vector<std::string> notes;
  if (wanted(ExportAttribute::kVelocity) && source.fps() == 0)
    notes.emplace_back("Velocities are left out: nothing tells the frame rate; give it with --fps.");
  if (wanted(ExportAttribute::kUv) && source.topology().texture.empty())
    notes.emplace_back("Texture coordinates are left out: the template has none.");
  const bool wants_measurement = wanted(ExportAttribute::kState) || wanted(ExportAttribute::kSigma) ||
                                 wanted(ExportAttribute::kViews) || wanted(ExportAttribute::kCoverage);
  if (wants_measurement && !source.topology().is_measured)
    notes.emplace_back("States, sigmas, views and coverage are left out: the meshes were not measured.");
  return notes;
}

// A sample per mesh, and for formats with equidistant samples one per frame.
std::vector<ExportSample> SamplesOf(const ExportSource& source, const FormatTraits& traits) {
  std::vector<ExportSample> samples;
  size_t mesh = 0;
  for (size_t i = 0; i < source.frames().size(); ++i) {
    const v1::ExportedFrame& frame = source.frames()[i];
    const bool has_mesh = frame.missing_because().empty();
    if (has_mesh && i > 0) ++mesh;
    if (has_mesh || traits.repeats_gaps)
      samples.push_back(
          {mesh, frame.index(), frame.time_s(), source.frames()[source.meshes()[mesh]].frame()});
  }
  return samples;
}

v1::Export ManifestOf(const ExportRequest& request, const ExportSource& source, const ExportPlan& plan) {
  v1::Export manifest = source.Manifest();
  manifest.set_format(plan.traits.name);
  manifest.set_meshopt(plan.meshopt);
  manifest.set_max_vertices(request.max_vertices);
  manifest.set_texture_px(plan.texture_px);
  manifest.set_normal_map_px(plan.normal_map_px);
  if (plan.texture_px > 0)
    for (const size_t mesh : MeshesForTexture(source, request.texture_frames))
      manifest.add_texture_frames(source.frames()[source.meshes()[mesh]].frame());
  v1::ExportTransform& transform = *manifest.mutable_transform();
  for (int row = 0; row < 4; ++row)
    for (int col = 0; col < 4; ++col)
      transform.add_export_from_world(row < 3 && col < 3 ? source.transform().unit_per_mm *
                                                               source.transform().rotation(row, col)
                                                         : (row == col ? 1 : 0));
  transform.set_up(NameOf(source.transform().up));
  transform.set_unit(NameOf(source.transform().unit));
  for (const ExportAttribute attribute : plan.attributes) manifest.add_attributes(NameOf(attribute));
  for (v1::ExportedFrame& frame : *manifest.mutable_frames())
    if (plan.traits.file_per_frame && frame.missing_because().empty())
      frame.set_file(absl::StrCat(frame.frame(), ".", plan.traits.name));
  if (!plan.traits.file_per_frame) manifest.add_files(SequenceFile(plan.traits));
  if (IsPointCache(plan.traits)) manifest.add_files(kBaseMesh);
  for (const std::string& note : MissingAttributes(request, source)) manifest.add_notes(note);
  return manifest;
}

// The texture that an interrupted export left, else it is made anew.
absl::StatusOr<GlbPictures> PicturesOf(const ExportRequest& request, const ExportSource& source,
                                       const ExportFolder& folder, const ExportProgress& progress,
                                       const std::stop_token& stop, std::vector<std::string>& warnings) {
  GlbPictures pictures;
  if (request.texture_px > 0) {
    const std::string path = folder.UnfinishedOf(kAlbedo);
    WEFT_ASSIGN_OR_RETURN(pictures.albedo_png,
                          fs::exists(path)
                              ? ReadWholeFile(path)
                              : MakeSequenceTexture(request, source.InWorldMm(), progress, stop, warnings));
  }
  if (request.normal_map_px > 0) {
    WEFT_ASSIGN_OR_RETURN(const NormalMap map, MakeNormalMap(request.normal_map_px, source));
    ExportSource whole = source.InWorldMm();
    WEFT_ASSIGN_OR_RETURN(pictures.normal_png, NormalMapOfFrame(map, request.normal_map_px, whole, 0));
    WEFT_ASSIGN_OR_RETURN(pictures.tangents, TangentsOfFrame(map, whole, 0));
    const Eigen::Matrix3f rotation = source.transform().rotation.cast<float>();
    for (Eigen::Vector4f& tangent : pictures.tangents)
      tangent.head<3>() = (rotation * tangent.head<3>()).eval();
  }
  return pictures;
}

// Of a glb: whether the pictures asked for fit the mesh.
absl::Status CheckPictures(const ExportRequest& request, const ExportPlan& plan) {
  if (request.texture_px == 0 && request.normal_map_px == 0) return absl::OkStatus();
  const char* const option = request.texture_px > 0 ? "--texture" : "--normal-map";
  if (!plan.Has(ExportAttribute::kUv)) {
    return absl::InvalidArgumentError(
        plan.source.topology().texture.empty()
            ? absl::StrCat(option,
                           ": the meshes have no texture coordinates; register with a template that `weft "
                           "template build` made, or one with its board")
            : absl::StrCat("--attributes: ", option, " needs uv; add it, or leave ", option, " out"));
  }
  if (request.normal_map_px == 0 || plan.samples.size() == 1) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "--normal-map: has the folds of one frame, and a glb holds one map for its ", plan.samples.size(),
      " frames; choose one with --frames, or write a map for each with --format png"));
}

// One export, from its plan to its files.
class Exporter {
 public:
  Exporter(const ExportPlan& plan, const ExportFolder& folder, const ExportProgress& progress,
           const std::stop_token& stop)
      : plan_(plan), folder_(folder), progress_(progress), stop_(stop) {}

  // Files that are there are kept: they got their names when they were complete.
  absl::Status WriteFrames(FrameWriter& writer, const v1::Export& manifest) {
    for (size_t i = 0; i < plan_.samples.size(); ++i) {
      if (stop_.stop_requested()) return StoppedAfter(i, plan_.samples.size());
      const std::string& name =
          manifest.frames(static_cast<int>(plan_.source.meshes()[plan_.samples[i].mesh])).file();
      if (!fs::exists(folder_.Of(name))) {
        WEFT_ASSIGN_OR_RETURN(
            const ExportMesh mesh,
            plan_.source.Read(plan_.samples[i].mesh, plan_.Has(ExportAttribute::kVelocity)
                                                         ? ExportSource::Velocities::kComputed
                                                         : ExportSource::Velocities::kLeftOut));
        WEFT_ASSIGN_OR_RETURN(const std::string file, writer.FileOf(mesh));
        WEFT_RETURN_IF_ERROR(WriteFileAtomically(folder_.Of(name), file));
      }
      if (progress_) progress_(ExportStep::kWrite, i + 1, plan_.samples.size());
    }
    return absl::OkStatus();
  }

  absl::Status WriteSequence(SequenceWriter& writer) {
    const std::string name = SequenceFile(plan_.traits);
    // It has its name already where the export was interrupted after that.
    if (fs::exists(folder_.Of(name))) return absl::OkStatus();
    const std::optional<v1::ExportCheckpoint> checkpoint = folder_.Checkpoint();
    WEFT_ASSIGN_OR_RETURN(ExportStream out, ExportStream::Open(folder_.UnfinishedOf(name),
                                                               checkpoint ? checkpoint->bytes() : 0));
    WEFT_RETURN_IF_ERROR(checkpoint ? writer.Restore({checkpoint->state().begin(), checkpoint->state().end()})
                                    : writer.Begin(out));
    if (checkpoint) at_ = *checkpoint;
    WEFT_RETURN_IF_ERROR(AddSamples(writer, out));
    WEFT_RETURN_IF_ERROR(writer.Finish(out));
    WEFT_RETURN_IF_ERROR(out.Sync());
    return folder_.Publish(name);
  }

  // The mesh that a point cache moves.
  absl::Status WriteBaseMesh() {
    if (fs::exists(folder_.Of(kBaseMesh))) return absl::OkStatus();
    WEFT_ASSIGN_OR_RETURN(const ExportMesh mesh,
                          plan_.source.Read(plan_.samples.front().mesh, ExportSource::Velocities::kLeftOut));
    WEFT_ASSIGN_OR_RETURN(const std::string file, MakeObjWriter(plan_)->FileOf(mesh));
    return WriteFileAtomically(folder_.Of(kBaseMesh), file);
  }

 private:
  absl::Status AddSamples(SequenceWriter& writer, ExportStream& out) {
    const size_t samples = plan_.samples.size(), all = samples * static_cast<size_t>(writer.passes());
    auto saved = std::chrono::steady_clock::now();
    for (size_t done = static_cast<size_t>(at_.pass()) * samples + static_cast<size_t>(at_.samples());
         done < all; ++done) {
      const int pass = static_cast<int>(done / samples);
      const size_t sample = done % samples;
      WEFT_ASSIGN_OR_RETURN(
          const ExportMesh mesh,
          plan_.source.Read(plan_.samples[sample].mesh, writer.NeedsVelocities(pass)
                                                            ? ExportSource::Velocities::kComputed
                                                            : ExportSource::Velocities::kLeftOut));
      WEFT_RETURN_IF_ERROR(writer.Add(pass, sample, mesh, out));
      if (progress_) progress_(ExportStep::kWrite, done + 1, all);
      const auto now = std::chrono::steady_clock::now();
      const bool stopped = stop_.stop_requested() && done + 1 < all;
      if (!stopped && now - saved < kBetweenCheckpoints) continue;
      saved = now;
      WEFT_RETURN_IF_ERROR(Save(done + 1, samples, writer, out));
      if (stopped) return StoppedAfter((done + 1) / static_cast<size_t>(writer.passes()), samples);
    }
    return absl::OkStatus();
  }

  absl::Status Save(size_t done, size_t samples, const SequenceWriter& writer, ExportStream& out) {
    WEFT_RETURN_IF_ERROR(out.Sync());
    at_.set_pass(static_cast<int>(done / samples));
    at_.set_samples(static_cast<int>(done % samples));
    at_.set_bytes(out.size());
    const std::vector<double> state = writer.State();
    *at_.mutable_state() = {state.begin(), state.end()};
    return folder_.WriteCheckpoint(at_);
  }

  const ExportPlan& plan_;
  const ExportFolder& folder_;
  const ExportProgress& progress_;
  const std::stop_token& stop_;
  v1::ExportCheckpoint at_;
};

}  // namespace

bool ExportPlan::Has(ExportAttribute attribute) const {
  return std::ranges::find(attributes, attribute) != attributes.end();
}

absl::StatusOr<ExportOutcome> ExportResult(const ExportRequest& request, const ExportProgress& progress,
                                           const std::stop_token& stop) {
  WEFT_ASSIGN_OR_RETURN(ExportSource source, ExportSource::Open(request));
  WEFT_RETURN_IF_ERROR(source.Survey(progress, stop));
  const FormatTraits& traits = TraitsOf(request.format);
  ExportPlan plan{source,
                  traits,
                  AttributesOf(request, source),
                  SamplesOf(source, traits),
                  request.meshopt,
                  request.texture_px,
                  request.normal_map_px};
  WEFT_RETURN_IF_ERROR(CheckPictures(request, plan));
  ExportOutcome outcome{ManifestOf(request, source, plan)};
  std::unique_ptr<FrameWriter> frames;
  std::unique_ptr<SequenceWriter> sequence;
  uint64_t needed_bytes = 0;
  if (traits.file_per_frame) {
    frames = MakeFrameWriter(plan);
    needed_bytes = frames->MaxFileBytes() * plan.samples.size();
  } else {
    sequence = MakeSequenceWriter(plan);
    needed_bytes = sequence->MaxFileBytes();
    if (const size_t vertices = sequence->VerticesInFile(plan); vertices != source.topology().vertices)
      outcome.manifest.set_vertices_in_file(static_cast<int>(vertices));
    if (IsPointCache(traits)) needed_bytes += MakeObjWriter(plan)->MaxFileBytes();
  }
  const ExportFolder folder(request.out);
  WEFT_ASSIGN_OR_RETURN(const ExportFolder::Holds holds, folder.Compare(outcome.manifest));
  outcome.was_complete = holds == ExportFolder::Holds::kAll;
  if (outcome.was_complete) return outcome;
  folder.RemoveLeftovers(outcome.manifest);
  uint64_t present_bytes = 0;
  if (holds == ExportFolder::Holds::kPart) {
    present_bytes +=
        FileBytes(folder.UnfinishedOf(SequenceFile(traits))) + FileBytes(folder.Of(SequenceFile(traits)));
    for (const v1::ExportedFrame& frame : outcome.manifest.frames())
      if (!frame.file().empty()) present_bytes += FileBytes(folder.Of(frame.file()));
  }
  WEFT_RETURN_IF_ERROR(folder.CheckRoom(needed_bytes, present_bytes));
  if (plan.texture_px > 0 || plan.normal_map_px > 0) {
    WEFT_ASSIGN_OR_RETURN(plan.pictures,
                          PicturesOf(request, source, folder, progress, stop, outcome.warnings));
  }
  if (holds == ExportFolder::Holds::kNothing) WEFT_RETURN_IF_ERROR(folder.Begin(outcome.manifest));
  if (plan.texture_px > 0)
    WEFT_RETURN_IF_ERROR(WriteFileAtomically(folder.UnfinishedOf(kAlbedo), plan.pictures.albedo_png));
  Exporter exporter(plan, folder, progress, stop);
  WEFT_RETURN_IF_ERROR(frames ? exporter.WriteFrames(*frames, outcome.manifest)
                              : exporter.WriteSequence(*sequence));
  if (IsPointCache(traits)) WEFT_RETURN_IF_ERROR(exporter.WriteBaseMesh());
  WEFT_RETURN_IF_ERROR(folder.Finish(outcome.manifest));
  return outcome;
}

}  // namespace weft
