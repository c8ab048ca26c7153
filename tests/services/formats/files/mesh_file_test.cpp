#include "services/formats/files/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string MeshText(const std::string& vertices, const std::string& faces) {
  const auto lines = [](const std::string& text) {
    return std::to_string(std::count(text.begin(), text.end(), '\n'));
  };
  return "ply\nformat ascii 1.0\nelement vertex " + lines(vertices) +
         "\nproperty double x\nproperty double y\nproperty double z\nelement face " + lines(faces) +
         "\nproperty list uchar int vertex_index\nend_header\n" + vertices + faces;
}

std::string ErrorOf(const std::string& text) {
  const TempFolder folder;
  WriteBytes(folder / "shirt.ply", text);
  const auto mesh = ReadMesh(folder / "shirt.ply");
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(mesh.status().message(), HasSubstr("shirt.ply"));
  return std::string(mesh.status().message());
}

const char kTriangle[] = "0 0 0\n1 0 0\n0 1 0\n";

TEST(ReadMesh, ReadsVerticesAndFaces) {
  const TempFolder folder;
  WriteBytes(folder / "shirt.ply", MeshText("0 0 0\n1.25 0 -3\n0 1 0\n", "3 2 0 1\n"));
  const auto mesh = ReadMesh(folder / "shirt.ply");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices_mm[1], Eigen::Vector3d(1.25, 0, -3));
  EXPECT_THAT(mesh->faces, ElementsAre(Face{2, 0, 1}));
}

TEST(ReadMesh, NamesTheVertexOrFaceThatIsWrong) {
  EXPECT_THAT(ErrorOf(MeshText("0 0 0\n1 nan 0\n0 1 0\n", "3 0 1 2\n")),
              AllOf(HasSubstr("row 1, property y"), HasSubstr("not a finite number")));
  EXPECT_THAT(ErrorOf(MeshText(kTriangle, "4 0 1 2 0\n")),
              AllOf(HasSubstr("face 0 has 4"), HasSubstr("triangulate")));
  EXPECT_THAT(ErrorOf(MeshText(kTriangle, "3 0 1 2\n3 0 1 3\n")), HasSubstr("face 1 names vertex 3"));
  EXPECT_THAT(ErrorOf(MeshText(kTriangle, "3 0 -1 2\n")), HasSubstr("names vertex -1"));
  EXPECT_THAT(ErrorOf("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"),
              HasSubstr("no element face"));
  EXPECT_THAT(
      ErrorOf("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nelement face 0\n"
              "property list uchar int vertex_indices\nend_header\n0 0\n"),
      HasSubstr("no property z"));
}

TEST(ReadMesh, WantsFacesThatAreLists) {
  EXPECT_THAT(ErrorOf("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                      "property float z\nelement face 1\nproperty int vertex_index\nend_header\n0 0 0\n0\n"),
              HasSubstr("element face has no list property vertex_indices"));
  EXPECT_THAT(ErrorOf(MeshText(kTriangle, "2 0 1\n")), HasSubstr("face 0 has 2 corners"));
}

// States are 0 to 4, whole ones; views up to a million.
TEST(RegisteredMesh, RefusesStatesAndViewsThatNoMeshHas) {
  const auto read = [](const std::string& state, const std::string& views) {
    const std::string text =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        "property float state\nproperty float sigma_mm\nproperty double views\nend_header\n0 0 0 " +
        state + " 0.5 " + views + "\n";
    const TempFolder folder;
    WriteBytes(folder / "mesh.ply", text);
    return ReadRegisteredMesh(folder / "mesh.ply");
  };
  for (const char* state : {"0", "4"}) EXPECT_TRUE(read(state, "0").ok()) << state;
  EXPECT_EQ(read("4", "1000000")->views[0], 1000000);
  for (const char* state : {"-1", "5", "1.5"})
    EXPECT_THAT(std::string(read(state, "0").status().message()),
                HasSubstr("row 0, property state: is " + std::string(state) + ", expected 0 to 4"));
  for (const char* views : {"-1", "1000001"})
    EXPECT_THAT(std::string(read("1", views).status().message()),
                AllOf(HasSubstr("row 0, property views: "), HasSubstr(" is no count")));
}

TEST(WriteMesh, KeepsEveryDigit) {
  const TriangleMesh mesh{{{0.1, 1.0 / 3, 1e-17}, {1e5 + 0.1, 0, 0}, {0, -2.5, 7}}, {{0, 1, 2}}};
  const TempFolder folder;
  ASSERT_TRUE(WriteMesh(folder / "mesh.ply", mesh).ok());
  const auto back = ReadMesh(folder / "mesh.ply");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->vertices_mm, mesh.vertices_mm);
  EXPECT_EQ(back->faces, mesh.faces);
}

