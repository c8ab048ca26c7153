#include "services/formats/files/garment_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/template_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// As Blender 3 writes it: metres, a quad and two triangles, and a seam at the edge between vertices 2 and 3,
// where the texture of the triangle above goes on elsewhere.
constexpr char kBlenderObj[] = R"(# Blender v3.4.1 OBJ File: 'shirt.blend'
# www.blender.org
mtllib shirt.mtl
o Shirt
v 0.000000 0.000000 0.000000
v 0.100000 0.000000 0.000000
v 0.100000 0.100000 0.000000
v 0.000000 0.100000 0.000000
v 0.050000 0.200000 0.000000
v 0.200000 0.050000 0.000000
vn 0.0000 0.0000 1.0000
vt 0.100000 0.100000
vt 0.200000 0.100000
vt 0.200000 0.200000
vt 0.100000 0.200000
vt 0.600000 0.600000
vt 0.700000 0.600000
vt 0.650000 0.700000
vt 0.300000 0.150000
s 0
usemtl Cotton
f 1/1/1 2/2/1 3/3/1 4/4/1
g sleeve
f 4/5/1 3/6/1 5/7/1
f 2/2/1 6/8/1 3/3/1
)";

class GarmentFile : public ::testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& text) {
    WriteBytes(folder_ / name, text);
    return folder_ / name;
  }
  // What reading says after `text` was put in the place of `part`.
  std::string ErrorAfter(const std::string& part, const std::string& text, double unit_mm = 1000) {
    const std::string changed = absl::StrReplaceAll(kBlenderObj, {{part, text}});
    EXPECT_NE(changed, kBlenderObj);
    const auto garment = ReadGarmentMesh(Write("shirt.obj", changed), unit_mm);
    EXPECT_EQ(garment.status().code(), absl::StatusCode::kInvalidArgument) << garment.status();
    EXPECT_THAT(std::string(garment.status().message()), HasSubstr("shirt.obj:"));
    return std::string(garment.status().message());
  }

  TempFolder folder_;
};

TEST_F(GarmentFile, ReadsAnObjOfBlender) {
  const auto garment = ReadGarmentMesh(Write("shirt.obj", kBlenderObj), 1000);
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(garment->id, "shirt");
  ASSERT_EQ(garment->rest.vertices_mm.size(), 6u);
  EXPECT_EQ(garment->rest.vertices_mm[4], Eigen::Vector3d(50, 200, 0));
  EXPECT_EQ(garment->rest.faces.size(), 4u);
  // The vertices of the seam stay one each, and have two places.
  const auto places_of = [&](int v) {
    std::set<std::pair<float, float>> places;
    for (size_t f = 0; f < garment->rest.faces.size(); ++f)
      for (size_t k = 0; k < 3; ++k)
        if (garment->rest.faces[f][k] == v) {
          const Eigen::Vector2f& at = garment->texture.At(garment->rest.faces, f, k);
          places.emplace(at.x(), at.y());
        }
    return places;
  };
  EXPECT_EQ(places_of(3), (std::set<std::pair<float, float>>{{0.1f, 0.2f}, {0.6f, 0.6f}}));
  EXPECT_EQ(places_of(1).size(), 1u);
  EXPECT_EQ(garment->texture.of_vertex[3], Eigen::Vector2f(0.1f, 0.2f));
}

TEST_F(GarmentFile, OfAMeshWithoutSeamsVerticesSayAll) {
  const auto garment = ReadGarmentMesh(
      Write("a.obj", absl::StrReplaceAll(kBlenderObj, {{"4/5/1 3/6/1", "4/4/1 3/3/1"}})), 1000);
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_FALSE(garment->texture.empty());
  EXPECT_TRUE(garment->texture.of_corner.empty());
}

TEST_F(GarmentFile, TextureMayBeMissingAltogether) {
  const auto garment =
      ReadGarmentMesh(Write("a.obj", "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 100 100 0\nf 1 2 4 3\n"));
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_TRUE(garment->texture.empty());
  EXPECT_EQ(garment->rest.faces.size(), 2u);
}

