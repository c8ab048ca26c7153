// `weft template import`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "services/formats/files/board_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/template_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/weft_process.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class TemplateCommand : public ::testing::Test {
 protected:
  TemplateCommand() {
    EXPECT_TRUE(WriteBoard(folder_ / "board", *GenerateBoard(6, 6, 1, 1)).ok());
    const TriangleMesh square{{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}, {1, -1, 0}}, {{0, 2, 1}, {2, 3, 1}}};
    EXPECT_TRUE(WriteMesh(folder_ / "shirt.ply", square).ok());
  }

  WeftRun Import(const std::string& cells, const std::vector<std::string>& options = {}) {
    WriteBytes(folder_ / "map.txt", cells);
    std::vector<std::string> arguments = {
        "template", "import",          "--mesh", folder_ / "shirt.ply", "--cells", folder_ / "map.txt",
        "--board",  folder_ / "board", "--out",  folder_ / "shirt"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return RunWeft(arguments);
  }

  std::string ErrorOf(const std::string& cells) {
    const WeftRun run = Import(cells);
    EXPECT_EQ(run.status, 2);
    EXPECT_EQ(run.out, "");
    EXPECT_FALSE(std::filesystem::exists(folder_ / "shirt"));
    return run.err;
  }

  TempFolder folder_;
};

TEST_F(TemplateCommand, RefusesAMeshWithOtherOpenings) {
  const std::string cells = "0 0\n0 1\n1 0\n-1 -1\n";
  const WeftRun refused = Import(cells, {"--openings", "2"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err,
              HasSubstr("shirt.ply: the garment has 1 openings, expected were 2. Lengths of their "
                        "borders: 4 mm"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "shirt"));
  EXPECT_EQ(Import(cells, {"--openings", "1"}).status, 0);
}

TEST_F(TemplateCommand, CheckSaysWhatATemplateIs) {
  ASSERT_EQ(Import("0 0\n0 1\n1 0\n-1 -1\n", {"--openings", "1"}).status, 0);
  const WeftRun run = RunWeft({"template", "check", folder_ / "shirt", "--board", folder_ / "board"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("shirt: 4 vertices, 2 faces, 3 vertices with a cell"),
                             HasSubstr("openings 1: 4 mm")));
  const WeftRun json = RunWeft({"template", "check", folder_ / "shirt", "--json"});
  EXPECT_THAT(json.out, AllOf(HasSubstr("\"expected_openings\": 1"), HasSubstr("\"components\": 1")));
  const WeftRun other = RunWeft({"template", "check", folder_ / "shirt", "--openings", "4"});
  EXPECT_EQ(other.status, 2);
  EXPECT_THAT(other.err, HasSubstr("has 1 openings, expected were 4"));
}

TEST_F(TemplateCommand, TurnsAFaceThatShowsTheInside) {
  const TriangleMesh folded{{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}, {1, -1, 0}}, {{0, 2, 1}, {2, 1, 3}}};
  ASSERT_TRUE(WriteMesh(folder_ / "shirt.ply", folded).ok());
  const WeftRun import = Import("0 0\n0 1\n1 0\n-1 -1\n");
  ASSERT_EQ(import.status, 0) << import.err;
  EXPECT_THAT(import.err, HasSubstr("1 of 2 faces showed the inside"));
  EXPECT_EQ(RunWeft({"template", "check", folder_ / "shirt", "--board", folder_ / "board"}).status, 0);
}

TEST_F(TemplateCommand, RefusesASheetThatShowsTheInsideUnlessTold) {
  const TriangleMesh turned{{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}, {1, -1, 0}}, {{0, 1, 2}, {2, 1, 3}}};
  ASSERT_TRUE(WriteMesh(folder_ / "shirt.ply", turned).ok());
  EXPECT_THAT(ErrorOf("0 0\n0 1\n1 0\n-1 -1\n"),
              AllOf(HasSubstr("run against the print"), HasSubstr("--turn-faces")));
  const WeftRun run = Import("0 0\n0 1\n1 0\n-1 -1\n", {"--turn-faces"});
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("2 of 2 faces showed the inside"));
}

TEST_F(TemplateCommand, RefusesAnotherSizeThanThePrintUnlessTold) {
  const TriangleMesh metres{{{0, 0, 0}, {0.001, 0, 0}, {0, -0.001, 0}, {0.001, -0.001, 0}},
                            {{0, 2, 1}, {2, 3, 1}}};
  ASSERT_TRUE(WriteMesh(folder_ / "shirt.ply", metres).ok());
  EXPECT_THAT(ErrorOf("0 0\n0 1\n1 0\n-1 -1\n"),
              AllOf(HasSubstr("the mesh is in metres"), HasSubstr("--unit m")));
  ASSERT_EQ(Import("0 0\n0 1\n1 0\n-1 -1\n", {"--unit", "m"}).status, 0);
  EXPECT_NEAR(ReadTemplate(folder_ / "shirt")->rest.vertices_mm[1].x(), 1, 1e-12);

  const TriangleMesh large{{{0, 0, 0}, {1.1, 0, 0}, {0, -1.1, 0}, {1.1, -1.1, 0}}, {{0, 2, 1}, {2, 3, 1}}};
  ASSERT_TRUE(WriteMesh(folder_ / "shirt.ply", large).ok());
  const WeftRun refused = Import("0 0\n0 1\n1 0\n-1 -1\n");
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("1.1 times as long as on the print"), HasSubstr("--allow-scale")));
  const WeftRun allowed = Import("0 0\n0 1\n1 0\n-1 -1\n", {"--allow-scale", "--force"});
  EXPECT_EQ(allowed.status, 0) << allowed.err;
  EXPECT_THAT(allowed.err, HasSubstr("1.1 times as long"));
  // As a job reads it: the folder says that the size is meant.
  std::vector<std::string> notes;
  EXPECT_TRUE(ReadTemplateFor(*ReadBoard(folder_ / "board"), folder_ / "shirt", &notes).ok());
  EXPECT_THAT(notes, ::testing::ElementsAre(HasSubstr("1.1 times as long")));
}

