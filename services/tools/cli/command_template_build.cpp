// weft template build: a garment's template from recordings or clouds of it.
#include <tbb/task_arena.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "alignment/template_build/build_template.h"
#include "alignment/template_check.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/options/presets.h"
#include "services/formats/verdict/verdict.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/results/report/html_text.h"
#include "services/results/report/template_report.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/input_options.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/kind_options.h"
#include "services/tools/cli/output_guard.h"
#include "services/tools/cli/pipeline_flags.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/remote_operation.h"
#include "services/tools/cli/template_sources.h"
#include "services/tools/cli/template_summary.h"

namespace weft {
namespace {

struct BuildOptions {
  TemplateSourceFiles from;
  std::string out;
  double cell_mm = 0;
  int threads = 0;
  bool json = false;
  std::string id;
  PipelineFlags pipeline;
  OutputGuard guard;
};

std::string PanelNames(std::vector<int> panels) {
  for (int& panel : panels) ++panel;
  return absl::StrCat(panels.size() == 1 ? "panel " : "panels ", absl::StrJoin(panels, ", "));
}

void PrintBuilt(const BuildOptions& options, const BuiltTemplate& built) {
  const Template& garment = built.garment;
  absl::PrintF("surface  %s faces, hash %s\n", FormatCount(static_cast<int64_t>(garment.rest.faces.size())),
               garment.ContentHash());
  for (const Seam& seam : built.parts.seams) {
    absl::PrintF("seam     panel %d to panel %d, %.0f mm, %.1f mm wide\n", seam.panel_a + 1, seam.panel_b + 1,
                 seam.length_mm, seam.gap_mm);
  }
  for (const TemplateBorder& opening : built.parts.openings) {
    absl::PrintF("opening  %.0f mm, %s\n", opening.length_mm, PanelNames(opening.panels));
  }
  absl::PrintF("rest     edges within %.1f %% of the print (median), %.1f %% (95 of 100)\n",
               100 * built.strain.median, 100 * built.strain.p95);
  absl::PrintF("template %s/template.json\nreport   %s/report.html\n", options.out, options.out);
}

// Summary of what was built, with warnings and verdict.
absl::StatusOr<v1::TemplateSummary> SummaryOf(const BuiltTemplate& built) {
  WEFT_ASSIGN_OR_RETURN(v1::TemplateSummary summary, SummarizeTemplate(built.garment, built.parts));
  *summary.mutable_warnings() = {built.warnings.begin(), built.warnings.end()};
  *summary.mutable_verdict() = TemplateVerdict(summary);
  return summary;
}

absl::Status Build(BuildOptions options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(
      const CommandPipeline pipeline,
      MakeCommandPipeline(kDefaultPreset, options.pipeline, {"decode", "triangulation", "template_build"}));
  WEFT_RETURN_IF_ERROR(MayWriteTemplateFolder(options.out, options.guard));
  TemplateBuildOptions build = pipeline.options.template_build;
  build.id = options.id.empty() ? TemplateIdOf(options.out) : options.id;
  WEFT_ASSIGN_OR_RETURN(Board board, ReadBoard(options.from.board));
  if (options.cell_mm > 0) board.cell_mm = options.cell_mm;
  options.from.clouds_out = (std::filesystem::path(options.out) / "clouds").string();
  StopOnSignal stop;
  tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
  absl::StatusOr<TemplateSources> sources;
  arena.execute(
      [&] { sources = ReadTemplateSources(options.from, board, pipeline.options, quiet, stop.token()); });
  if (!sources.ok()) return sources.status();
  absl::StatusOr<BuiltTemplate> built = WithShareBar("build", quiet, options.threads, [&](const auto& tell) {
    return BuildTemplate(board, *sources, build, tell);
  });
  if (!built.ok()) return built.status();
  WEFT_RETURN_IF_ERROR(CheckTemplateMap(built->garment));
  for (const std::string& warning : built->warnings) PrintWarning(warning);
  std::vector<std::string> names;
  for (const std::string& path : sources->cloud_names) {
    names.push_back(std::filesystem::path(path).filename().string());
  }
  WEFT_RETURN_IF_ERROR(WriteTemplateWithParts(options.out, built->garment, built->parts,
                                              absl::StrCat("built from ", absl::StrJoin(names, ", "))));
  WEFT_ASSIGN_OR_RETURN(v1::TemplateSummary summary, SummaryOf(*built));
  WEFT_ASSIGN_OR_RETURN(
      const std::string report,
      MakeTemplateReport(*built, summary, {options.from.board, options.from.panels, sources->cloud_names}));
  WEFT_RETURN_IF_ERROR(
      WriteFileAtomically((std::filesystem::path(options.out) / "report.html").string(), report));
  *summary.mutable_options() = pipeline.message;
  if (options.json) {
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(summary));
  } else {
    PrintVerdict(summary.verdict());
    PrintBuilt(options, *built);
  }
  return VerdictStatus(summary.verdict());
}

}  // namespace

void AddTemplateBuildCommand(CLI::App& garment, CommandLine& line) {
  CLI::App* command = AddCommand(
      garment, "build",
      "Build a template from a recording of the garment, or from clouds of it, best of a person who stands "
      "with arms away from the body. Finds the panels on the board and the seams between them, sews, checks "
      "the openings, and lays the garment to rest in the pose of the cloud that shows most: "
      "DIR/template.json, DIR/mesh.ply and DIR/cells.txt (with --corners DIR/corners.txt), as `weft template "
      "import` writes them. Nothing but the clouds of a recording is written (DIR/clouds/, to try again with "
      "other options) when the garment is not what was expected.",
      "  weft template build TPOSE_DUMP --rig rig.json --board board.json --openings 4 --out shirt\n"
      "  weft template build shirt/clouds/*.ply --board board.json --openings 5 --out shirt\n"
      "  weft template build cloud.ply --board board.png --panels mask.png --openings 4 --out shirt");
  auto options = std::make_shared<BuildOptions>();
  TemplateSourceFiles& from = options->from;
  KindOptions add(*command, "template build");
  add("sources", from.sources);
  add("rig", from.rig);
  add("board", from.board);
  AddFramesOption(*command, from.frames, "Which frames of the dumps, all by default");
  AddMosaicOption(*command, from.mosaic);
  add("samples", from.samples);
  add("panels", from.panels);
  add("cell-mm", options->cell_mm);
  add("openings", options->pipeline, "template_build.openings");
  add("max-seam-gap-mm", options->pipeline, "template_build.seams.max_gap_mm");
  add("max-hole-mm", options->pipeline, "template_build.max_hole_mm");
  add("allow-open-seams", options->pipeline, "template_build.allow_open_seams");
  add("corners", options->pipeline, "template_build.corners");
  AddPipelineFlags(*command, options->pipeline);
  AddRequired(*command, "--out DIR", options->out, "Folder to write to");
  options->guard.AddTo(*command);
  add("id", options->id);
  AddOption(*command, "--threads N", options->threads, "Threads; 0 takes all cores", CLI::Range(0, 1024));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.TemplateSummary)");
  RunHereOrAtDaemon(*command, line, [options, &line] { return Build(*options, line.quiet); });
}

}  // namespace weft
