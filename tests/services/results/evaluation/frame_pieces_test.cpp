#include "services/results/evaluation/frame_pieces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace weft