TEST_F(GarmentFile, NamesWhatIsWrongAndTheRemedy) {
  EXPECT_THAT(ErrorAfter("f 4/5/1 3/6/1 5/7/1", "f 4 3 5"),
              AllOf(HasSubstr("face 2 has no texture coordinates (vt)"), HasSubstr("unwrap")));
  EXPECT_THAT(ErrorAfter("v 0.050000", "v nan"),
              AllOf(HasSubstr("shirt.obj:9: v needs 3 finite numbers, it has \"nan\""), HasSubstr("export")));
  EXPECT_THAT(ErrorAfter("v 0.050000", "v 0,05"), HasSubstr("it has \"0,05\""));
  EXPECT_THAT(ErrorAfter("vt 0.650000", "vt 1e999"), HasSubstr("vt needs up to 2 finite numbers"));
  EXPECT_THAT(ErrorAfter("5/7/1", "5/70/1"),
              HasSubstr("names texture coordinate 70, the file has 8 vt lines"));
  EXPECT_THAT(ErrorAfter("5/7/1", "50/7/1"), HasSubstr("names vertex 50"));
  EXPECT_THAT(ErrorAfter("f 4/5/1 3/6/1 5/7/1", "f 4/5/1 3/6/1"), HasSubstr("fewer than three corners"));
  EXPECT_THAT(ErrorAfter("f 2/2/1 6/8/1 3/3/1", "f 4/5/1 3/6/1 6/8/1"),
              AllOf(HasSubstr("has two faces already"), HasSubstr("Non Manifold")));
  EXPECT_THAT(ErrorAfter("f 2/2/1 6/8/1 3/3/1", "f 2/2/1 2/2/1 3/3/1"),
              AllOf(HasSubstr("a vertex occurs twice"), HasSubstr("Merge by Distance")));
}

TEST_F(GarmentFile, AsksForTheUnitOfASizeThatNoGarmentHas) {
  EXPECT_THAT(ErrorAfter("o Shirt", "o Skirt", 1), AllOf(HasSubstr("mm across"), HasSubstr("--unit m")));
  EXPECT_THAT(ErrorAfter("o Shirt", "o Skirt", 1e6), HasSubstr("--unit"));
}

TEST_F(GarmentFile, ATemplateIsAGarmentToo) {
  const Board board = *GenerateBoard(6, 6, 2.7, 1);
  const TriangleMesh mesh{{{0, 0, 0.1}, {2.7, 0, 0}, {0, 2.7, 0}}, {{0, 2, 1}}};
  const auto shirt = ImportTemplate("shirt", mesh, {{0, 0}, {0, 1}, {1, 0}}, board);
  ASSERT_TRUE(shirt.ok()) << shirt.status();
  GarmentParts parts;
  parts.board_rows = parts.board_cols = 6;
  ASSERT_TRUE(WriteTemplateWithParts(folder_ / "shirt", *shirt, parts, "").ok());
  const auto garment = ReadGarmentMesh(folder_ / "shirt");
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(garment->id, "shirt");
  EXPECT_EQ(garment->MeshHash(), shirt->MeshHash());
  EXPECT_FALSE(garment->texture.empty());
}

TEST_F(GarmentFile, PlyKeepsTheTextureOfAnObj) {
  const auto garment = ReadGarmentMesh(Write("shirt.obj", kBlenderObj), 1000);
  ASSERT_TRUE(garment.ok());
  ASSERT_TRUE(WriteMesh(folder_ / "shirt.ply", garment->rest, garment->texture).ok());
  const auto back = ReadGarmentMesh(folder_ / "shirt.ply");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->MeshHash(), garment->MeshHash());
  EXPECT_EQ(back->texture.of_vertex, garment->texture.of_vertex);
  EXPECT_EQ(back->texture.of_corner, garment->texture.of_corner);
}

