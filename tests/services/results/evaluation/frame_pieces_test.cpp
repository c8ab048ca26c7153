#include "services/results/evaluation/frame_pieces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/files/listed_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

TEST(FramePieces, OnlyCamerasMeasure) {
  ResultMesh mesh;
  EXPECT_TRUE(mesh.Measured().empty());
  mesh.state = {VertexState::kObserved, VertexState::kTwoView, VertexState::kInferred, VertexState::kBridged,
                VertexState::kDriven};
  EXPECT_THAT(mesh.Measured(), ElementsAre(true, true, false, false, false));
}

TEST(FramePieces, FilesThatAreNotThereAreListed) {
  const TempFolder folder;
  const auto pieces = ReadFramePieces(folder.path());
  ASSERT_TRUE(pieces.ok()) << pieces.status();
  EXPECT_THAT(pieces->missing, UnorderedElementsAre("observations.csv", "cloud.ply", "mesh.ply"));
  EXPECT_FALSE(pieces->mesh.has_value());
  WriteBytes(folder / "mesh.ply", "no mesh");
  EXPECT_THAT(std::string(ReadFramePieces(folder.path()).status().message()), HasSubstr("mesh.ply"));
}

TEST(FramePieces, AFileIsAsTheReportListsIt) {
  const TempFolder folder;
  const std::string mesh =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  WriteBytes(folder / "mesh.ply", mesh);
  v1::FrameReport report;
  EXPECT_TRUE(ReadFramePieces(folder.path(), report)->mesh) << "reports of earlier versions list no files";
  v1::ResultFile& file = *report.add_files();
  file.set_name("mesh.ply");
  file.set_bytes(static_cast<int64_t>(mesh.size()));
  file.set_checksum(ListedChecksum(mesh));
  EXPECT_TRUE(ReadFramePieces(folder.path(), report)->mesh);
  WriteBytes(folder / "mesh.ply", mesh.substr(0, mesh.size() - 2) + "1\n");
  const absl::Status status = ReadFramePieces(folder.path(), report).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), HasSubstr(folder / "mesh.ply" + ": is not as report.json lists it"));
}

TEST(FramePieces, OfAFrameThatIsNotUsedThereIsNone) {
  EXPECT_THAT(NoFramePieces().missing, ElementsAre("observations.csv", "cloud.ply", "mesh.ply"));
}

}  // namespace
}  // namespace weft
