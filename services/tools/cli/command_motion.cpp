// weft motion: what a person does, for `weft simulate`.
#include <cstdio>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "figure/body_sides.h"
#include "figure/motion_generator.h"
#include "figure/retarget.h"
#include "services/formats/figure/bvh_file.h"
#include "services/formats/figure/motion_file.h"
#include "services/formats/figure/motion_strip.h"
#include "services/formats/files/atomic_file.h"
#include "services/tools/cli/commands.h"

namespace weft {
namespace {

struct MotionMakeOptions {
  std::string kind = "mixed";
  MotionOptions motion;
  std::string out;
};

absl::Status MakeMotionFile(MotionMakeOptions options) {
  WEFT_ASSIGN_OR_RETURN(options.motion.kind, MotionKindNamed(options.kind));
  WEFT_ASSIGN_OR_RETURN(const Motion motion, MakeMotion(options.motion));
  WEFT_RETURN_IF_ERROR(WriteMotion(options.out, motion));
  std::printf("%s: %s, %.1f s, %zu poses\n", options.out.c_str(), options.kind.c_str(), motion.DurationS(),
              motion.poses.size());
  return absl::OkStatus();
}

struct MotionImportOptions {
  std::string bvh, out;
  std::vector<std::string> joints;  // OURS=THEIRS
  std::string up;                   // an axis of the file
  std::string angles = "auto", sides = "auto";
};

absl::StatusOr<RetargetOptions> RetargetOptionsOf(const std::string& up) {
  RetargetOptions out;
  if (up.empty()) return out;
  constexpr std::string_view kAxes = "xyz";
  const bool is_negative = up.front() == '-';
  const size_t axis = kAxes.find(up.substr(is_negative ? 1 : 0));
  if (up.size() != (is_negative ? 2 : 1) || axis == std::string_view::npos)
    return absl::InvalidArgumentError(
        absl::StrCat("--up \"", up, "\" is no axis, expected x, y, z, -x, -y or -z"));
  out.up = (is_negative ? -1 : 1) * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(axis));
  return out;
}

void PrintImport(const ForeignMotion& bvh, const JointMatch& match, const RetargetedMotion& motion) {
  for (size_t j = 0; j < kJoints; ++j)
    std::printf("%-16s %s\n", std::string(NameOf(static_cast<Joint>(j))).c_str(),
                match.of[j] < 0 ? "-" : bvh.joints[static_cast<size_t>(match.of[j])].name.c_str());
  std::printf("%-16s %.4g in the file, from hip to %s\n", "legs", motion.leg_length,
              match.ankles[0] >= 0 && match.ankles[1] >= 0 ? "ankle" : "knee");
  for (const std::vector<std::string>* notes : {&bvh.notes, &motion.notes})
    for (const std::string& note : *notes) std::printf("%-16s %s\n", "note", note.c_str());
}

absl::StatusOr<Motion> ImportMotion(const MotionImportOptions& options) {
  std::map<std::string, std::string> given;
  for (const std::string& joint : options.joints) {
    const size_t at = joint.find('=');
    if (at == std::string::npos)
      return absl::InvalidArgumentError(
          absl::StrCat("--joint \"", joint, "\" is not of the form OURS=THEIRS"));
    given[joint.substr(0, at)] = joint.substr(at + 1);
  }
  WEFT_ASSIGN_OR_RETURN(RetargetOptions retarget, RetargetOptionsOf(options.up));
  retarget.check_sides = options.sides != "as-named";
  const BvhAngles angles = options.angles == "radians"   ? BvhAngles::kRadians
                           : options.angles == "degrees" ? BvhAngles::kDegrees
                                                         : BvhAngles::kAuto;
  WEFT_ASSIGN_OR_RETURN(const ForeignMotion bvh, ReadBvh(options.bvh, angles));
  const auto named = [&](const absl::Status& status) {
    return absl::Status(status.code(), absl::StrCat(options.bvh, ": ", std::string(status.message())));
  };
  absl::StatusOr<JointMatch> match = MatchJoints(bvh, given);
  if (!match.ok()) return named(match.status());
  if (options.sides == "exchanged") *match = WithSidesExchanged(*match);
  absl::StatusOr<RetargetedMotion> motion = Retarget(bvh, *match, retarget);
  if (!motion.ok()) return named(motion.status());
  PrintImport(bvh, *match, *motion);
  return std::move(motion->motion);
}

absl::Status ImportMotionFile(const MotionImportOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const Motion motion, ImportMotion(options));
  WEFT_RETURN_IF_ERROR(WriteMotion(options.out, motion));
  std::printf("%s: %.1f s, %zu poses at %g a second\n", options.out.c_str(), motion.DurationS(),
              motion.poses.size(), motion.fps);
  return absl::OkStatus();
}

absl::Status ListMotionKinds() {
  for (const MotionKindInfo& info : MotionKinds())
    std::printf("%-10s %s\n", std::string(info.name).c_str(), std::string(info.about).c_str());
  return absl::OkStatus();
}

struct MotionShowOptions {
  std::string motion, picture;
};

