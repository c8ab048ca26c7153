// weft align: from a cloud to a registered mesh.
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>

#include "absl/strings/str_cat.h"
#include "alignment/align.h"
#include "alignment/self_intersection.h"
#include "services/cli/commands.h"
#include "services/files/cloud_file.h"
#include "services/files/json_file.h"
#include "services/files/mesh_file.h"
#include "services/files/scan_file.h"
#include "services/files/template_file.h"
#include "services/pipeline/presets.h"
#include "services/pipeline/stage_reports.h"
#include "weft/v1/command.pb.h"

namespace weft {
namespace {

struct AlignCommandOptions {
  std::string cloud;
  std::string garment;
  std::string out;
  std::string preset = "best";
  std::string scan;
  int threads = 0;
  bool json = false;
};

v1::AlignReport Describe(const AlignCommandOptions& options, const AlignResult& result,
                         const Template& garment, const CloudTargets& targets, double align_ms) {
  v1::AlignReport report;
  report.set_mesh_file(options.out);
  report.set_preset(options.preset);
  DescribeAlignment(result, garment, targets.unclaimed, *report.mutable_mesh());
  report.set_targets(static_cast<int>(targets.targets.size()));
  report.set_outliers(result.outliers);
  report.set_inferred(report.mesh().vertices() - report.mesh().observed());
  report.set_self_intersections(
      static_cast<int>(FindSelfIntersections(result.mesh.vertices_mm, garment.rest.faces).size()));
  report.set_align_ms(align_ms);
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
  std::printf("%s: written\n", report.mesh_file().c_str());
}

absl::Status AlignCloud(const AlignCommandOptions& options, bool quiet) {
  const absl::StatusOr<AlignOptions> preset = PresetByName(options.preset);
  if (!preset.ok()) return preset.status();
  const absl::StatusOr<Template> garment = ReadTemplate(options.garment);
  if (!garment.ok()) return garment.status();
  const absl::StatusOr<CloudTargets> targets = ReadTargets(options.cloud, *garment);
  if (!targets.ok()) return targets.status();
  if (!quiet && static_cast<size_t>(targets->unclaimed) > targets->targets.size()) {
    PrintWarning(absl::StrCat(options.cloud, ": ", targets->unclaimed,
                              " points have no vertex in the template and ", targets->targets.size(),
                              " have one; is it the template of this garment?"));
  }
  const auto threads = options.threads > 0 ? options.threads : tbb::info::default_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
  absl::StatusOr<Scan> scan = Scan();
  if (!options.scan.empty()) scan = ReadScan(options.scan);
  if (!scan.ok()) return scan.status();
  const AlignContext context{.scan = options.scan.empty() ? nullptr : &*scan};
  const auto start = std::chrono::steady_clock::now();
  const absl::StatusOr<AlignResult> result = Align(*garment, targets->targets, *preset, context);
  if (!result.ok()) {
    return absl::Status(result.status().code(), absl::StrCat(options.cloud, ": ", result.status().message()));
  }
  const double align_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  if (absl::Status status = WriteRegisteredMesh(options.out, result->mesh, garment->rest.faces); !status.ok())
    return status;
  const v1::AlignReport report = Describe(options, *result, *garment, *targets, align_ms);
  if (!options.json) {
    PrintReport(report);
    return absl::OkStatus();
  }
  const absl::StatusOr<std::string> json = ToJson(report);
  if (!json.ok()) return json.status();
  std::fputs(json->c_str(), stdout);
  return absl::OkStatus();
}

}  // namespace

void AddAlignCommand(CLI::App& app, CommandLine& line) {
  CLI::App* command =
      AddCommand(app, "align",
                 "Register a template to one cloud and write the registered mesh. The cloud's points name "
                 "their vertex by board "
                 "cell (board_row, board_col), or by the property template_vertex (-1 for none).",
                 "  weft align result/0000/cloud.ply --template shirt --out mesh.ply\n"
                 "  weft align cloud.ply --template shirt --out mesh.ply --preset paper --json");
  auto options = std::make_shared<AlignCommandOptions>();
  command->add_option("CLOUD", options->cloud, "The cloud: a PLY file")->required()->type_name("");
  command->add_option("--template", options->garment, "Folder that `weft template import` wrote")
      ->required()
      ->type_name("DIR");
  command->add_option("--out", options->out, "The mesh.ply to write")->required()->type_name("FILE");
  command
      ->add_option("--preset", options->preset,
                   "best: least error on hidden cloth; paper: the paper's weights")
      ->type_name("NAME");
  command
      ->add_option(
          "--scan", options->scan,
          "A scan of the same moment by any other method, PLY or PCD in mm: evidence for cloth that the "
          "cloud does not show")
      ->type_name("FILE");
  command->add_option("--threads", options->threads, "Threads to use; 0 for all cores")
      ->type_name("N")
      ->check(CLI::Range(0, 4096));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.AlignReport)");
  command->callback(
      [options, &line] { line.run = [options, &line] { return AlignCloud(*options, line.quiet); }; });
}

}  // namespace weft
