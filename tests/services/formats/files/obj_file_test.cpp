#include "services/formats/files/obj_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/files/mesh_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(MeshFromObj, ReadsVerticesAndFacesWhateverElseIsSaid) {
  const auto mesh = MeshFromObj(
      "mtllib a.mtl\ng front\nv 0 0 0\nv 1.5 0 0\nv 0 1 -2\nvt 0 0\nvn 0 0 1\n"
      "vw 0 1e46 0.5\nt crease 1/0/1 1 2 0.5\nf 1/1/1 2/1/1 3/1/1\nf -1//1 -2//1 -3//1\n",
      "shirt.obj");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->vertices_mm,
              ElementsAre(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1.5, 0, 0), Eigen::Vector3d(0, 1, -2)));
  EXPECT_THAT(mesh->faces, ElementsAre(Face{0, 1, 2}, Face{2, 1, 0}));
}

TEST(MeshFromObj, ReadsTheLineEndsOfAllSystems) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    const auto mesh =
        MeshFromObj("v 0 0 0" + end + "v 1 0 0" + end + "v 0 1 0" + end + "f 1 2 3" + end, "a.obj");
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->faces.size(), 1u);
  }
}

TEST(MeshFromObj, NamesTheFaceThatIsWrong) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
  EXPECT_THAT(MeshFromObj(vertices + "f 1 2 3 4\n", "a.obj").status().message(),
              HasSubstr("face 1 has 4 corners; triangulate"));
  EXPECT_THAT(MeshFromObj(vertices + "f 1 2 3\nf 1 2 9\n", "a.obj").status().message(),
              HasSubstr("face 2 names vertex 9"));
  EXPECT_THAT(MeshFromObj(vertices, "a.obj").status().message(), HasSubstr("no vertices or no faces"));
}

TEST(ParseObj, KeepsPolygonsAndTheirTexture) {
  const auto mesh =
      ParseObj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0.5 0.25\nvt 1\nf 1/1 2/2 3/-1 4/-2\n", "a.obj");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->polygons.size(), 1u);
  EXPECT_THAT(mesh->polygons[0],
              ElementsAre(ObjCorner{0, 0}, ObjCorner{1, 1}, ObjCorner{2, 1}, ObjCorner{3, 0}));
  EXPECT_THAT(mesh->texture, ElementsAre(Eigen::Vector2d(0.5, 0.25), Eigen::Vector2d(1, 0)));
}

TEST(ParseObj, ABackslashContinuesALine) {
  const auto mesh = ParseObj(
      "# C:\\meshes\\\nv 0 0 \\\n0\nv 1 0 0\r\nusemtl C:\\\nv 1 1 0\nvt 0 \\\r\n1\nf\\\n1/1 2/1\\\n\\\n "
      "3/1\\",
      "a.obj");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices.size(), 3u);
  EXPECT_THAT(mesh->texture, ElementsAre(Eigen::Vector2d(0, 1)));
  ASSERT_EQ(mesh->polygons.size(), 1u);
  EXPECT_THAT(mesh->polygons[0], ElementsAre(ObjCorner{0, 0}, ObjCorner{1, 0}, ObjCorner{2, 0}));
  EXPECT_THAT(ParseObj("v 0 \\\n0 0\nv 1\\\n0\n", "a.obj").status().message(),
              HasSubstr("a.obj:3: v needs 3 finite numbers"));
  EXPECT_THAT(ParseObj("v 0 0 0\nv 1 0\\\n 0\nv 0 1 0\nf 1 2 \\\n0\n", "a.obj").status().message(),
              HasSubstr("line 5"));
}

TEST(ParseObj, RefusesFacesThatAreTooLargeOrTooSmall) {
  std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf";
  EXPECT_THAT(ParseObj(text + " 1 2\n", "a.obj").status().message(), HasSubstr("fewer than three corners"));
  for (int i = 0; i < 259; ++i) text += " 1";
  EXPECT_THAT(ParseObj(text + "\n", "a.obj").status().message(), HasSubstr("more than 255 corners"));
}

TEST(ParseObj, NamesTheLineWithoutNumbers) {
  EXPECT_THAT(ParseObj("v 0 0 0\nv 1 0\n", "a.obj").status().message(),
              HasSubstr("a.obj:2: v needs 3 finite numbers"));
  EXPECT_THAT(ParseObj("v 0 0 inf\n", "a.obj").status().message(), HasSubstr("it has \"inf\""));
}

TEST(ParseObj, SaysThatATextIsNoObj) {
  // Indices begin at 1.
  EXPECT_THAT(std::string(ParseObj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "a.obj").status().message()),
              HasSubstr("a.obj: is no OBJ that can be read: "));
  EXPECT_THAT(std::string(ParseObj("v 0 0 0\nvt x\n", "a.obj").status().message()),
              HasSubstr("a.obj:2: vt needs up to 2 finite numbers, it has \"x\""));
  EXPECT_THAT(std::string(ParseObj("v 0 0 0\nvt\n", "a.obj").status().message()),
              HasSubstr("it has \"too few\""));
}

TEST(ReadForeignMesh, ReadsObjAndPlyByTheirEnding) {
  const TempFolder folder;
  const TriangleMesh triangle{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  WriteBytes(folder / "a.OBJ", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  ASSERT_TRUE(WriteMesh(folder / "a.ply", triangle).ok());
  for (const char* name : {"a.OBJ", "a.ply"}) {
    const auto mesh = ReadForeignMesh(folder / name);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->vertices_mm, triangle.vertices_mm);
    EXPECT_EQ(mesh->faces, triangle.faces);
  }
  EXPECT_TRUE(absl::IsNotFound(ReadForeignMesh(folder / "none.obj").status()));
  EXPECT_TRUE(absl::IsNotFound(ReadForeignMesh(folder / "none.ply").status()));
}

}  // namespace
}  // namespace weft
