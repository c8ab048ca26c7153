// weft body: the sizes of the person who wears a garment of `weft simulate`.
#include <array>
#include <cstdio>
#include <optional>
#include <string>

#include "absl/strings/str_replace.h"
#include "figure/body.h"
#include "figure/joint_angles.h"
#include "figure/skeleton.h"
#include "services/formats/figure/body_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/tools/cli/commands.h"

namespace weft {
namespace {

constexpr double kAverageStatureMm = 1800;

struct BodyMakeOptions {
  std::optional<uint64_t> seed;
  std::optional<double> stature_mm, girth;
  std::array<std::optional<double>, kBodyFactors> factors;  // as BodyFactors
  std::string id, out;
};

absl::StatusOr<BodyShape> ShapeFor(const BodyMakeOptions& options) {
  BodyShape shape = options.seed ? RandomBodyShape(*options.seed) : BodyShape();
  if (options.stature_mm) shape.stature = *options.stature_mm / kAverageStatureMm;
  for (size_t k = 0; k < kBodyFactors; ++k) {
    const BodyFactor& factor = BodyFactors()[k];
    if (options.factors[k]) shape.*factor.value = *options.factors[k];
    if (options.girth && factor.name.ends_with("girth")) shape.*factor.value *= *options.girth;
  }
  WEFT_RETURN_IF_ERROR(shape.Validate());
  return shape;
}

void PrintBody(const std::string& path, const NamedBody& body) {
  const Skeleton skeleton = SkeletonOf(body.shape);
  const auto between = [&](Joint a, Joint b) { return (skeleton.At(a) - skeleton.At(b)).norm(); };
  std::printf("%s: %.0f mm tall, hash %s\n", path.c_str(), kAverageStatureMm * body.shape.stature,
              BodyHash(body.shape).c_str());
  for (const BodyFactor& factor : BodyFactors())
    std::printf("%-16s %6.3f\n", std::string(factor.name).c_str(), body.shape.*factor.value);
  std::printf("shoulder joints %.0f mm apart, upper arm %.0f, forearm %.0f, thigh %.0f, shin %.0f mm\n",
              between(Joint::kLeftUpperArm, Joint::kRightUpperArm),
              between(Joint::kLeftUpperArm, Joint::kLeftForearm),
              between(Joint::kLeftForearm, Joint::kLeftHand), between(Joint::kLeftThigh, Joint::kLeftShin),
              (skeleton.At(Joint::kLeftShin) - skeleton.left_ankle_mm).norm());
}

absl::Status MakeBodyFile(const BodyMakeOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const BodyShape shape, ShapeFor(options));
  const NamedBody body = {options.id, shape};
  WEFT_RETURN_IF_ERROR(WriteBody(options.out, body));
  PrintBody(options.out, body);
  return absl::OkStatus();
}

struct BodyShowOptions {
  std::string body, mesh;
};

absl::Status ShowBody(const BodyShowOptions& options) {
  const auto& [path, mesh_path] = options;
  WEFT_ASSIGN_OR_RETURN(const NamedBody body, ReadBody(path));
  PrintBody(path, body);
  if (mesh_path.empty()) return absl::OkStatus();
  const TriangleMesh mesh = {Body(PoseOf(NaturalAngles()), body.shape).MeshVertices(), Body::MeshFaces()};
  WEFT_RETURN_IF_ERROR(WriteMesh(mesh_path, mesh));
  std::printf("%s: the body, standing at ease; its parts overlap\n", mesh_path.c_str());
  return absl::OkStatus();
}

}  // namespace

void AddBodyCommand(CLI::App& app, CommandLine& line) {
  CLI::App* body = AddGroup(
      app, "body", "Bodies of different sizes, for the person who wears the garment of `weft simulate`.",
      "  weft body make --stature-mm 1650 --waist-girth 1.1 --out anna.body\n"
      "  weft body show anna.body --mesh anna.ply\n"
      "  weft simulate --preset shirt-drive --body anna.body --no-pictures --out take");

  const auto [make, options] = AddCommand<BodyMakeOptions>(*body, line, MakeBodyFile, "make",
                                                           "Make a body from sizes, or a random one.",
                                                           "  weft body make --seed 7 --out random.body");
  AddOption(*make, "--seed S", options->seed,
            "A random person, whose sizes vary as people's do; without, an average one");
  AddOption(*make, "--stature-mm MM", options->stature_mm, "How tall; lengths and girths grow with it");
  AddOption(*make, "--girth FACTOR", options->girth, "All girths times this");
  for (size_t k = 0; k < kBodyFactors; ++k) {
    const std::string name = absl::StrReplaceAll(std::string(BodyFactors()[k].name), {{"_", "-"}});
    CLI::Option* option =
        make->add_option("--" + name, options->factors[k], "Factor against the average, 0.7 to 1.4")
            ->type_name("FACTOR")
            ->group("Sizes");
    if (name == "stature") option->excludes("--stature-mm");
  }
  AddOption(*make, "--id NAME", options->id, "What the body is called");
  AddRequired(*make, "--out FILE", options->out, "The file to write, NAME.body");

  const auto [show, shown] =
      AddCommand<BodyShowOptions>(*body, line, ShowBody, "show", "Show the sizes of a body.",
                                  "  weft body show anna.body --mesh anna.ply");
  AddRequired(*show, "body FILE", shown->body, "A body");
  AddOption(*show, "--mesh FILE", shown->mesh, "Also write it as a mesh (PLY)");
}

}  // namespace weft
