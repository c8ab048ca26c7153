// weft export: a job's result as files of other programs.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/results/export/export_overlays.h"
#include "services/results/export/export_result.h"
#include "services/results/export/export_textures.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/input_options.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/kind_options.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/remote_operation.h"

namespace weft {
namespace {

struct ExportCommandOptions {
  ExportRequest request;
  OverlayRequest overlays;
  TextureRequest textures;
  std::string format, up, unit = "m", attributes, overlay;
  bool json = false;
};

absl::StatusOr<ExportRequest> ExportRequestOf(const ExportCommandOptions& options) {
  ExportRequest request = options.request;
  WEFT_ASSIGN_OR_RETURN(request.format, ExportFormatFromName(options.format));
  if (!options.up.empty()) {
    WEFT_ASSIGN_OR_RETURN(request.up, UpAxisFromName(options.up));
  }
  WEFT_ASSIGN_OR_RETURN(request.unit, LengthUnitFromName(options.unit));
  request.texture_px = options.textures.texture_px;
  request.normal_map_px = options.textures.normal_map_px;
  request.max_vertices = options.textures.max_vertices;
  request.has_attributes_named = !options.attributes.empty();
  if (options.attributes == "none") return request;
  for (const absl::string_view name : absl::StrSplit(options.attributes, ',', absl::SkipEmpty())) {
    WEFT_ASSIGN_OR_RETURN(const ExportAttribute attribute,
                          ExportAttributeFromName({name.data(), name.size()}));
    request.attributes.push_back(attribute);
  }
  return request;
}

std::optional<PictureFormat> PictureFormatOf(const std::string& format) {
  for (const PictureFormat picture :
       {PictureFormat::kJpeg, PictureFormat::kPng, PictureFormat::kMp4, PictureFormat::kMkv})
    if (format == EndingOf(picture)) return picture;
  return std::nullopt;
}

absl::StatusOr<OverlayRequest> OverlayRequestOf(const ExportCommandOptions& options) {
  OverlayRequest request = options.overlays;
  const std::optional<PictureFormat> format = PictureFormatOf(options.format);
  if (!format)
    return absl::InvalidArgumentError("--overlay: needs --format jpg or png, or mp4 or mkv for videos");
  if (options.overlay.empty())
    return absl::InvalidArgumentError(
        absl::StrCat("--format ", options.format,
                     ": such pictures are the cameras' images; say with --overlay what is drawn over them: "
                     "wireframe, state, sigma or none"));
  WEFT_ASSIGN_OR_RETURN(request.kind, OverlayKindFromName(options.overlay));
  static_cast<ExportScope&>(request) = options.request;
  request.format = *format;
  return request;
}

absl::StatusOr<TextureRequest> TextureRequestOf(const ExportCommandOptions& options) {
  if (options.format != "png") {
    return absl::InvalidArgumentError(
        "--texture, --normal-map: need --format png, which loses nothing and has transparency, or glb");
  }
  TextureRequest request = options.textures;
  static_cast<ExportScope&>(request) = options.request;
  return request;
}

std::string ExportSummaryText(const ExportCommandOptions& options, const ExportOutcome& outcome) {
  const v1::Export& manifest = outcome.manifest;
  int missing = 0, bridged = 0;
  for (const v1::ExportedFrame& frame : manifest.frames()) {
    missing += !frame.missing_because().empty();
    bridged += frame.bridged();
  }
  const char* const already = outcome.was_complete ? "; it was complete already" : "";
  if (manifest.overlay() == "texture" || manifest.overlay() == "normal map") {
    std::string text = absl::StrCat(options.request.out, ": ");
    if (manifest.texture_px() > 0) absl::StrAppend(&text, "textures of ", manifest.texture_px(), " px, ");
    if (manifest.normal_map_px() > 0)
      absl::StrAppend(&text, "normal maps of ", manifest.normal_map_px(), " px for ", manifest.vertices(),
                      " vertices, ");
    return absl::StrCat(text, manifest.frames_size() - missing, " frames", already);
  }
  if (!manifest.overlay().empty()) {
    const bool is_alone = options.overlay == "none", is_undistorted = options.overlays.undistort;
    return absl::StrFormat("%s: %s pictures of %d cameras%s, %d frames%s", options.request.out,
                           is_alone ? "the" : absl::StrCat(options.overlay, " over the"),
                           manifest.files_size() - (is_undistorted ? 1 : 0),
                           is_undistorted ? ", undistorted" : "", manifest.frames_size() - missing, already);
  }
  std::string text =
      absl::StrFormat("%s: %s, %d frames of %d vertices and %d faces, %s, %s up", options.request.out,
                      manifest.format(), manifest.frames_size() - missing, manifest.vertices(),
                      manifest.faces(), manifest.transform().unit(), manifest.transform().up());
  if (manifest.fps() > 0)
    absl::StrAppend(&text, absl::StrFormat(", %g frames/s (%s)", manifest.fps(), manifest.fps_source()));
  if (manifest.texture_px() > 0)
    absl::StrAppend(&text, ", with a texture of ", manifest.texture_px(), " px from ",
                    manifest.texture_frames_size(), " frames");
  if (manifest.normal_map_px() > 0)
    absl::StrAppend(&text, ", with a normal map of ", manifest.normal_map_px(), " px");
  if (bridged > 0) absl::StrAppend(&text, ", ", bridged, " bridged");
  if (missing > 0) absl::StrAppend(&text, ", ", missing, " without a mesh");
  return text + already;
}

absl::StatusOr<ExportOutcome> RunExport(const ExportCommandOptions& options, bool quiet) {
  const StopOnSignal stop;
  StageBars bars(quiet);
  const ExportProgress show = [&bars](ExportStep step, size_t done, size_t all) {
    bars.Set(step == ExportStep::kCheck     ? "check"
             : step == ExportStep::kTexture ? "texture"
                                            : "export",
             done, all);
  };
  const bool has_textures = options.textures.texture_px > 0 || options.textures.normal_map_px > 0;
  if (has_textures && PictureFormatOf(options.format)) {
    WEFT_ASSIGN_OR_RETURN(const TextureRequest textures, TextureRequestOf(options));
    return ExportTextures(textures, show, stop.token());
  }
  if (!options.overlay.empty() || PictureFormatOf(options.format)) {
    WEFT_ASSIGN_OR_RETURN(const OverlayRequest overlays, OverlayRequestOf(options));
    return ExportOverlays(overlays, show, stop.token());
  }
  WEFT_ASSIGN_OR_RETURN(const ExportRequest request, ExportRequestOf(options));
  return ExportResult(request, show, stop.token());
}

absl::Status ExportCommand(const ExportCommandOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const ExportOutcome outcome, RunExport(options, quiet));
  if (options.json) return PrintJsonMessage(outcome.manifest);
  std::vector<std::string> warnings = outcome.warnings;
  const auto& notes = outcome.manifest.notes();
  warnings.insert(warnings.end(), notes.begin(), notes.end());
  for (const std::string& warning : warnings)
    if (!quiet) PrintWarning(warning);
  absl::PrintF("%s\n", ExportSummaryText(options, outcome));
  return absl::OkStatus();
}

// The order is that of the help.
void AddExportOptions(CLI::App& command, ExportCommandOptions& options) {
  ExportRequest& request = options.request;
  RecordingChoice& recording = request.recording;
  KindOptions add(command, "export");
  add("mesh", request.mesh);
  add("up", options.up);
  add("world-up", request.world_up);
  add("unit", options.unit);
  add("fps", request.fps);
  add("attributes", options.attributes);
  add("max-vertices", options.textures.max_vertices);
  add("meshopt", request.meshopt);
  add("allow-unfinished", request.allow_unfinished);
  add("overlay", options.overlay);
  add("undistort", options.overlays.undistort);
  add("texture", options.textures.texture_px);
  add("normal-map", options.textures.normal_map_px);
  add("texture-frames", request.texture_frames);
  add("camera", recording.cameras);
  add("take", recording.dump);
  add("rig", recording.rig);
  command.get_option("--undistort")->needs("--overlay");
  for (const char* of_textures : {"--texture", "--normal-map"})
    command.get_option(of_textures)->excludes("--overlay");
}

}  // namespace

