// weft garment check, import.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "capture/image/image_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"
#include "weft/v1/template.pb.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

// A square of 0.2 in x and 0.1 in y, in two faces.
constexpr char kSquare[] = "v 0 0 0\nv 0.2 0 0\nv 0.2 0.1 0\nv 0 0.1 0\n";
constexpr char kSquareOfMillimetres[] = "v 0 0 0\nv 200 0 0\nv 200 100 0\nv 0 100 0\n";
constexpr char kSquareCoordinates[] = "vt 0 0\nvt 1 0\nvt 1 0.5\nvt 0 0.5\n";

class CommandGarment : public ::testing::Test {
 protected:
  std::string File(const std::string& name, const std::string& text) const {
    WriteBytes(folder_ / name, text);
    return folder_ / name;
  }
  std::string Square() const {
    return File("square.obj", std::string(kSquare) + kSquareCoordinates + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n");
  }
  CommandRun Check(const std::string& mesh, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"garment", "check", mesh});
    return RunCommand(AddGarmentCommand, std::move(more), false);
  }
  v1::GarmentMeshSummary Summary(const std::string& mesh, std::vector<std::string> more = {}) const {
    more.emplace_back("--json");
    const CommandRun run = Check(mesh, more);
    EXPECT_TRUE(run.status.ok()) << run.status;
    v1::GarmentMeshSummary summary;
    EXPECT_TRUE(ParseJson(run.out, "summary", summary).ok()) << run.out;
    return summary;
  }
  static std::vector<std::string> WarningsOf(const v1::GarmentMeshSummary& summary) {
    return {summary.warnings().begin(), summary.warnings().end()};
  }

  const TempFolder folder_;
};

