// PLY of an export, as our reader of the format gives it back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/files/ply.h"
#include "tests/services/results/export/small_result.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The file of frame `mesh`, read back.
Ply PlyOfFrame(SmallResult& result, size_t mesh, const std::vector<ExportAttribute>& attributes) {
  auto source = result.Source();
  EXPECT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kPly, attributes);
  const auto read = source->Read(mesh, ExportSource::Velocities::kComputed);
  EXPECT_TRUE(read.ok()) << read.status();
  const auto writer = MakePlyWriter(plan);
  const auto file = writer->FileOf(*read);
  EXPECT_TRUE(file.ok()) << file.status();
  EXPECT_LE(file->size(), writer->MaxFileBytes());
  const auto ply = ParsePly(*file, "frame.ply");
  EXPECT_TRUE(ply.ok()) << ply.status();
  return ply.ok() ? *ply : Ply();
}

std::vector<double> VertexColumn(const Ply& ply, const std::string& name) {
  const PlyElement* vertex = ply.Find("vertex");
  const PlyProperty* column = vertex == nullptr ? nullptr : vertex->Find(name);
  return column == nullptr ? std::vector<double>() : column->values;
}

TEST(PlyWriterTest, CarriesWhatWasAskedForAndNothingElse) {
  SmallResult result;
  const Ply plain = PlyOfFrame(result, 0, {});
  ASSERT_NE(plain.Find("vertex"), nullptr);
  EXPECT_EQ(plain.Find("vertex")->properties.size(), 3u);
  EXPECT_EQ(plain.Find("face")->properties.size(), 1u);
  const Ply ply = PlyOfFrame(result, 1,
                             {ExportAttribute::kVelocity, ExportAttribute::kState, ExportAttribute::kSigma,
                              ExportAttribute::kViews, ExportAttribute::kCoverage, ExportAttribute::kUv});
  EXPECT_THAT(VertexColumn(ply, "x"), ElementsAre(0, 100, 100, 0));
  EXPECT_THAT(VertexColumn(ply, "z"), ElementsAre(10, 10, 10, 10));
  // 20 mm over two frames at 10 a second.
  EXPECT_THAT(VertexColumn(ply, "vz"), ElementsAre(100, 100, 100, 100));
  EXPECT_THAT(VertexColumn(ply, "vx"), ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(VertexColumn(ply, "state"), ElementsAre(0, 2, 1, 1));
  EXPECT_THAT(VertexColumn(ply, "sigma"), ElementsAre(1.5, 0.5, 0.25, 0.25));
  EXPECT_THAT(VertexColumn(ply, "views"), ElementsAre(0, 2, 3, 3));
  EXPECT_THAT(VertexColumn(ply, "coverage"), ElementsAre(0, 1, 1, 1));
  EXPECT_THAT(VertexColumn(ply, "s"), ElementsAre(0, 1, 1, 0));
  EXPECT_THAT(VertexColumn(ply, "t"), ElementsAre(0, 0, 0.5, 0.5));
}

TEST(PlyWriterTest, FacesKeepTheirCornersAndTheirOrder) {
  SmallResult result;
  const Ply ply = PlyOfFrame(result, 2, {});
  const PlyProperty* corners = ply.Find("face")->Find("vertex_indices");
  ASSERT_NE(corners, nullptr);
  EXPECT_THAT(corners->values, ElementsAre(0, 1, 2, 0, 2, 3));
  EXPECT_THAT(corners->list_start, ElementsAre(0, 3, 6));
}

TEST(PlyWriterTest, CornersHavePlacesWhereTheVerticesAloneDoNotDo) {
  SmallResult result;
  MeshTexture texture = SmallResult::Texture();
  texture.of_corner = {{Eigen::Vector2f(0, 0), {1, 0}, {1, 0.5F}},
                       {Eigen::Vector2f(0, 0.75F), {1, 0.5F}, {0, 0.5F}}};
  for (int frame = 0; frame < SmallResult::kFrames; ++frame)
    ASSERT_TRUE(
        WriteRegisteredMesh(result.MeshFile(frame), SmallResult::MeshAt(frame), SmallResult::Faces(), texture)
            .ok());
  const Ply ply = PlyOfFrame(result, 0, {ExportAttribute::kUv});
  const PlyProperty* places = ply.Find("face")->Find("texcoord");
  ASSERT_NE(places, nullptr);
  EXPECT_THAT(places->values, ElementsAre(0, 0, 1, 0, 1, 0.5, 0, 0.75, 1, 0.5, 0, 0.5));
  EXPECT_EQ(PlyOfFrame(result, 0, {}).Find("face")->Find("texcoord"), nullptr);
}

TEST(PlyWriterTest, SaysWhatTheNumbersOfStatesMean) {
  SmallResult result;
  const Ply ply = PlyOfFrame(result, 0, {ExportAttribute::kState});
  ASSERT_EQ(ply.comments.size(), 2u);
  EXPECT_THAT(ply.comments[1], HasSubstr("0 inferred, 1 observed, 2 by two views"));
}

// 45 bytes a vertex with all attributes, 38 a face with its places, and 2 KiB of header.
TEST(PlyWriterTest, RoomIsThatOfAllAttributes) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kPly, {});
  EXPECT_EQ(MakePlyWriter(plan)->MaxFileBytes(), 2048u + 4 * 45 + 2 * 38);
}

TEST(PlyWriterTest, CommentsSayWhatTheNumbersAre) {
  SmallResult result;
  EXPECT_THAT(PlyOfFrame(result, 0, {}).comments,
              ElementsAre("written by weft export; units and axes stand in export.json",
                          "state 0 inferred, 1 observed, 2 by two views, 3 bridged, 4 driven"));
}

}  // namespace
}  // namespace weft
