#include "services/formats/files/template_file.h"

#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/parts_message.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Template MakeGarment(const Board& board) {
  const TriangleMesh mesh{{{0, 0, 0.1}, {2.7, 0, 0}, {0, 2.7, 0}, {2.7, 1.0 / 3, 0}}, {{0, 2, 1}, {2, 3, 1}}};
  auto garment = ImportTemplate("shirt", mesh, {{0, 0}, {0, 1}, {1, 0}, {-1, -1}}, board);
  EXPECT_TRUE(garment.ok()) << garment.status();
  return *garment;
}

class TemplateFile : public ::testing::Test {
 protected:
  TemplateFile() : board_(*GenerateBoard(6, 6, 2.7, 1)), garment_(MakeGarment(board_)) {
    EXPECT_TRUE(WriteTemplate(folder_ / "shirt", garment_, "by hand").ok());
  }

  // What reading says after `text` was put in the place of `part` of a file.
  std::string ErrorAfter(const std::string& file, const std::string& part, const std::string& text) {
    std::string bytes = ReadBytes(folder_ / ("shirt/" + file));
    const size_t at = bytes.find(part);
    EXPECT_NE(at, std::string::npos) << bytes;
    bytes.replace(at, part.size(), text);
    WriteBytes(folder_ / ("shirt/" + file), bytes);
    const auto garment = ReadTemplate(folder_ / "shirt");
    EXPECT_FALSE(garment.ok());
    EXPECT_THAT(garment.status().message(), HasSubstr(file));
    return std::string(garment.status().message());
  }

  TempFolder folder_;
  Board board_;
  Template garment_;
};

TEST_F(TemplateFile, ReadsBackWithTheSameHash) {
  for (const char* path : {"shirt", "shirt/template.json"}) {
    const auto back = ReadTemplate(folder_ / path);
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(back->id, "shirt");
    EXPECT_EQ(back->ContentHash(), garment_.ContentHash());
    EXPECT_EQ(back->node_of_vertex[3].row, -1);
  }
}

TEST_F(TemplateFile, SaysThatAMeshIsNoTemplate) {
  const auto garment = ReadTemplate(folder_ / "shirt/mesh.ply");
  EXPECT_EQ(garment.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(garment.status().message(), AllOf(HasSubstr("mesh.ply: is a mesh, and this needs a template"),
                                                HasSubstr("template import")));
}

TEST_F(TemplateFile, CornersHaveAMapOfTheirOwn) {
  Template fine = garment_;
  fine.node_of_vertex[3] = {1, 1, NodeKind::kCorner};
  ASSERT_TRUE(WriteTemplate(folder_ / "shirt", fine).ok());
  EXPECT_EQ(ReadBytes(folder_ / "shirt/cells.txt"), "0 0\n0 1\n1 0\n-1 -1\n");
  EXPECT_EQ(ReadBytes(folder_ / "shirt/corners.txt"), "-1 -1\n-1 -1\n-1 -1\n1 1\n");
  const auto back = ReadTemplate(folder_ / "shirt");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->ContentHash(), fine.ContentHash());
  EXPECT_TRUE(back->node_of_vertex[3].IsCorner());
  EXPECT_THAT(ErrorAfter("corners.txt", "1 1\n", ""), HasSubstr("has 3 lines, the mesh has 4 vertices"));
  EXPECT_THAT(ErrorAfter("template.json", "\"corners.txt\"", "\"../corners.txt\""),
              AllOf(HasSubstr("the field corners"), HasSubstr("same folder")));

  // Written again without corners, none are left behind.
  ASSERT_TRUE(WriteTemplate(folder_ / "shirt", garment_).ok());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "shirt/corners.txt"));
  EXPECT_EQ(ReadTemplate(folder_ / "shirt")->ContentHash(), garment_.ContentHash());
}