TEST_F(CommandGarment, TellsWhatAMeshIs) {
  const CommandRun run = Check(Square(), {"--unit", "m"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out,
              MatchesRegex("mesh     square: 4 vertices, 2 faces, hash [0-9a-f]{16}\nopenings 600 mm\n"
                           "texture  1 chart, 0 seam edges \\(0 mm\\); atlas of 8 x 8 px\n"));
  EXPECT_EQ(run.err, "");
}

TEST_F(CommandGarment, TheSummaryHasItsMeasures) {
  const v1::GarmentMeshSummary summary = Summary(Square(), {"--unit", "m"});
  EXPECT_EQ(summary.id(), "square");
  EXPECT_EQ(summary.mesh_hash().size(), 16u);
  EXPECT_EQ(summary.vertices(), 4);
  EXPECT_EQ(summary.faces(), 2);
  EXPECT_EQ(summary.components(), 1);
  EXPECT_THAT(summary.openings_mm(), ElementsAre(::testing::DoubleNear(600, 1e-6)));
  EXPECT_EQ(summary.charts(), 1);
  EXPECT_EQ(summary.seam_edges(), 0);
  EXPECT_EQ(summary.seam_mm(), 0);
  EXPECT_NEAR(summary.edge_mm(), 200, 1e-6);  // the median of 100, 100, 200, 200 and 224 mm
  EXPECT_THAT(WarningsOf(summary), ElementsAre());
  const std::string plain = File("plain.obj", std::string(kSquareOfMillimetres) + "f 1 2 3\nf 1 3 4\n");
  EXPECT_THAT(Check(plain).out, HasSubstr("openings 600 mm\n")) << "mm where no unit is given";
}

// The faces meet along the diagonal, where their coordinates differ.
TEST_F(CommandGarment, ASeamIsAsLongAsItsEdges) {
  const std::string seamed =
      File("seamed.obj", std::string(kSquare) +
                             "vt 0 0\nvt 0.4 0\nvt 0.4 0.2\nvt 0.5 0.5\nvt 0.9 0.7\nvt 0.5 0.7\n" +
                             "f 1/1 2/2 3/3\nf 1/4 3/5 4/6\n");
  const v1::GarmentMeshSummary summary = Summary(seamed, {"--unit", "m"});
  EXPECT_EQ(summary.charts(), 2);
  EXPECT_EQ(summary.seam_edges(), 1);
  EXPECT_NEAR(summary.seam_mm(), 223.607, 0.01);
  EXPECT_THAT(Check(seamed, {"--unit", "m"}).out,
              HasSubstr("texture  2 charts, 1 seam edges (224 mm); atlas of 16 x 8 px\n"));
}

TEST_F(CommandGarment, OpeningsAreListedTheLongestFirst) {
  // A tube that widens: 30, 40 and 50 mm around below, twice that above.
  const std::string tube = File("tube.obj",
                                "v 0 0 0\nv 30 0 0\nv 0 40 0\nv 0 0 50\nv 60 0 50\nv 0 80 50\n"
                                "f 1 2 5\nf 1 5 4\nf 2 3 6\nf 2 6 5\nf 3 1 4\nf 3 4 6\n");
  const CommandRun run = Check(tube);
  EXPECT_THAT(run.out, HasSubstr("openings 240 mm, 120 mm\n"));
  EXPECT_EQ(run.out.find("texture"), std::string::npos);
  EXPECT_EQ(
      run.err,
      "weft: warning: it has no texture coordinates, so it has no atlas; unwrap it (in Blender: UV, Unwrap) "
      "and export it with UVs\n");
  // Without coordinates there can be none.
  const CommandRun atlas = Check(tube, {"--atlas", folder_ / "atlas.png"});
  EXPECT_EQ(atlas.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(atlas.message(), ::testing::StartsWith(tube + ": "));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "atlas.png"));

  const std::string closed =
      File("closed.obj", "v 0 0 0\nv 90 0 0\nv 0 90 0\nv 0 0 90\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  EXPECT_THAT(Check(closed).out, HasSubstr("openings none\n"));
}

TEST_F(CommandGarment, FacesThatLookApartAndDoubledVerticesAreWarnings) {
  const v1::GarmentMeshSummary turned =
      Summary(File("turned.obj", "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 -100 0\nf 1 2 3\nf 1 2 4\n"));
  EXPECT_EQ(turned.components(), 0);
  EXPECT_EQ(turned.openings_mm_size(), 0);
  ASSERT_EQ(turned.warnings_size(), 2);
  EXPECT_THAT(turned.warnings(0),
              HasSubstr("; in Blender: Mesh, Normals, Recalculate Outside, or Select All by "
                        "Trait, Non Manifold"));
  const v1::GarmentMeshSummary split = Summary(File(
      "split.obj", "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\nf 1 2 3\nf 4 5 6\n"));
  EXPECT_EQ(split.components(), 2);
  ASSERT_EQ(split.warnings_size(), 2);
  EXPECT_EQ(
      split.warnings(1),
      "2 vertices lie where another one does, so the cloth is open there; in Blender: Merge by Distance");
}

// Red grows with x from 0 to 200 mm, green with y from 0 to 100 mm, from 32 to 255; blue has nowhere to grow.
TEST_F(CommandGarment, TheAtlasHasPlacesAsColours) {
  const std::string file = folder_ / "atlas.png";
  const v1::GarmentMeshSummary summary = Summary(Square(), {"--unit", "m", "--level", "0", "--atlas", file});
  const auto image = ReadImageFile(file);
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_EQ(image->width_px, 8);
  EXPECT_EQ(image->height_px, 8);
  EXPECT_EQ(summary.atlas_width_px(), 8);
  EXPECT_EQ(summary.atlas_height_px(), 8);
  // One chart of an edge of 200 mm with a gutter around it, whose corners are empty.
  int black = 0;
  for (int y = 0; y < image->height_px; ++y)
    for (int x = 0; x < image->width_px; ++x) {
      const uint8_t* pixel = image->row(y) + size_t{3} * x;
      if (pixel[0] == 0 && pixel[1] == 0 && pixel[2] == 0) {
        ++black;
        continue;
      }
      EXPECT_EQ(pixel[0], x < 4 ? 32 : 255) << x << " " << y;
      EXPECT_EQ(pixel[1], y < 4 ? 255 : 32) << x << " " << y;
      EXPECT_EQ(pixel[2], 32) << x << " " << y;
    }
  EXPECT_EQ(black, 12);
}

TEST_F(CommandGarment, WhatIsNoMeshIsNamed) {
  EXPECT_EQ(Check(folder_ / "none.obj").status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(Check(Square(), {"--unit", "ell"}).message(),
              HasSubstr("\"ell\" is none of mm, cm, m, in, ft"));
}

TEST_F(CommandGarment, FramesOfAnotherProgramBecomeAResult) {
  const std::string faces = "f 1 2 3\nf 1 3 4\n";
  const std::string first = File("shirt_0007.obj", kSquare + faces),
                    second = File("shirt_0008.obj",
                                  "v 0 0 0.5\nv 0.2 0 0.5\nv 0.2 0.1 0.5\nv 0 0.1 0.5\n" + faces);
  const std::string out = folder_ / "out";
  const CommandRun run =
      RunCommand(AddGarmentCommand, {"garment", "import", first, second, "--unit", "m", "--out", out}, false);
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out,
            out + ": 2 frames of 4 vertices and 2 faces; the mesh at rest is " + out + "/garment.ply\n");
  const auto rest = ReadMesh(out + "/garment.ply"), moved = ReadMesh(out + "/0008/mesh.ply");
  ASSERT_TRUE(rest.ok() && moved.ok()) << rest.status() << moved.status();
  EXPECT_LT((rest->vertices_mm[2] - Eigen::Vector3d(200, 100, 0)).norm(), 1e-3);
  EXPECT_LT((moved->vertices_mm[2] - Eigen::Vector3d(200, 100, 500)).norm(), 1e-3);
  EXPECT_TRUE(std::filesystem::exists(out + "/0007/mesh.ply"));
}

// What `weft export` wrote with y up, and what says so beside it.
TEST_F(CommandGarment, AnExportComesBackWithTheAxesThatItWasWrittenIn) {
  const std::string mesh = File("shirt_0007.obj", std::string(kSquare) + "f 1 2 3\nf 1 3 4\n");
  const auto import = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"garment", "import", mesh, "--unit", "m", "--out", folder_ / "out"});
    CommandRun run = RunCommand(AddGarmentCommand, std::move(more), false);
    EXPECT_TRUE(run.status.ok()) << run.status;
    return std::pair(run.err, ReadMesh(folder_ / "out/garment.ply")->vertices_mm[2]);
  };
  EXPECT_EQ(import({}).first, "") << "of another program";
  const std::string exported = R"({"format": "obj", "transform": {"export_from_world":
    [0.001, 0, 0, 0, 0, -0.001, 0, 0, 0, 0, -0.001, 0, 0, 0, 0, 1], "up": "y", "unit": "m"}})";
  WriteBytes(folder_ / "export.json", exported);
  const auto [warning, as_it_is] = import({});
  EXPECT_THAT(warning,
              HasSubstr("export.json: the meshes were exported with --up y --unit m; they come back turned"));
  EXPECT_TRUE(as_it_is.isApprox(Eigen::Vector3d(200, 100, 0)));
  const auto [silence, turned] = import({"--up", "y"});
  EXPECT_EQ(silence, "");
  EXPECT_TRUE(turned.isApprox(Eigen::Vector3d(200, -100, 0)));
  EXPECT_THAT(import({"--up", "z"}).first, HasSubstr("exported with --up y"));
  EXPECT_TRUE(import({"--up", "z"}).second.isApprox(Eigen::Vector3d(200, 0, 100)));
  EXPECT_TRUE(import({"--up", "y", "--world-up", "z"}).second.isApprox(Eigen::Vector3d(200, 0, 100)));
}

}  // namespace
}  // namespace weft
