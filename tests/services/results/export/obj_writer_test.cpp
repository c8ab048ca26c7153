// Wavefront OBJ, written out by hand from the format's description.
#include <gtest/gtest.h>

#include "tests/services/results/export/small_result.h"

namespace weft {
namespace {

constexpr char kObjStart[] = "# written by weft export; units and axes stand in export.json\no garment\n";

TEST(ObjWriterTest, NumbersVerticesAndPlacesFromOne) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kObj, {ExportAttribute::kUv});
  const auto mesh = source->Read(1, ExportSource::Velocities::kLeftOut);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const auto file = MakeObjWriter(plan)->FileOf(*mesh);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(*file, std::string(kObjStart) +
                       "v 0 0 10\nv 100 0 10\nv 100 50 10\nv 0 50 10\n"
                       "vt 0 0\nvt 1 0\nvt 1 0.5\nvt 0 0.5\n"
                       "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n");
}

TEST(ObjWriterTest, LeavesPlacesOutWhereTheyAreNotAskedFor) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kObj, {});
  const auto mesh = source->Read(0, ExportSource::Velocities::kLeftOut);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(*MakeObjWriter(plan)->FileOf(*mesh),
            std::string(kObjStart) + "v 0 0 0\nv 100 0 0\nv 100 50 0\nv 0 50 0\nf 1 2 3\nf 1 3 4\n");
}

// Position and place of a corner have numbers of their own: no vertex is repeated at a seam.
TEST(ObjWriterTest, AVertexOnASeamHasAPlaceForEachSide) {
  const SmallResult result;
  MeshTexture texture = SmallResult::Texture();
  texture.of_corner = {{Eigen::Vector2f(0, 0), {1, 0}, {1, 0.5F}},
                       {Eigen::Vector2f(0, 0.75F), {1, 0.5F}, {0, 0.5F}}};
  for (int frame = 0; frame < SmallResult::kFrames; ++frame)
    ASSERT_TRUE(
        WriteRegisteredMesh(result.MeshFile(frame), SmallResult::MeshAt(frame), SmallResult::Faces(), texture)
            .ok());
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kObj, {ExportAttribute::kUv});
  const auto mesh = source->Read(0, ExportSource::Velocities::kLeftOut);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(*MakeObjWriter(plan)->FileOf(*mesh), std::string(kObjStart) +
                                                     "v 0 0 0\nv 100 0 0\nv 100 50 0\nv 0 50 0\n"
                                                     "vt 0 0\nvt 1 0\nvt 1 0.5\nvt 0 0.5\nvt 0 0.75\n"
                                                     "f 1/1 2/2 3/3\nf 1/5 3/3 4/4\n");
}

TEST(ObjWriterTest, RoomIsReservedForTheLongestNumbers) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kObj, {ExportAttribute::kUv});
  const auto writer = MakeObjWriter(plan);
  ExportMesh mesh;
  mesh.positions.assign(4, Eigen::Vector3f::Constant(-1.2345678e-05F));
  const auto file = writer->FileOf(mesh);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_LE(file->size(), writer->MaxFileBytes());
}

// The header with its end, 50 bytes a vertex, and what all frames have in common.
TEST(ObjWriterTest, RoomIsThatOfItsParts) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kObj, {});
  EXPECT_EQ(MakeObjWriter(plan)->MaxFileBytes(), sizeof kObjStart + 4 * 50 + 16);
}

}  // namespace
}  // namespace weft