TEST_F(TemplateFile, PartsAreReadBack) {
  GarmentParts parts;
  parts.cell_mm = 2.7;
  parts.panels = {{2, 0, 0, 0, 1, 3, 4, 1}, {1, 1, 1, 0, 0, 9, 9, 0}};
  parts.seams = {{{0, 1}, {2, 3}, 0, 1, 2.7, 3.1, 3.5, false, {3}}};
  parts.openings = {{{0, 1, 3, 2}, 10.5, {0, 1}}};
  parts.expected_openings = 1;
  parts.panel_faces = 1;
  parts.texture_side_mm = 30;
  parts.texture_mm = {{0, 0}, {2.7, 0}, {0, 2.7}, {15, 30}};
  ASSERT_TRUE(WriteTemplateWithParts(folder_ / "shirt", garment_, parts, "").ok());
  const auto garment = ReadTemplate(folder_ / "shirt");
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(garment->ContentHash(), garment_.ContentHash());
  const auto back = ReadGarmentParts(folder_ / "shirt");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->cell_mm, 2.7);
  ASSERT_EQ(back->panels.size(), 2u);
  EXPECT_EQ(back->panels[0].last_col, 1);
  EXPECT_EQ(back->panels[0].quarter_turns, 1);
  ASSERT_EQ(back->seams.size(), 1u);
  EXPECT_EQ(back->seams[0].side_b, (std::vector<int>{2, 3}));
  EXPECT_EQ(back->seams[0].panel_b, 1);
  EXPECT_EQ(back->seams[0].middle, std::vector<int>{3});
  ASSERT_EQ(back->openings.size(), 1u);
  EXPECT_EQ(back->openings[0].loop, (std::vector<int>{0, 1, 3, 2}));
  EXPECT_EQ(back->expected_openings, 1);
  EXPECT_EQ(back->panel_faces, 1);
  ASSERT_EQ(back->texture_mm.size(), 4u);
  EXPECT_LT((back->texture_mm[1] - Eigen::Vector2d(2.7, 0)).norm(), 1e-4);
  EXPECT_LT((back->texture_mm[2] - Eigen::Vector2d(0, 2.7)).norm(), 1e-4);
  // No cell: its place follows from the cells around it, inside the picture.
  EXPECT_GE(back->texture_mm[3].minCoeff(), 0);
  EXPECT_LE(back->texture_mm[3].maxCoeff(), 30 + 1e-4);
}

TEST_F(TemplateFile, PartsThatDoNotFitTheMeshAreRefused) {
  GarmentParts parts;
  parts.panels = {{}};
  parts.seams = {{{0, 1}, {2, 4}, 0, 0}};
  ASSERT_TRUE(WriteTemplateWithParts(folder_ / "shirt", garment_, parts, "").ok());
  EXPECT_THAT(ReadGarmentParts(folder_ / "shirt").status().message(),
              AllOf(HasSubstr("template.json: seam 0 names vertex 4, there are 4")));
  parts.seams[0].side_b = {2, 3}, parts.seams[0].panel_b = 1;
  ASSERT_TRUE(WriteTemplateWithParts(folder_ / "shirt", garment_, parts, "").ok());
  EXPECT_THAT(ReadGarmentParts(folder_ / "shirt").status().message(),
              HasSubstr("seam 0 names panel 1, there are 1"));
  parts.seams.clear(), parts.panel_faces = 3;
  ASSERT_TRUE(WriteTemplateWithParts(folder_ / "shirt", garment_, parts, "").ok());
  EXPECT_THAT(ReadGarmentParts(folder_ / "shirt").status().message(), HasSubstr("panel_faces is 3"));
}

