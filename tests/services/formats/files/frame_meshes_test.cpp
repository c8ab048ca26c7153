#include "services/formats/files/frame_meshes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

namespace weft {
namespace {

using testing::HasSubstr;

void AddMesh(v1::FrameReport& report, const std::string& name, const std::string& topology = "00") {
  v1::FrameMesh& mesh = *report.add_meshes();
  mesh.set_name(name);
  mesh.set_file(MeshFileName(name));
  mesh.set_topology_hash(topology);
}

v1::FrameReport FrameWith(const std::string& frame, const std::vector<std::string>& meshes) {
  v1::FrameReport report;
  report.set_frame(frame);
  for (const std::string& name : meshes) AddMesh(report, name);
  return report;
}

std::string Chosen(const std::vector<v1::FrameReport>& reports, const std::string& name) {
  const absl::StatusOr<std::string> chosen = ChooseMesh(reports, name);
  return chosen.ok() ? *chosen : std::string(chosen.status().message());
}

TEST(FrameMeshes, TheGarmentIsMeshPlyAndOthersHaveTheirNames) {
  EXPECT_EQ(MeshFileName("garment"), "mesh.ply");
  EXPECT_EQ(MeshFileName("body"), "body.ply");
}

TEST(FrameMeshes, NamesAreNoPathsAndNoOtherFiles) {
  for (const char* name : {"garment", "body", "shirt-2", "under_shirt"})
    EXPECT_TRUE(CheckMeshName(name).ok()) << name;
  for (const char* name : {"", "Shirt", "2nd", "a/b", "..", "a b", "mesh", "cloud", "unrefined"})
    EXPECT_EQ(CheckMeshName(name).code(), absl::StatusCode::kInvalidArgument) << name;
  EXPECT_FALSE(CheckMeshName(std::string(33, 'a')).ok());
}

TEST(FrameMeshes, TheTopologyIsOfVerticesAndFacesAlone) {
  const std::vector<Face> faces = {{0, 1, 2}}, turned = {{0, 2, 1}};
  EXPECT_EQ(TopologyHash(3, faces), TopologyHash(3, faces));
  EXPECT_NE(TopologyHash(3, faces), TopologyHash(4, faces));
  EXPECT_NE(TopologyHash(3, faces), TopologyHash(3, turned));
  EXPECT_EQ(TopologyHash(3, faces).size(), 16u);
}

TEST(FrameMeshes, ReportsOfEarlierVersionsHaveTheGarment) {
  v1::FrameReport report;
  EXPECT_TRUE(MeshesOf(report)->empty());
  report.add_files()->set_name("mesh.ply");
  ASSERT_EQ(MeshesOf(report)->size(), 1u);
  EXPECT_EQ(MeshesOf(report)->front().name(), "garment");
  AddMesh(report, "body");
  EXPECT_EQ(MeshesOf(report)->size(), 2u);
}

TEST(FrameMeshes, ListsThatAreWrongSayWhy) {
  EXPECT_THAT(MeshesOf(FrameWith("7", {"body", "body"})).status().message(),
              HasSubstr("frame 7: two meshes have the name body"));
  EXPECT_THAT(MeshesOf(FrameWith("7", {"../body"})).status().message(), HasSubstr("is no name of a mesh"));
  v1::FrameReport elsewhere = FrameWith("7", {"body"});
  elsewhere.mutable_meshes(0)->set_file("job.json");
  EXPECT_THAT(MeshesOf(elsewhere).status().message(), HasSubstr("in another file than body.ply"));
}

TEST(FrameMeshes, WithoutANameItIsTheGarmentOrTheOnlyOne) {
  EXPECT_EQ(Chosen({FrameWith("1", {})}, ""), "garment");
  EXPECT_EQ(Chosen({FrameWith("1", {}), FrameWith("2", {"body"})}, ""), "body");
  EXPECT_EQ(Chosen({FrameWith("1", {"body", "garment"})}, ""), "garment");
  EXPECT_EQ(Chosen({FrameWith("1", {"body", "garment"})}, "body"), "body");
  EXPECT_THAT(Chosen({FrameWith("1", {"shirt"}), FrameWith("2", {"body"})}, ""),
              HasSubstr("several meshes: body, shirt; name one"));
  EXPECT_THAT(Chosen({FrameWith("1", {"shirt", "body"})}, "hat"),
              HasSubstr("no frame has a mesh \"hat\"; there are body, shirt"));
  EXPECT_THAT(Chosen({FrameWith("1", {})}, "hat"), HasSubstr("\"hat\"; none has any"));
}

TEST(FrameMeshes, AFrameOfAnotherTopologyIsNamed) {
  std::vector<v1::FrameReport> reports = {FrameWith("1", {"body"}), FrameWith("2", {}),
                                          FrameWith("3", {"body"})};
  EXPECT_EQ(Chosen(reports, "body"), "body");
  reports[2].mutable_meshes(0)->set_topology_hash("11");
  EXPECT_THAT(Chosen(reports, "body"), HasSubstr("frame 3: its mesh body has other vertices or faces than "
                                                 "that of frame 1 (topology 11, before 00)"));
}

}  // namespace
}  // namespace weft