TEST_F(GarmentFile, AnotherMomentHasTheSameFaces) {
  const auto garment = ReadGarmentMesh(Write("shirt.obj", kBlenderObj), 1000);
  ASSERT_TRUE(garment.ok());
  // The quad's other diagonal is the shorter one now; its faces stay those of the first moment.
  const auto moved = ReadGarmentMoment(
      Write("b.obj", absl::StrReplaceAll(kBlenderObj, {{"v 0.000000 0.000000", "v 0.060000 0.060000"}})),
      *garment, 1000);
  ASSERT_TRUE(moved.ok()) << moved.status();
  EXPECT_EQ((*moved)[0], Eigen::Vector3d(60, 60, 0));
  const auto other = ReadGarmentMoment(
      Write("c.obj", absl::StrReplaceAll(kBlenderObj, {{"f 2/2/1 6/8/1 3/3/1", "f 2/2/1 6/8/1 5/7/1"}})),
      *garment, 1000);
  EXPECT_THAT(std::string(other.status().message()),
              HasSubstr("c.obj: has other vertices or faces than shirt"));
}

TEST_F(GarmentFile, MomentsMayBePly) {
  const auto garment = ReadGarmentMesh(Write("shirt.obj", kBlenderObj), 1000);
  ASSERT_TRUE(garment.ok());
  TriangleMesh moment = garment->rest;
  for (Eigen::Vector3d& vertex : moment.vertices_mm) vertex = (vertex + Eigen::Vector3d(7, 0, 0)) / 1000;
  ASSERT_TRUE(WriteMesh(folder_ / "b.ply", moment).ok());
  const auto moved = ReadGarmentMoment(folder_ / "b.ply", *garment, 1000);
  ASSERT_TRUE(moved.ok()) << moved.status();
  ASSERT_EQ(moved->size(), garment->rest.vertices_mm.size());
  for (size_t v = 0; v < moved->size(); ++v)
    EXPECT_LT(((*moved)[v] - garment->rest.vertices_mm[v] - Eigen::Vector3d(7, 0, 0)).norm(), 1e-9);
  EXPECT_THAT(std::string(ReadGarmentMoment(folder_ / "b.ply", *garment).status().message()),
              HasSubstr("mm across"))
      << "a moment in metres among others in mm";
  const absl::Status in_dm = ReadGarmentMoment(folder_ / "b.ply", *garment, 10'000).status();
  EXPECT_THAT(std::string(in_dm.message()),
              HasSubstr("b.ply: its edges are 10 times as long as those of shirt"))
      << "of a garment's size, too";
  std::swap(moment.faces[0][0], moment.faces[0][1]);
  ASSERT_TRUE(WriteMesh(folder_ / "c.ply", moment).ok());
  EXPECT_TRUE(absl::IsInvalidArgument(ReadGarmentMoment(folder_ / "c.ply", *garment, 1000).status()));
  std::swap(moment.faces[0][0], moment.faces[0][1]);
  moment.vertices_mm.emplace_back(0, 0, 0);
  ASSERT_TRUE(WriteMesh(folder_ / "d.ply", moment).ok());
  EXPECT_TRUE(absl::IsInvalidArgument(ReadGarmentMoment(folder_ / "d.ply", *garment, 1000).status()));
}

TEST_F(GarmentFile, TextureOfAPlyIsFinite) {
  const auto garment = ReadGarmentMesh(Write("shirt.obj", kBlenderObj), 1000);
  ASSERT_TRUE(garment.ok());
  for (const bool is_corner : {false, true}) {
    MeshTexture texture;
    texture.of_vertex.assign(garment->rest.vertices_mm.size(), Eigen::Vector2f(0.5f, 0.5f));
    if (is_corner) texture.of_corner.resize(garment->rest.faces.size());
    for (auto& corners : texture.of_corner) corners.fill(Eigen::Vector2f(0.5f, 0.5f));
    Eigen::Vector2f& place = is_corner ? texture.of_corner.back()[2] : texture.of_vertex.back();
    ASSERT_TRUE(WriteMesh(folder_ / "shirt.ply", garment->rest, texture).ok());
    EXPECT_TRUE(ReadGarmentMesh(folder_ / "shirt.ply").ok());
    place.y() = std::numeric_limits<float>::infinity();
    ASSERT_TRUE(WriteMesh(folder_ / "shirt.ply", garment->rest, texture).ok());
    EXPECT_THAT(std::string(ReadGarmentMesh(folder_ / "shirt.ply").status().message()),
                HasSubstr("shirt.ply: a texture coordinate is not finite; export the mesh again"));
  }
}

}  // namespace
}  // namespace weft
