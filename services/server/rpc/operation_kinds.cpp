#include "services/server/rpc/operation_kinds.h"

#include <algorithm>

namespace weft {
namespace {

constexpr OperationInputKind kTake = {.name = "take", .is_positional = true};
constexpr OperationInputKind kOptionalRig = {.name = "rig", .is_required = false};

}  // namespace

const std::vector<OperationKind>& OperationKinds() {
  static const std::vector<OperationKind> kinds = {
      {"take info", {kTake}, {}},
      {"take verify", {kTake}, {}},
      {"take trim", {kTake}, {"frames", "shift", "compress"}, OperationOut::kTake},
      {"take export", {kTake}, {"format", "camera-width-px", "demosaic"}, OperationOut::kNamed},
      {"rig calibrate",
       {{.name = "dump", .is_positional = true}, {.name = "target"}, kOptionalRig},
       {"id", "frames", "mosaic", "every", "world-frame", "world-board", "world-floor", "scale", "gamma",
        "max-blur-px", "min-views", "max-rms-px", "max-stage-sigma-px"},
       OperationOut::kNamed},
      {"rig plan",
       {{.name = "rig"}, {.name = "template"}, {.name = "motion", .is_required = false}},
       {"cameras", "moments", "views", "max-facing-deg", "min-pitch-px", "noise-px"},
       OperationOut::kNamed},
      {"template build",
       {{.name = "sources", .is_positional = true, .may_repeat = true},
        kOptionalRig,
        {.name = "board"},
        {.name = "panels", .is_required = false}},
       {"frames", "mosaic", "samples", "cell-mm", "openings", "max-seam-gap-mm", "max-hole-mm",
        "allow-open-seams", "corners", "set", "id"},
       OperationOut::kNamed},
      {"evaluate",
       {{.name = "result", .is_positional = true},
        {.name = "truth", .is_required = false},
        {.name = "take", .is_required = false},
        kOptionalRig,
        {.name = "template", .is_required = false},
        {.name = "against", .is_required = false},
        {.name = "against-rig", .is_required = false},
        {.name = "against-template", .is_required = false}},
       {"no-truth", "fps", "samples", "sources", "seed", "quick"},
       OperationOut::kNamed,
       true},
      {"export",
       {{.name = "result", .is_positional = true}, {.name = "take", .is_required = false}, kOptionalRig},
       {"format", "frames", "up", "world-up", "unit", "fps", "attributes", "meshopt", "allow-unfinished",
        "overlay", "undistort", "texture", "texture-frames", "normal-map", "max-vertices", "camera"},
       OperationOut::kNamed,
       true}};
  return kinds;
}

const OperationKind* FindOperationKind(std::string_view command) {
  const std::vector<OperationKind>& kinds = OperationKinds();
  const auto found = std::find_if(kinds.begin(), kinds.end(),
                                  [&](const OperationKind& kind) { return kind.command == command; });
  return found == kinds.end() ? nullptr : &*found;
}

}  // namespace weft
