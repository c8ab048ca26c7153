#include "services/results/report/read_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/formats/files/mesh_file.h"
#include "services/results/report/sequence_view.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

class ReadSequenceTest : public testing::Test {
 protected:
  // Two triangles apart from each other, `shift_mm` along x.
  void WriteMeshAt(const std::string& frame, double shift_mm, size_t vertices = 6) {
    RegisteredMesh mesh;
    for (const auto& [x, y] : {std::pair{0, 0}, {100, 0}, {0, 100}, {300, 0}, {400, 0}, {300, 100}})
      if (mesh.vertices_mm.size() < vertices) mesh.vertices_mm.emplace_back(x + shift_mm, y, 0);
    for (size_t v = 0; v < vertices; ++v) {
      mesh.state.push_back(static_cast<VertexState>(v % 5));
      mesh.sigma_mm.push_back(0.5F * static_cast<float>(v));
      mesh.views.push_back(3);
    }
    std::vector<Face> faces = {{0, 1, 2}};
    if (vertices == 6) faces.insert(faces.begin(), {3, 4, 5});
    std::filesystem::create_directories(folder_ / frame);
    ASSERT_TRUE(WriteRegisteredMesh(folder_ / (frame + "/mesh.ply"), mesh, faces).ok());
  }

  v1::FrameReport& AddFrameReport(const std::string& frame, v1::FrameState state = v1::FRAME_STATE_DONE) {
    v1::FrameReport& report = reports_.emplace_back();
    report.set_frame(frame), report.set_state(state);
    return report;
  }

  TempFolder folder_;
  std::vector<v1::FrameReport> reports_;
  std::vector<std::string> notes_;
};

TEST_F(ReadSequenceTest, VerticesHaveAByteOfEachColouring) {
  WriteMeshAt("1", 0);
  WriteMeshAt("2", 50);
  for (const char* frame : {"1", "2"}) AddFrameReport(frame);
  reports_[1].mutable_temporal()->set_bridged(true);
  const VertexValues known{"x",
                           "place",
                           "mm",
                           {0, 1000},
                           [](const std::string& frame, const std::vector<Eigen::Vector3d>& vertices_mm) {
                             std::vector<double> values;
                             for (const Eigen::Vector3d& vertex : vertices_mm) values.push_back(vertex.x());
                             if (frame == "2") values.pop_back();  // of another mesh
                             return values;
                           },
                           true};
  const v1::PageSequence sequence = ReadSequence(folder_.path(), reports_, {0, 2}, {known}, notes_);
  EXPECT_TRUE(notes_.empty());
  ASSERT_EQ(sequence.frames_size(), 2);
  ASSERT_EQ(sequence.vertices(), 6);
  ASSERT_EQ(sequence.colorings_size(), 3);
  EXPECT_EQ(sequence.colorings(0).name(), "state");
  EXPECT_EQ(sequence.colorings(1).name(), "sigma");
  EXPECT_EQ(sequence.colorings(1).key().scale().label(), "sigma");
  EXPECT_EQ(sequence.colorings(1).key().scale().unit(), "mm");
  EXPECT_EQ(sequence.colorings(1).key().scale().high(), 2);
  EXPECT_FALSE(sequence.colorings(1).first_shown());
  EXPECT_EQ(sequence.colorings(2).name(), "x");
  EXPECT_EQ(sequence.colorings(2).key().scale().label(), "place");
  EXPECT_TRUE(sequence.colorings(2).first_shown());
  const auto bytes_of = [&](int frame, size_t coloring) {
    const std::string bytes = sequence.frames(frame).bytes().substr(36 + 6 * coloring, 6);
    std::vector<int> values;
    for (const char c : bytes) values.push_back(static_cast<uint8_t>(c));
    std::ranges::sort(values);  // whatever order the vertices are kept in
    return values;
  };
  EXPECT_THAT(bytes_of(0, 0), ElementsAre(0, 0, 1, 2, 3, 4));
  EXPECT_THAT(bytes_of(0, 1), ElementsAre(0, 64, 127, 191, 254, 254)) << "0 to 2.5 mm of 2";
  EXPECT_THAT(bytes_of(0, 2), ElementsAre(0, 0, 25, 76, 76, 102));
  EXPECT_THAT(bytes_of(1, 2), testing::Each(255));
  EXPECT_EQ(sequence.frames(0).note(), "");
  EXPECT_EQ(sequence.frames(1).note(), "bridged");
  EXPECT_EQ(sequence.parts_size(), 0);
}