// All of template.json, but for the hash.
TEST_F(TemplateFile, EveryNumberOfThePartsIsWritten) {
  GarmentParts parts;
  parts.cell_mm = 2.5;
  parts.panels = {{1, 2, 3, 4, 5, 6, 7, 1}};
  parts.seams = {{{0}, {1}, 0, 0, 2.5, 3.5, 4.5, false, {2}}};
  parts.openings = {{{0, 1, 2}, 10.5, {0}}};
  parts.expected_openings = 0;
  parts.panel_faces = 1;
  parts.board_rows = 6, parts.board_cols = 5;
  parts.any_scale = true;
  v1::Template proto;
  AddParts(parts, proto);
  v1::Template expected;
  ASSERT_TRUE(google::protobuf::TextFormat::ParseFromString(
      R"(cell_mm: 2.5 expected_openings: 0 panel_faces: 1 texture_side_mm: 0 board_rows: 6 board_cols: 5
         any_scale: true
         panels { cells: 1 first_row: 2 last_row: 3 first_col: 4 last_col: 5 texture_row: 6 texture_col: 7
                  quarter_turns: 1 }
         seams { panel_a: 0 panel_b: 0 length_mm: 2.5 gap_mm: 3.5 max_gap_mm: 4.5 side_a: 0 side_b: 1
                 middle: 2 }
         openings { length_mm: 10.5 panels: 0 vertices: [0, 1, 2] })",
      &expected));
  EXPECT_EQ(proto.DebugString(), expected.DebugString());
  parts.seams.clear(), parts.texture_side_mm = 0;
  ASSERT_TRUE(WriteTemplateWithParts(folder_ / "shirt", garment_, parts, "by hand").ok());
  const auto back = ReadGarmentParts(folder_ / "shirt");
  ASSERT_TRUE(back.ok()) << back.status();
  v1::Template again;
  AddParts(*back, again);
  expected.clear_seams();
  EXPECT_EQ(again.DebugString(), expected.DebugString());
  EXPECT_THAT(ReadBytes(folder_ / "shirt/template.json"), HasSubstr("\"provenance\": \"by hand\""));
}

TEST_F(TemplateFile, GarmentsOfAJointTemplateComeBack) {
  Template two = garment_;
  two.rest.faces = {{0, 2, 1}};
  two.rest.vertices_mm.resize(3), two.node_of_vertex.resize(3);
  const size_t vertices = 3;
  for (size_t v = 0; v < vertices; ++v) {
    two.rest.vertices_mm.push_back(two.rest.vertices_mm[v] + Eigen::Vector3d(8.1, 0, 0));
    two.node_of_vertex.push_back(two.node_of_vertex[v]);
    two.node_of_vertex.back().col += 3;
  }
  two.rest.faces.push_back({3, 5, 4});
  two.garments = {{"left", 0, 3, 0, 1}, {"right", 3, 3, 1, 1}};
  ASSERT_TRUE(WriteTemplate(folder_ / "two", two).ok());
  const auto back = ReadTemplate(folder_ / "two");
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->garments.size(), 2u);
  EXPECT_EQ(back->garments[0].id, "left");
  EXPECT_EQ(back->garments[1].id, "right");
  EXPECT_EQ(back->garments[1].first_vertex, 3);
  EXPECT_EQ(back->garments[1].vertices, 3);
  EXPECT_EQ(back->garments[1].first_face, 1);
  EXPECT_EQ(back->garments[1].faces, 1);
  two.garments[1].vertices = 4;
  ASSERT_TRUE(WriteTemplate(folder_ / "two", two).ok());
  const absl::Status status = ReadTemplate(folder_ / "two").status();
  EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("two/template.json: "));
}

// A sheet of 5 x 5 cells whose edges are `scale` times as long as on the print.
Template SheetOf(const Board& board, double scale) {
  Template sheet;
  sheet.id = "sheet";
  sheet.board_hash = board.ContentHash();
  for (int row = 0; row < 5; ++row)
    for (int col = 0; col < 5; ++col) {
      sheet.rest.vertices_mm.emplace_back(2.7 * scale * col, 2.7 * scale * row, 0);
      sheet.node_of_vertex.push_back({row, col});
      if (row == 4 || col == 4) continue;
      const int at = 5 * row + col;
      sheet.rest.faces.push_back({at, at + 5, at + 1});
      sheet.rest.faces.push_back({at + 1, at + 5, at + 6});
    }
  return sheet;
}