TEST(RegisteredMesh, ReadsBackWithItsStates) {
  RegisteredMesh mesh;
  mesh.vertices_mm = {{0.5, 1, 2}, {1, 0, 0}, {0, 1, 0}};
  mesh.state = {VertexState::kObserved, VertexState::kInferred, VertexState::kObserved};
  mesh.sigma_mm = {0.125f, 2.5f, 0.25f};
  mesh.views = {12, 0, 3};
  const TempFolder folder;
  ASSERT_TRUE(WriteRegisteredMesh(folder / "mesh.ply", mesh, {{0, 1, 2}}).ok());
  const auto back = ReadRegisteredMesh(folder / "mesh.ply");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->vertices_mm, mesh.vertices_mm);
  EXPECT_EQ(back->state, mesh.state);
  EXPECT_EQ(back->sigma_mm, mesh.sigma_mm);
  EXPECT_EQ(back->views, mesh.views);
  EXPECT_EQ(ReadMesh(folder / "mesh.ply")->faces.size(), 1u);
  mesh.views.pop_back();
  EXPECT_FALSE(WriteRegisteredMesh(folder / "mesh.ply", mesh, {{0, 1, 2}}).ok());
}

TEST(RegisteredMesh, RefusesMeshesWithoutStates) {
  const TempFolder folder;
  WriteBytes(folder / "mesh.ply", MeshText(kTriangle, "3 0 1 2\n"));
  EXPECT_THAT(ReadRegisteredMesh(folder / "mesh.ply").status().message(),
              AllOf(HasSubstr("mesh.ply"), HasSubstr("no property state")));
}

TEST(RegisteredMesh, CarriesItsTextureForOtherPrograms) {
  RegisteredMesh mesh;
  mesh.vertices_mm = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.state.assign(3, VertexState::kObserved);
  mesh.sigma_mm.assign(3, 0.1f);
  mesh.views.assign(3, 4);
  MeshTexture texture;
  texture.of_vertex = {{0, 0.25f}, {0.5f, 0.25f}, {0, 1}};
  const TempFolder folder;
  ASSERT_TRUE(WriteRegisteredMesh(folder / "mesh.ply", mesh, {{0, 1, 2}}, texture).ok());
  absl::StatusOr<Ply> ply = ReadPly(folder / "mesh.ply");
  ASSERT_TRUE(ply.ok()) << ply.status();
  EXPECT_THAT(ply->Find("vertex")->Find("s")->values, ElementsAre(0, 0.5, 0));
  EXPECT_THAT(ply->Find("vertex")->Find("t")->values, ElementsAre(0.25, 0.25, 1));
  EXPECT_EQ(ply->Find("face")->Find("texcoord"), nullptr);
  texture.of_corner = {{{{0, 0.25f}, {0.5f, 0.25f}, {0.75f, 1}}}};
  ASSERT_TRUE(WriteRegisteredMesh(folder / "mesh.ply", mesh, {{0, 1, 2}}, texture).ok());
  ply = ReadPly(folder / "mesh.ply");
  ASSERT_TRUE(ply.ok()) << ply.status();
  EXPECT_THAT(ply->Find("face")->Find("texcoord")->values, ElementsAre(0, 0.25, 0.5, 0.25, 0.75, 1));
  EXPECT_EQ(ReadMesh(folder / "mesh.ply")->faces.size(), 1u);
  EXPECT_EQ(ReadRegisteredMesh(folder / "mesh.ply")->vertices_mm, mesh.vertices_mm);
  texture.of_vertex.pop_back();
  EXPECT_FALSE(WriteRegisteredMesh(folder / "mesh.ply", mesh, {{0, 1, 2}}, texture).ok());
}

}  // namespace
}  // namespace weft
