// weft rig: the calibrated cameras.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "absl/strings/str_cat.h"
#include "capture/krt.h"
#include "services/cli/commands.h"
#include "services/files/atomic_file.h"
#include "services/files/rig_file.h"

namespace weft {
namespace {

struct ImportOptions {
  std::string krt;
  int width_px = 0;
  int height_px = 0;
  std::string id;
  std::string out;
};

absl::Status Import(const ImportOptions& options) {
  constexpr uint64_t kMaxKrtBytes = 64 << 20;
  const absl::StatusOr<std::string> text = ReadWholeFile(options.krt, kMaxKrtBytes);
  if (!text.ok()) return text.status();
  absl::StatusOr<Rig> rig = ParseKrt(*text, options.krt, options.width_px, options.height_px);
  if (!rig.ok()) return rig.status();
  rig->id = options.id;
  if (absl::Status status =
          WriteRig(options.out, *rig,
                   absl::StrCat("imported from ", std::filesystem::path(options.krt).filename().string()));
      !status.ok()) {
    return status;
  }
  std::printf("%s: %zu cameras, %dx%d px, hash %s\n", options.out.c_str(), rig->cameras.size(),
              options.width_px, options.height_px, rig->ContentHash().c_str());
  return absl::OkStatus();
}

}  // namespace

void AddRigCommand(CLI::App& app, CommandLine& line) {
  CLI::App* rig = AddCommand(app, "rig", "Make or choose a rig.json: the calibrated cameras of a studio", "");
  rig->require_subcommand(1);

  CLI::App* command = AddCommand(
      *rig, "import",
      "Turn a KRT text (per camera: id, K, distortion k1 k2 p1 p2 k3, [R|t] camera_from_world in mm) into a "
      "rig.json. KRT does not carry the size of the images, so it is given here.",
      "  weft rig import --krt KRT --width-px 2668 --height-px 4096 --out rig.json");
  auto options = std::make_shared<ImportOptions>();
  command->add_option("--krt", options->krt, "The KRT file")->required()->type_name("FILE");
  command->add_option("--width-px", options->width_px, "Width of every camera's images")
      ->required()
      ->type_name("PX")
      ->check(CLI::Range(1, 65536));
  command->add_option("--height-px", options->height_px, "Height of every camera's images")
      ->required()
      ->type_name("PX")
      ->check(CLI::Range(1, 65536));
  command->add_option("--id", options->id, "Name of the rig, kept in the file")->type_name("NAME");
  command->add_option("--out", options->out, "The rig.json to write")->required()->type_name("FILE");
  command->callback([options, &line] { line.run = [options] { return Import(*options); }; });
  AddRigPlanCommand(*rig, line);
}

}  // namespace weft
