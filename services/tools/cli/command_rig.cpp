// weft rig: the calibrated cameras.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/length_unit.h"
#include "base/named_status.h"
#include "base/path_facts.h"
#include "capture/rig/colmap_text.h"
#include "capture/rig/foreign_rig.h"
#include "capture/rig/krt.h"
#include "capture/rig/opencv_yaml.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/text_file.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/output_guard.h"

namespace weft {
namespace {

constexpr uint64_t kMaxTextBytes = 64 << 20;

struct RigImportOptions {
  std::string krt, opencv, colmap;
  int width_px = 0;
  int height_px = 0;
  double mm_per_unit = 1;
  std::string unit;
  std::string poses;
  bool judge_unit = true;
  std::string id;
  std::string out;
  OutputGuard guard;
};

constexpr char kWorldFromCamera[] = "world_from_camera";

std::string SourceOf(const RigImportOptions& options) {
  if (!options.krt.empty()) return options.krt;
  return options.opencv.empty() ? options.colmap : options.opencv;
}

absl::StatusOr<ForeignRig> ReadColmap(const std::string& folder) {
  namespace fs = std::filesystem;
  const absl::StatusOr<std::string> cameras =
      ReadTextFile((fs::path(folder) / "cameras.txt").string(), kMaxTextBytes);
  if (absl::IsNotFound(cameras.status()) && PathExists(fs::path(folder) / "cameras.bin")) {
    return absl::InvalidArgumentError(
        absl::StrCat(folder, ": is COLMAP's binary model; make text of it with `colmap model_converter ",
                     "--input_path ", folder, " --output_path TEXT --output_type TXT`"));
  }
  const absl::StatusOr<std::string> images =
      ReadTextFile((fs::path(folder) / "images.txt").string(), kMaxTextBytes);
  if (!cameras.ok()) return cameras.status();
  if (!images.ok()) return images.status();
  return ParseColmapText(*cameras, *images, folder);
}

absl::StatusOr<ForeignRig> ReadForeignRig(const RigImportOptions& options) {
  if (!options.colmap.empty()) return ReadColmap(options.colmap);
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadTextFile(SourceOf(options), kMaxTextBytes));
  if (!options.opencv.empty()) return ParseOpenCvYaml(text, options.opencv);
  if (options.width_px == 0 || options.height_px == 0) {
    return absl::InvalidArgumentError(
        "KRT does not carry the size of the images: --width-px and --height-px are needed");
  }
  WEFT_ASSIGN_OR_RETURN(Rig rig, ParseKrt(text, options.krt, options.width_px, options.height_px));
  return ForeignRig{std::move(rig), {}};
}

// A rig that was imported can be imported again, one that was calibrated can not.
absl::Status MayWriteRig(const std::string& file, const Rig& rig, const OutputGuard& guard) {
  const absl::StatusOr<std::optional<CalibrationRecord>> record = ReadCalibrationRecord(file);
  if (!record.ok() || !*record) return absl::OkStatus();
  const absl::StatusOr<Rig> before = ReadRig(file);
  if (before.ok() && before->ContentHash() == rig.ContentHash()) return absl::OkStatus();
  return guard.MayReplace(file, "a calibrated rig");
}

absl::Status ImportRig(const RigImportOptions& options) {
  WEFT_ASSIGN_OR_RETURN(ForeignRig foreign, ReadForeignRig(options));
  const std::string from = SourceOf(options);
  const double mm_per_unit =
      options.unit.empty() ? options.mm_per_unit : LengthUnitNamed(options.unit).value().mm;
  ApplyConvention({mm_per_unit, options.poses == kWorldFromCamera}, &foreign.rig);
  absl::Status status =
      JudgeRig({.judge_unit = options.judge_unit, .judge_poses = options.poses.empty()}, &foreign);
  if (!status.ok()) return Naming(from, status);
  Rig& rig = foreign.rig;
  rig.id = options.id;
  WEFT_RETURN_IF_ERROR(MayWriteRig(options.out, rig, options.guard));
  WEFT_RETURN_IF_ERROR(WriteRig(
      options.out, rig, absl::StrCat("imported from ", std::filesystem::path(from).filename().string())));
  for (const std::string& remark : foreign.remarks) PrintWarning(absl::StrCat(from, ": ", remark));
  const CameraModel& first = rig.cameras[0];
  std::printf("%s: %zu cameras, %dx%d px, hash %s\n", options.out.c_str(), rig.cameras.size(), first.width_px,
              first.height_px, rig.ContentHash().c_str());
  return absl::OkStatus();
}

void AddImportCommand(CLI::App& rig, CommandLine& line) {
  CLI::App* command =
      AddCommand(rig, "import",
                 "Turn the calibration of another program into a rig.json: a KRT text (per camera: id, K, "
                 "distortion k1 k2 p1 p2 k3, [R|t] camera_from_world in mm; the size of the images is given "
                 "here), OpenCV's YAML or JSON, ROS's camera_info, Kalibr's camchain, or a folder with "
                 "COLMAP's cameras.txt and images.txt. Fisheye lenses are fitted by Weft's.",
                 "  weft rig import --krt KRT --width-px 2668 --height-px 4096 --out rig.json\n"
                 "  weft rig import --opencv cameras.yml --out rig.json\n"
                 "  weft rig import --colmap sparse --unit m --out rig.json");
  auto options = std::make_shared<RigImportOptions>();
  CLI::Option_group* from = command->add_option_group("From", "One of them");
  AddOption(*from, "--krt FILE", options->krt, "A KRT file");
  AddOption(*from, "--opencv FILE", options->opencv, "OpenCV's YAML or JSON, or the YAML of ROS or Kalibr");
  AddOption(*from, "--colmap DIR", options->colmap, "Folder of COLMAP's text model");
  from->require_option(1);
  AddOption(*command, "--width-px PX", options->width_px, "Width of every camera's images, for KRT",
            CLI::Range(1, 65536));
  AddOption(*command, "--height-px PX", options->height_px, "Height of every camera's images, for KRT",
            CLI::Range(1, 65536));
  CLI::Option* unit = AddOption(*command, "--mm-per-unit MM", options->mm_per_unit,
                                "What lengths in the file are to be multiplied by, 1000 for metres. Without "
                                "it they are taken as mm, and a rig that is smaller than a camera is refused",
                                CLI::Range(1e-6, 1e9));
  CLI::Option* unit_name = AddOption(*command, "--unit UNIT", options->unit,
                                     "The same by the name of the unit: mm, cm, m, in or ft", OneLengthUnit())
                               ->excludes(unit);
  AddOption(*command, "--poses KIND", options->poses,
            "What the poses in the file are. Without it they are taken as camera_from_world, and a rig whose "
            "cameras look away from each other is refused where another reading fits",
            CLI::IsMember({"camera_from_world", kWorldFromCamera}));
  AddOption(*command, "--id NAME", options->id, "Name of the rig, kept in the file");
  AddRequired(*command, "--out FILE", options->out, "The rig.json to write");
  options->guard.AddTo(*command);
  command->callback([options, unit, unit_name, &line] {
    options->judge_unit = unit->count() == 0 && unit_name->count() == 0;
    line.run = [options] { return ImportRig(*options); };
  });
}

struct ExportOptions {
  std::string rig;
  std::string format;
  std::string out;
};

absl::Status ExportRig(const ExportOptions& options) {
  namespace fs = std::filesystem;
  WEFT_ASSIGN_OR_RETURN(const Rig rig, ReadRig(options.rig));
  absl::Status status;
  if (options.format == "colmap") {
    WEFT_ASSIGN_OR_RETURN(const ColmapText text, FormatColmapText(rig));
    status = CreateFolders(options.out);
    status.Update(WriteFileAtomically((fs::path(options.out) / "cameras.txt").string(), text.cameras));
    status.Update(WriteFileAtomically((fs::path(options.out) / "images.txt").string(), text.images));
    status.Update(WriteFileAtomically((fs::path(options.out) / "points3D.txt").string(), ""));
  } else {
    WEFT_ASSIGN_OR_RETURN(const std::string text,
                          options.format == "krt" ? FormatKrt(rig) : FormatOpenCvYaml(rig));
    status = WriteFileAtomically(options.out, text);
  }
  if (status.ok()) std::printf("%s: %zu cameras\n", options.out.c_str(), rig.cameras.size());
  return status;
}

void AddRigExportCommand(CLI::App& rig, CommandLine& line) {
  const auto [command, options] =
      AddCommand<ExportOptions>(rig, line, ExportRig, "export",
                                "Write a rig.json for other programs: KRT, OpenCV's YAML, or COLMAP's text "
                                "model (a folder, FULL_OPENCV cameras, lengths in mm).",
                                "  weft rig export rig.json --format opencv --out cameras.yml\n"
                                "  weft rig export rig.json --format colmap --out sparse");
  AddRequired(*command, "rig FILE", options->rig, "The rig.json");
  AddRequired(*command, "--format FORMAT", options->format, "krt, opencv or colmap")
      ->check(OneOf({"krt", "opencv", "colmap"}));
  AddRequired(*command, "--out PATH", options->out, "File, or folder for colmap");
}

}  // namespace

void AddRigCommand(CLI::App& app, CommandLine& line) {
  CLI::App* rig =
      AddGroup(app, "rig", "Make, convert or choose a rig.json: the calibrated cameras of a studio");

  AddImportCommand(*rig, line);
  AddRigExportCommand(*rig, line);
  AddRigCalibrateCommands(*rig, line);
  AddRigPlanCommand(*rig, line);
  AddRigRefineCommand(*rig, line);
  AddRigExchangeCommand(*rig, line);
}

}  // namespace weft