void AddExportCommand(CLI::App& app, CommandLine& line) {
  CLI::App* command = AddCommand(
      app, "export",
      absl::StrCat(
          "Write a job's result as files of other programs. Every frame has the same vertices and faces, in "
          "the template's order. Formats, with the axis that points up and the attributes that they carry:\n",
          FormatTable(),
          "Debian 12 has no libraries of Alembic and binary USD. A stopped export goes on when the command "
          "is repeated. export.json comes last; it has transform, frame rate, and the state of every frame "
          "(bridged, missing). With --overlay: pictures of cameras with the mesh over them, "
          "DIR/<camera>/<frame>.jpg, or videos, DIR/<camera>.mp4."),
      "  weft export result --format glb --out garment\n"
      "  weft export result --format ply --up z --frames 0010:0020 --out frames\n"
      "  weft export result --format glb --texture 2048 --meshopt --out web\n"
      "  weft export result --format glb --frames 0010 --max-vertices 2000 --texture 2048 --normal-map 2048 "
      "--out doll\n"
      "  weft export result --format npz --unit mm --fps 60 --out arrays\n"
      "  weft export result --format jpg --overlay state --camera c01 --out pictures\n"
      "  weft export result --format jpg --overlay none --undistort --out backgrounds\n"
      "  weft export result --format mp4 --overlay wireframe --fps 60 --out videos\n"
      "  weft export job:20260131-104500-1a2b3c4d --server 127.0.0.1:7411 --format usda --out usd");
  const auto options = std::make_shared<ExportCommandOptions>();
  KindOptions add(*command, "export");
  add("result", options->request.result);
  add("format", options->format);
  AddRequired(*command, "--out DIR", options->request.out, "Folder to write to, made where it is missing");
  AddFramesOption(*command, options->request.frames, "Which frames, all by default");
  AddExportOptions(*command, *options);
  command->add_flag("--json", options->json, "Print JSON (weft.v1.Export)");
  RunHereOrAtDaemon(*command, line, [options, &line] { return ExportCommand(*options, line.quiet); });
}

}  // namespace weft