absl::Status ShowMotion(const MotionShowOptions& options) {
  const auto& [path, picture] = options;
  WEFT_ASSIGN_OR_RETURN(const Motion motion, ReadMotion(path));
  std::printf("%s: %.2f s, %zu poses at %g a second, hash %s\n", path.c_str(), motion.DurationS(),
              motion.poses.size(), motion.fps, MotionHash(motion).c_str());
  std::printf("%-16s %14s %16s\n", "joint", "farthest, deg", "fastest, deg/s");
  for (const JointUse& use : JointUses(motion))
    std::printf("%-16s %14.1f %16.1f\n", std::string(NameOf(use.joint)).c_str(), use.farthest_deg,
                use.fastest_deg_s);
  if (picture.empty()) return absl::OkStatus();
  WEFT_RETURN_IF_ERROR(WriteFileAtomically(picture, MotionStripSvg(motion)));
  std::printf("%s: the motion as a strip of figures, from the front and from the side\n", picture.c_str());
  return absl::OkStatus();
}

std::string KindsText() {
  std::string out = "What the person does:";
  for (const MotionKindInfo& info : MotionKinds())
    absl::StrAppend(&out, "\n", std::string(info.name), ": ", std::string(info.about));
  return out;
}

void AddMotionMake(CLI::App& motion, CommandLine& line) {
  const auto [make, options] = AddCommand<MotionMakeOptions>(
      motion, line, MakeMotionFile, "make", "Make a motion from a kind and a seed.",
      "  weft motion make --kind mixed --seconds 60 --seed 3 --out mixed.motion");
  AddOption(*make, "--kind NAME", options->kind, KindsText());
  AddOption(*make, "--seconds S", options->motion.seconds, "How long it is, up to 3600");
  AddOption(*make, "--fps HZ", options->motion.fps,
            "Poses a second, 24 to 240; cameras may have another rate");
  AddOption(*make, "--seed S", options->motion.seed, "Phases, sizes and order follow from it");
  AddRequired(*make, "--out FILE", options->out, "The file to write, NAME.motion");
}

void AddMotionImport(CLI::App& motion, CommandLine& line) {
  const auto [import_command, imported] = AddCommand<MotionImportOptions>(
      motion, line, ImportMotionFile, "import",
      "Turn motion capture (BVH) into a motion of our skeleton: on the ground, at the size of an average "
      "person, looking to the front at first. Joints are matched by the names in common use, and listed.",
      "  weft motion import walk.bvh --out walk.motion\n"
      "  weft motion import odd.bvh --joint pelvis=Base --joint chest=Rib2 --out odd.motion");
  AddRequired(*import_command, "bvh FILE", imported->bvh, "The file to read");
  AddOption(*import_command, "--joint OURS=THEIRS", imported->joints,
            "Match a joint by hand, ours (as `weft motion show` names it) to the file's; may be repeated. "
            "\"Left\" is the side that a viewer in front sees on the left");
  AddOption(*import_command, "--up AXIS", imported->up,
            "The axis of the file that points up; found by how the person stands where it is not given");
  AddOption(
      *import_command, "--angles UNIT", imported->angles,
      "What angles are; auto: degrees, or radians where none is above 2 pi and the person goes somewhere",
      OneOf({"auto", "degrees", "radians"}));
  AddOption(*import_command, "--sides KIND", imported->sides,
            "Left and right: as the file names them, exchanged, or auto, which refuses a person whose knees "
            "bend forwards and whose toes point backwards",
            OneOf({"auto", "as-named", "exchanged"}));
  AddRequired(*import_command, "--out FILE", imported->out, "The file to write, NAME.motion");
}

void AddMotionList(CLI::App& motion, CommandLine& line) {
  CLI::App* list =
      AddCommand(motion, "list", "List the kinds of motion that can be made.", "  weft motion list");
  list->callback([&line] { line.run = ListMotionKinds; });
}

void AddMotionShow(CLI::App& motion, CommandLine& line) {
  const auto [show, options] = AddCommand<MotionShowOptions>(
      motion, line, ShowMotion, "show",
      "Show what a motion holds: length, and how far and fast each joint turns.",
      "  weft motion show walk.motion --picture walk.svg");
  AddRequired(*show, "motion FILE", options->motion, "A motion");
  AddOption(*show, "--picture FILE", options->picture, "Also draw it as a strip of figures (SVG)");
}

}  // namespace

void AddMotionCommand(CLI::App& app, CommandLine& line) {
  CLI::App* motion =
      AddGroup(app, "motion", "Motions of a person, who wears the garment that `weft simulate` films.",
               "  weft motion make --kind walk --seconds 20 --out walk.motion\n"
               "  weft motion show walk.motion --picture walk.svg\n"
               "  weft simulate --preset tshirt --motion walk.motion --no-pictures --frames 600 --out take");
  AddMotionMake(*motion, line);
  AddMotionImport(*motion, line);
  AddMotionList(*motion, line);
  AddMotionShow(*motion, line);
}

}  // namespace weft