TEST_F(ReadSequenceTest, FacesAreSortedByGarment) {
  WriteMeshAt("1", 0);
  v1::MeshReport& mesh = *AddFrameReport("1").mutable_mesh();
  for (const char* id : {"shirt", "skirt"}) {
    v1::GarmentReport& garment = *mesh.add_garments();
    garment.set_id(id), garment.set_vertices(3);
  }
  const v1::PageSequence sequence = ReadSequence(folder_.path(), reports_, {0, 2}, {}, notes_);
  ASSERT_EQ(sequence.parts_size(), 2);
  EXPECT_EQ(sequence.parts(0).ShortDebugString(), "name: \"shirt\" faces: 1");
  EXPECT_EQ(sequence.parts(1).ShortDebugString(), "name: \"skirt\" faces: 1");
  ASSERT_EQ(sequence.faces().size(), 12u);
  // The first triangle has the vertices of the first garment, whose sigmas are below 1.5 mm.
  const std::string sigmas = sequence.frames(0).bytes().substr(36 + 6, 6);
  for (int corner = 0; corner < 3; ++corner)
    EXPECT_LT(static_cast<uint8_t>(sigmas[static_cast<uint8_t>(sequence.faces()[2 * corner])]), 190);
}

TEST_F(ReadSequenceTest, MeshesThatDoNotFitAreNoted) {
  WriteMeshAt("1", 0);
  WriteMeshAt("2", 0, 3);
  AddFrameReport("0");
  AddFrameReport("1");
  AddFrameReport("2");
  AddFrameReport("3", v1::FRAME_STATE_FAILED);
  AddFrameReport("4", v1::FRAME_STATE_DEGRADED);
  WriteMeshAt("4", 7);
  const v1::PageSequence sequence = ReadSequence(folder_.path(), reports_, {0, 2}, {}, notes_);
  ASSERT_EQ(sequence.frames_size(), 2);
  EXPECT_EQ(sequence.frames(0).name(), "1");
  EXPECT_EQ(sequence.frames(1).name(), "4");
  ASSERT_EQ(notes_.size(), 2u);
  EXPECT_THAT(notes_[0], testing::StartsWith("Frame 0 is missing in three dimensions: "));
  EXPECT_EQ(notes_[1], "Frame 2 is missing in three dimensions: " + folder_ / "2/mesh.ply" +
                           ": has 3 vertices, the frames before it 6");
}

// As `weft garment import` writes them.
TEST_F(ReadSequenceTest, WhatNobodyMeasuredHasNoStateAndNoSigma) {
  for (const char* frame : {"1", "2"}) {
    std::filesystem::create_directories(folder_ / frame);
    ASSERT_TRUE(WriteMesh(folder_ / (frame + std::string("/mesh.ply")),
                          {{{0, 0, 0}, {100, 0, 0}, {0, 100, 0}}, {{0, 1, 2}}})
                    .ok());
    AddFrameReport(frame);
  }
  const VertexValues known{
      "distance", "distance", "mm", {0, 1}, [](const auto&, const auto&) { return std::vector(3, 1.0); }};
  const v1::PageSequence sequence = ReadSequence(folder_.path(), reports_, {}, {known}, notes_);
  EXPECT_THAT(notes_, testing::IsEmpty());
  ASSERT_EQ(sequence.frames_size(), 2);
  ASSERT_EQ(sequence.colorings_size(), 1);
  EXPECT_EQ(sequence.colorings(0).name(), "distance");
  EXPECT_EQ(sequence.frames(1).bytes().substr(18), std::string(3, '\xfe'));
  // Beside measured ones its colours are those of what is unknown.
  WriteMeshAt("1", 0, 3);
  const v1::PageSequence mixed = ReadSequence(folder_.path(), reports_, {0, 2}, {known}, notes_);
  ASSERT_EQ(mixed.colorings_size(), 3);
  EXPECT_EQ(mixed.frames(1).bytes().substr(18), std::string(6, '\xff') + std::string(3, '\xfe'));
}

}  // namespace
}  // namespace weft
