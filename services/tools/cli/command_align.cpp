// weft align: from a cloud to a registered mesh.
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "alignment/align.h"
#include "alignment/mesh_texture.h"
#include "alignment/start_mesh.h"
#include "alignment/untangle/self_intersection.h"
#include "base/named_status.h"
#include "base/stopwatch.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/obj_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/options/presets.h"
#include "services/formats/pcd/pcd_file.h"
#include "services/formats/pcd/scan_file.h"
#include "services/formats/verdict/limits.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/pipeline_flags.h"
#include "services/work/pipeline/stage_reports.h"
#include "weft/v1/command.pb.h"

namespace weft {
namespace {

constexpr double kClothScaleSaid = 0.05;

struct AlignCommandOptions {
  std::string cloud;
  std::string garment;
  std::string out;
  std::string preset = kDefaultPreset;
  PipelineFlags pipeline;
  std::string scan;
  std::string start;
  std::string stages;
  int threads = 0;
  bool json = false;
};

// What the command line names besides the cloud.
struct Extras {
  ScanFile scan;
  std::vector<Eigen::Vector3d> start_mm;
};

// Pairs of faces; where they were removed, as they will be stored.
int SelfIntersections(const AlignResult& result, const Template& garment, const AlignOptions& options) {
  if (options.remove_self_intersections) return result.untangling.pairs_after;
  return static_cast<int>(FindSelfIntersections(result.mesh.vertices_mm, garment.rest.faces).size());
}

v1::AlignReport Describe(const AlignCommandOptions& options, const AlignResult& result,
                         const Template& garment, const CloudTargets& targets, const ScanFile& scan) {
  v1::AlignReport report;
  report.set_mesh_file(options.out);
  report.set_preset(options.preset);
  DescribeAlignment(result, garment, targets.unclaimed, *report.mutable_mesh());
  if (!options.scan.empty()) DescribeScan(scan, result.scan, *report.mutable_mesh()->mutable_scan());
  report.set_targets(static_cast<int>(targets.targets.size()));
  report.set_outliers(result.outliers);
  report.set_inferred(report.mesh().vertices() - report.mesh().observed());
  return report;
}

void PrintReport(const v1::AlignReport& report) {
  std::printf("%-16s  %10s  %14s  %14s  %8s\n", "stage", "iterations", "energy before", "energy after", "ms");
  for (const v1::AlignmentStage& stage : report.mesh().stages()) {
    if (stage.iterations() == 0) {  // solved in one go, without an energy
      std::printf("%-16s  %10s  %14s  %14s  %8.1f\n", stage.name().c_str(), "-", "-", "-", stage.time_ms());
    } else {
      std::printf("%-16s  %10d  %14.6g  %14.6g  %8.1f\n", stage.name().c_str(), stage.iterations(),
                  stage.energy_before(), stage.energy_after(), stage.time_ms());
    }
  }
  std::printf("%-16s  %10s  %14s  %14s  %8.1f\n", "total", "", "", "", report.align_ms());
  std::printf("targets: %d, of them outliers %d; points without a vertex: %d\n", report.targets(),
              report.outliers(), report.mesh().unclaimed_points());
  std::printf("vertices: %d, observed %d, inferred %d; self-intersecting pairs of faces: %d\n",
              report.mesh().vertices(), report.mesh().observed(), report.inferred(),
              report.self_intersections());
  if (report.mesh().rays() > 0)
    std::printf("rays of cells without a point that the mesh follows: %d\n", report.mesh().rays());
  if (report.mesh().has_scan()) std::printf("scan: %s\n", ScanText(report.mesh().scan()).c_str());
  if (report.mesh().demoted() > 0) {
    std::printf("observed vertices moved to undo a self-intersection, now inferred: %d\n",
                report.mesh().demoted());
  }
  std::printf("%s: written\n", report.mesh_file().c_str());
}

// Writes the vertices after each stage to <folder>/<number>_<stage>.ply and keeps the first error.
class StageWriter {
 public:
  StageWriter(const std::string& folder, const Template& garment) : folder_(folder), garment_(garment) {}

