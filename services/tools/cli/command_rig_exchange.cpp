// weft rig exchange: another camera, or its lens, in the place of one.
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/named_status.h"
#include "capture/rig/exchange_cameras.h"
#include "services/formats/files/rig_file.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/output_guard.h"

namespace weft {
namespace {

struct ExchangeOptions {
  std::string rig;
  std::vector<std::string> cameras;
  std::string out, part;
  OutputGuard guard;
};

// The figures of what was exchanged go with it: of the sigmas nine are of the lens, six of the place.
CalibratedCamera WithPartOf(const CalibratedCamera& own, const CalibratedCamera& other, CameraPart part) {
  constexpr size_t kLensSigmas = 9;
  if (part == CameraPart::kCamera) return other;
  CalibratedCamera camera = own;
  for (size_t i = 0; i < camera.sigmas.size(); ++i) {
    const CameraPart stays = i < kLensSigmas ? CameraPart::kPlace : CameraPart::kLens;
    if (part != stays) camera.sigmas[i] = other.sigmas[i];
  }
  return camera;
}

absl::Status Exchange(const ExchangeOptions& options) {
  WEFT_RETURN_IF_ERROR(options.guard.MayReplace(options.out, "a rig, which takes may need"));
  WEFT_ASSIGN_OR_RETURN(const Rig rig, ReadRig(options.rig));
  WEFT_ASSIGN_OR_RETURN(std::optional<CalibrationRecord> record, ReadCalibrationRecord(options.rig));
  WEFT_ASSIGN_OR_RETURN(const std::vector<size_t> places,
                        Naming(options.rig, ExchangedPlaces(rig, options.cameras)));
  WEFT_ASSIGN_OR_RETURN(const CameraPart part, CameraPartFromName(options.part));
  const Rig exchanged = WithPlaces(rig, places, part);
  if (record.has_value()) {
    CalibrationRecord& calibration = *record;
    const std::vector<CalibratedCamera> before = calibration.cameras;
    for (size_t c = 0; c < places.size(); ++c)
      calibration.cameras[c] = WithPartOf(before[c], before[places[c]], part);
    ++calibration.version;
    calibration.replaces = rig.ContentHash();
  }
  const std::string cameras = absl::StrJoin(options.cameras, ", ");
  WEFT_RETURN_IF_ERROR(
      WriteRig(options.out, exchanged,
               absl::StrCat("rig ", rig.id, " (", rig.ContentHash(), ") with ",
                            part == CameraPart::kCamera ? "" : absl::StrCat(options.part, " of "), "cameras ",
                            cameras, " exchanged"),
               record.has_value() ? &*record : nullptr));
  std::printf("%s: cameras %s exchanged, hash %s\n", options.out.c_str(), cameras.c_str(),
              exchanged.ContentHash().c_str());
  return absl::OkStatus();
}

}  // namespace

void AddRigExchangeCommand(CLI::App& rig, CommandLine& line) {
  const auto [command, options] = AddCommand<ExchangeOptions>(
      rig, line, Exchange, "exchange",
      "Exchange cameras of a rig whose cables or names were exchanged, as a verdict says. Each of them gets "
      "the place and the lens of the next one, the last those of the first. Register again with the new rig.",
      "  weft rig exchange rig.json c03 c07 --out exchanged.json");
  AddRequired(*command, "rig FILE", options->rig, "The rig.json");
  AddRequired(*command, "cameras CAMERA", options->cameras, "Two cameras, or more in a ring");
  command->add_option("--only", options->part, "Exchange this part alone; the verdict says where it is one")
      ->check(CLI::IsMember({"camera", "place-and-lens", "place", "lens"}))
      ->default_val("camera");
  AddRequired(*command, "--out FILE", options->out, "The rig.json to write");
  options->guard.AddTo(*command);
}

}  // namespace weft
