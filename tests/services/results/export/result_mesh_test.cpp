#include "services/results/export/result_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/results/export/small_result.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(ResultMesh, ComesBackWithFacesAndPlacesWhereItsChecksumIsThatOfTheReport) {
  const SmallResult result;
  const std::string file = result.MeshFile(1);
  for (const std::string& checksum : {SmallResult::ChecksumOf(file), std::string()}) {
    const auto mesh = ReadCheckedMesh(file, checksum);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->registered.vertices_mm, SmallResult::MeshAt(1).vertices_mm);
    EXPECT_EQ(mesh->registered.views, SmallResult::MeshAt(1).views);
    EXPECT_EQ(mesh->faces, SmallResult::Faces());
    EXPECT_EQ(mesh->texture.of_vertex, SmallResult::Texture().of_vertex);
    EXPECT_TRUE(mesh->texture.of_corner.empty());
  }
  const auto vertices = ReadCheckedVertices(file, SmallResult::ChecksumOf(file));
  ASSERT_TRUE(vertices.ok()) << vertices.status();
  EXPECT_EQ(vertices->vertices_mm, SmallResult::MeshAt(1).vertices_mm);
}

TEST(ResultMesh, PlacesOfCornersComeBackToo) {
  const SmallResult result;
  MeshTexture texture = SmallResult::Texture();
  texture.of_corner = {{Eigen::Vector2f(0, 0), {1, 0}, {1, 0.5F}},
                       {Eigen::Vector2f(0, 0.75F), {1, 0.5F}, {0, 0.5F}}};
  const std::string file = result.MeshFile(0);
  ASSERT_TRUE(WriteRegisteredMesh(file, SmallResult::MeshAt(0), SmallResult::Faces(), texture).ok());
  const auto mesh = ReadCheckedMesh(file, "");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->texture.of_corner, texture.of_corner);
}

TEST(ResultMesh, AFileThatIsNotAsItsReportListsItIsDataLoss) {
  const SmallResult result;
  const std::string file = result.MeshFile(1), listed = SmallResult::ChecksumOf(result.MeshFile(2));
  ASSERT_NE(listed, SmallResult::ChecksumOf(file));
  for (const absl::Status& status :
       {ReadCheckedMesh(file, listed).status(), ReadCheckedVertices(file, listed).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    EXPECT_THAT(status.message(), AllOf(HasSubstr(file), HasSubstr("`weft register` with the same inputs")));
  }
}

TEST(ResultMesh, NamesAFileThatIsMissingOrNoMeshOfAResult) {
  const SmallResult result;
  const std::string missing = result.folder / "no.ply", plain = result.folder / "plain.ply";
  EXPECT_EQ(ReadCheckedMesh(missing, "").status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(ReadCheckedMesh(missing, "").status().message(), HasSubstr(missing));
  WriteBytes(plain, "ply\nformat ascii 1.0\nend_header\n");
  EXPECT_EQ(ReadCheckedMesh(plain, "").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(ReadCheckedMesh(plain, "").status().message(), HasSubstr(plain));
}

// Of a garment without a board nobody observes a vertex.
TEST(ResultMesh, IsReadWithoutStates) {
  const SmallResult result;
  const std::string plain = result.folder / "plain.ply";
  ASSERT_TRUE(WriteMesh(plain, {SmallResult::MeshAt(0).vertices_mm, SmallResult::Faces()}).ok());
  const auto mesh = ReadCheckedMesh(plain, "");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->faces, SmallResult::Faces());
}

}  // namespace
}  // namespace weft