  void Write(const std::string& stage, const std::vector<Eigen::Vector3d>& vertices_mm) {
    if (status_.ok() && count_ == 0) status_ = CreateFolders(folder_);
    if (!status_.ok()) return;
    const std::string name = absl::StrFormat("%s/%02d_%s.ply", folder_, ++count_, stage);
    status_ = WriteMesh(name, {vertices_mm, garment_.rest.faces});
  }

  const absl::Status& status() const { return status_; }

 private:
  const std::string& folder_;
  const Template& garment_;
  int count_ = 0;
  absl::Status status_;
};

absl::StatusOr<Extras> ReadExtras(const AlignCommandOptions& options, const Template& garment) {
  Extras extras;
  if (!options.scan.empty()) {
    WEFT_ASSIGN_OR_RETURN(extras.scan, ReadScan(options.scan));
  }
  if (!options.start.empty()) {
    WEFT_ASSIGN_OR_RETURN(TriangleMesh start, ReadForeignMesh(options.start));
    if (absl::Status status = CheckStartMesh(start, garment.rest); !status.ok())
      return Naming(options.start, status);
    extras.start_mm = std::move(start.vertices_mm);
  }
  return extras;
}

absl::StatusOr<CloudTargets> ReadCloudTargets(const std::string& cloud, const Template& garment) {
  WEFT_ASSIGN_OR_RETURN(const Points points, ReadPoints(cloud));
  if (points.unmeasured > 0)
    PrintWarning(
        absl::StrCat(cloud, ": ", points.unmeasured, " points have no measurement and are left out"));
  return TargetsFromPly(points.ply, cloud, garment);
}

// What of template and start did not lie as the cloud does.
void WarnOfPlaces(const AlignCommandOptions& options, const AlignResult& result) {
  if (result.start_turned_deg > 0) {
    PrintWarning(absl::StrFormat("%s: is turned by %.0f degrees against the cloud, and was turned back",
                                 options.start, result.start_turned_deg));
  }
  if (const double off = result.cloth_scale - 1; result.cloth_scale > 0 && std::abs(off) > kClothScaleSaid) {
    PrintWarning(absl::StrFormat("%s: the cloth is %.1f %% %s than the template; is it of the right size?",
                                 options.cloud, 100 * std::abs(off), off > 0 ? "longer" : "shorter"));
  }
}

// Points of a scan that lies elsewhere meet the cloth by chance: few of them, or at any distance. Limits are
// those of registrations.
void WarnOfScan(const std::string& path, const v1::ScanReport& scan) {
  const double found = scan.points() > 0 ? 100.0 * scan.found() / scan.points() : 0;
  const bool is_near = scan.median_distance_mm() <= kRegisterScanDistance.good;
  if (found >= kRegisterScanPoints.good && is_near) return;
  const std::string how = scan.found() == 0
                              ? "no point of it lies on the cloth, so it says nothing"
                              : absl::StrFormat(
                                    "%d of its %d points found the cloth (%.2g %%), %.2f mm from it in the "
                                    "median, as they do by chance where a scan lies elsewhere",
                                    scan.found(), scan.points(), found, scan.median_distance_mm());
  PrintWarning(
      absl::StrCat(path, ": ", how, "; is it in mm, in the rig's world with its axes, and of this moment?"));
}

absl::Status AlignCloud(const AlignCommandOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const CommandPipeline pipeline,
                        MakeCommandPipeline(options.preset, options.pipeline, {"alignment"}));
  WEFT_ASSIGN_OR_RETURN(const Template garment, ReadTemplate(options.garment));
  WEFT_ASSIGN_OR_RETURN(const GarmentParts parts, ReadGarmentParts(options.garment));
  WEFT_ASSIGN_OR_RETURN(const CloudTargets targets, ReadCloudTargets(options.cloud, garment));
  if (!quiet && static_cast<size_t>(targets.unclaimed) > targets.targets.size()) {
    PrintWarning(absl::StrCat(options.cloud, ": ", targets.unclaimed,
                              " points have no vertex in the template and ", targets.targets.size(),
                              " have one; is it the template of this garment?"));
  }
  const auto threads = options.threads > 0 ? options.threads : tbb::info::default_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
  WEFT_ASSIGN_OR_RETURN(const Extras extras, ReadExtras(options, garment));
  StageWriter stages(options.stages, garment);
  AlignContext context{.rays = &targets.rays,
                       .scan = options.scan.empty() ? nullptr : &extras.scan.scan,
                       .start_mm = options.start.empty() ? nullptr : &extras.start_mm};
  if (!options.stages.empty()) context.watch = std::bind_front(&StageWriter::Write, &stages);
  const Stopwatch watch;
  const absl::StatusOr<AlignResult> result =
      Align(garment, targets.targets, pipeline.options.alignment, context);
  if (!result.ok()) {
    // What is wrong with the scan names its file.
    if (!options.scan.empty() && absl::StartsWith(result.status().message(), options.scan))
      return result.status();
    return Naming(options.cloud, result.status());
  }
  if (!stages.status().ok()) return stages.status();
  if (!quiet) WarnOfPlaces(options, *result);
  const double align_ms = watch.Ms();
  WEFT_RETURN_IF_ERROR(
      WriteRegisteredMesh(options.out, result->mesh, garment.rest.faces, TextureOf(garment, parts)));
  v1::AlignReport report = Describe(options, *result, garment, targets, extras.scan);
  report.set_self_intersections(SelfIntersections(*result, garment, pipeline.options.alignment));
  report.set_align_ms(align_ms);
  *report.mutable_options() = pipeline.message;
  if (!options.scan.empty()) WarnOfScan(options.scan, report.mesh().scan());
  if (options.json) return PrintJsonMessage(report);
  PrintReport(report);
  return absl::OkStatus();
}

}  // namespace