TEST_F(TemplateFile, OnABoardItsSizeIsCompared) {
  std::vector<std::string> notes;
  const auto read = [&](double scale, bool any_scale, const Board& board) {
    notes.clear();
    GarmentParts parts;
    parts.any_scale = any_scale;
    EXPECT_TRUE(WriteTemplateWithParts(folder_ / "sheet", SheetOf(board_, scale), parts, "").ok());
    return ReadTemplateFor(board, folder_ / "sheet", &notes);
  };
  auto sheet = read(1, false, board_);
  ASSERT_TRUE(sheet.ok()) << sheet.status();
  EXPECT_EQ(sheet->id, "sheet");
  EXPECT_THAT(notes, ::testing::IsEmpty());
  sheet = read(1.03, false, board_);
  ASSERT_TRUE(sheet.ok()) << sheet.status();
  ASSERT_FALSE(notes.empty());
  EXPECT_THAT(notes[0], ::testing::StartsWith("template " + folder_ / "sheet" + std::string(": ")));
  const absl::Status large = read(2, false, board_).status();
  EXPECT_TRUE(absl::IsInvalidArgument(large));
  EXPECT_THAT(std::string(large.message()), ::testing::StartsWith(folder_ / "sheet" + std::string(": ")));
  EXPECT_TRUE(read(2, true, board_).ok()) << "another size is meant";
  EXPECT_THAT(std::string(read(1, false, *GenerateBoard(6, 6, 2.7, 2)).status().message()),
              HasSubstr("was sewn from the board with hash"));
  EXPECT_TRUE(absl::IsNotFound(ReadTemplateFor(board_, folder_ / "none", &notes).status()));
}

TEST_F(TemplateFile, UnknownFieldIsNamed) {
  EXPECT_THAT(ErrorAfter("template.json", "\"id\"", "\"colour\": 1, \"id\""),
              AllOf(HasSubstr("colour"), HasSubstr("unknown field")));
}

TEST_F(TemplateFile, MapThatDoesNotFitTheMeshIsNamed) {
  EXPECT_THAT(ErrorAfter("cells.txt", "0 1\n", ""), HasSubstr("has 3 lines, the mesh has 4 vertices"));
}

TEST_F(TemplateFile, ChangedCellsNoLongerFitTheHash) {
  const std::string cells = folder_ / "shirt/cells.txt";
  WriteBytes(cells, "0 0\n0 2\n1 0\n-1 -1\n");
  EXPECT_THAT(ReadTemplate(folder_ / "shirt").status().message(),
              AllOf(HasSubstr("the field hash says " + garment_.ContentHash()),
                    HasSubstr("import the template again")));
}

TEST_F(TemplateFile, FilesOutsideTheFolderAreRefused) {
  EXPECT_THAT(ErrorAfter("template.json", "\"mesh.ply\"", "\"../mesh.ply\""),
              AllOf(HasSubstr("the field mesh"), HasSubstr("same folder")));
}

TEST_F(TemplateFile, MissingMeshIsNotFound) {
  std::filesystem::remove(folder_ / "shirt/mesh.ply");
  EXPECT_EQ(ReadTemplate(folder_ / "shirt").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(TemplateFile, TemplateOfAnotherBoardIsRefusedWithBothHashes) {
  EXPECT_TRUE(CheckTemplateFitsBoard(garment_, board_).ok());
  const Board other = *GenerateBoard(6, 6, 2.7, 2);
  EXPECT_THAT(CheckTemplateFitsBoard(garment_, other).message(),
              AllOf(HasSubstr(board_.ContentHash()), HasSubstr(other.ContentHash())));
}

}  // namespace
}  // namespace weft