TEST_F(TemplateCommand, ReadsObjInTheOrderOfItsVertices) {
  WriteBytes(folder_ / "shirt.obj",
             "mtllib none.mtl\no sheet\nv 1 -1 0\nv 0 0 0\nv 1 0 0\nv 0 -1 0\nvt 0 0\nvn 0 0 1\nusemtl a\n"
             "f 2/1/1 4/1/1 3/1/1\ng b\nf -1//1 -4//1 -2//1\n");
  WriteBytes(folder_ / "map.txt", "1 1\n0 0\n0 1\n1 0\n");
  const WeftRun run =
      RunWeft({"template", "import", "--mesh", folder_ / "shirt.obj", "--cells", folder_ / "map.txt",
               "--board", folder_ / "board", "--out", folder_ / "shirt"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto garment = ReadTemplate(folder_ / "shirt");
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(garment->rest.vertices_mm[0], Eigen::Vector3d(1, -1, 0));
  EXPECT_EQ(garment->rest.faces, (std::vector<Face>{{1, 3, 2}, {3, 0, 2}}));
}

TEST_F(TemplateCommand, ImportsAndSaysWhatItFound) {
  const WeftRun run = Import("0 0\n0 1\n1 0\n-1 -1\n");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("4 vertices, 2 faces, 3 vertices with a cell (1 without)"),
                             HasSubstr("1 component(s)"), HasSubstr("1 boundary loop(s)")));
  const auto garment = ReadTemplate(folder_ / "shirt");
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(garment->id, "shirt");
  EXPECT_THAT(run.out, HasSubstr("hash " + garment->ContentHash()));
  ASSERT_EQ(Import("0 0\n0 1\n1 0\n-1 -1\n", {"--id", "blue"}).status, 0);
  EXPECT_EQ(ReadTemplate(folder_ / "shirt")->id, "blue");
}

TEST_F(TemplateCommand, CountsPiecesAndOpenings) {
  // An open tube of three sides, and a triangle.
  TriangleMesh mesh{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {1, 0, -1}, {0, 1, -1}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}},
      {}};
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    mesh.faces.push_back({i, i + 3, j});
    mesh.faces.push_back({j, i + 3, j + 3});
  }
  mesh.faces.push_back({6, 7, 8});
  ASSERT_TRUE(WriteMesh(folder_ / "shirt.ply", mesh).ok());
  const WeftRun run = Import("0 0\n0 1\n-1 -1\n1 0\n1 1\n-1 -1\n-1 -1\n-1 -1\n-1 -1\n");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("2 component(s)"), HasSubstr("3 boundary loop(s)")));
}

TEST_F(TemplateCommand, MapThatDoesNotFitIsNamedWithLineAndRemedyAndNothingIsWritten) {
  EXPECT_THAT(
      ErrorOf("0 0\n0 1\n1 0\n"),
      AllOf(HasSubstr("map.txt with "), HasSubstr("3 entries and the mesh 4 vertices"), HasSubstr("-1 -1")));
  EXPECT_THAT(ErrorOf("0 0\n0 1\n1 0\n1 1\n2 2\n"), HasSubstr("5 entries and the mesh 4 vertices"));
  EXPECT_THAT(ErrorOf("0 0\n0 6\n1 0\n1 1\n"),
              AllOf(HasSubstr("vertex 1: cell (0, 6)"), HasSubstr("line 2"), HasSubstr("6 columns")));
  EXPECT_THAT(ErrorOf("0 0\n0 1\n1 0\n0 1\n"),
              AllOf(HasSubstr("vertex 3"), HasSubstr("lines 2 and 4"), HasSubstr("give one of the two")));
  EXPECT_THAT(ErrorOf("0 0\n0 one\n1 0\n0 1\n"), HasSubstr("map.txt:2: expected `row col`"));
}

TEST_F(TemplateCommand, MeshThatIsNoClothIsNamed) {
  const TriangleMesh fan{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}},
                         {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}};
  ASSERT_TRUE(WriteMesh(folder_ / "shirt.ply", fan).ok());
  EXPECT_THAT(ErrorOf("0 0\n0 1\n1 0\n1 1\n2 2\n"),
              AllOf(HasSubstr("shirt.ply: face 2"), HasSubstr("two faces already")));
  WriteBytes(folder_ / "shirt.ply", "solid");
  EXPECT_THAT(ErrorOf("0 0\n"), AllOf(HasSubstr("shirt.ply"), HasSubstr("not a PLY file")));
}

TEST_F(TemplateCommand, OutputBelowAFileIsRefused) {
  WriteBytes(folder_ / "shirt", "a file");
  const WeftRun run = Import("0 0\n0 1\n1 0\n-1 -1\n");
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.err, HasSubstr("in the way"));
  EXPECT_EQ(ReadBytes(folder_ / "shirt"), "a file");
}

}  // namespace
}  // namespace weft