void AddAlignCommand(CLI::App& app, CommandLine& line) {
  CLI::App* command = AddCommand(
      app, "align",
      "Register a template to one cloud and write the registered mesh. The cloud's points name their vertex "
      "by board cell (board_row, board_col), or by the property template_vertex (-1 for none).",
      "  weft align result/0000/cloud.ply --template shirt --out mesh.ply\n"
      "  weft align cloud.ply --template shirt --out mesh.ply --preset paper --json\n"
      "  weft align cloud.ply --template shirt --out mesh.ply --start before.ply --stages stages");
  auto options = std::make_shared<AlignCommandOptions>();
  AddRequired(*command, "CLOUD", options->cloud, "The cloud: a PLY or PCD file");
  AddRequired(*command, "--template DIR", options->garment, "Folder that `weft template import` wrote");
  AddRequired(*command, "--out FILE", options->out, "The mesh.ply to write");
  AddOption(*command, "--preset NAME", options->preset,
            "best: least error on hidden cloth; paper: the paper's weights");
  AddOption(*command, "--scan FILE", options->scan,
            "A scan of the same moment by any other method, PLY or PCD in mm: evidence for cloth that the "
            "cloud does not show");
  AddOption(*command, "--start FILE", options->start,
            "A mesh of the template, PLY or OBJ in mm, from another moment or registration: vertices that "
            "the cloud does not show start from there instead of from a smooth fill");
  AddPipelineFlags(*command, options->pipeline);
  command->add_flag_callback(
      "--stretchy", [options] { options->pipeline.shorthands.emplace_back("alignment.stretch_rings=4"); },
      "For cloth that stretches by more than a few percent: hidden cloth is as long as the measured cloth "
      "around it, not as the template");
  AddOption(*command, "--stages DIR", options->stages,
            "Write the mesh after each stage, too: <number>_<stage>.ply in this folder");
  AddOption(*command, "--threads N", options->threads, "Threads to use; 0 for all cores",
            CLI::Range(0, 4096));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.AlignReport)");
  RunWith(*command, line, options, AlignCloud);
}

}  // namespace weft
