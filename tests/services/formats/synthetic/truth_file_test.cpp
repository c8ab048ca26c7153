#include "services/formats/synthetic/truth_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

FrameTruth TruthOfTriangle() {
  FrameTruth truth;
  truth.mesh = {{{0, 0, 0}, {10, 0, 0}, {0, 10, 0}}, {{0, 1, 2}}};
  for (const char* camera : {"c2", "c1"}) {
    ViewTruth& view = truth.views.emplace_back();
    view.camera_id = camera;
    NodeTruth& node = view.nodes.emplace_back();
    node.vertex = 2;
  }
  return truth;
}

TEST(TruthFile, BrokenBytesAreNamed) {
  ViewTruth truth{"c", {}};
  truth.nodes.resize(2);
  truth.nodes[1].node = {3, 40000, NodeKind::kCorner};
  truth.nodes[1].pixel_px = {-0.5, 4095.1234};
  const std::string bytes = EncodeViewTruth(truth);
  const auto read = DecodeViewTruth(bytes, "c", "t");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->nodes[1].node, truth.nodes[1].node);
  EXPECT_LT((read->nodes[1].pixel_px - truth.nodes[1].pixel_px).norm(), 1e-9);
  const auto message = [](const std::string& broken) {
    const auto out = DecodeViewTruth(broken, "c", "t.truth");
    EXPECT_EQ(out.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(out.status().message());
  };
  EXPECT_NE(message("kind,row\n").find("t.truth: is not a view's truth"), std::string::npos);
  EXPECT_NE(message(bytes.substr(0, bytes.size() - 1)).find("truncated"), std::string::npos);
  EXPECT_NE(message(bytes + "x").find("bytes for 2 nodes"), std::string::npos);
  EXPECT_NE(message(bytes.substr(0, 9)).find("ends before"), std::string::npos);
  std::string flags = bytes;
  flags[12] = 8;
  EXPECT_NE(message(flags).find("node 0: flags"), std::string::npos);
}

TEST(TruthFile, NumbersAreRoundedToTheirStepsAndHeldToTheirRange) {
  ViewTruth truth{"c", {}};
  NodeTruth& node = truth.nodes.emplace_back();
  node.node = {1, 2, NodeKind::kCenter};
  node.pixel_px = {12.34567, -1e9};
  node.pitch_px = 2.503;     // 640.768 steps of 1/256
  node.facing_deg = 12.346;  // 1234.6 steps of 0.01
  node.visible = true;
  node.vertex = -1;
  const auto read = DecodeViewTruth(EncodeViewTruth(truth), "c", "t");
  ASSERT_TRUE(read.ok()) << read.status();
  const NodeTruth& back = read->nodes.at(0);
  EXPECT_DOUBLE_EQ(back.pixel_px.x(), 12.3457);
  EXPECT_DOUBLE_EQ(back.pixel_px.y(), -214748.3648);
  EXPECT_EQ(back.pitch_px, 641.0 / 256);
  EXPECT_DOUBLE_EQ(back.facing_deg, 12.35);
  EXPECT_TRUE(back.visible);
  EXPECT_FALSE(back.scoreable);
  EXPECT_EQ(back.vertex, -1);
}

TEST(TruthFile, ViewsOfAFrameComeInTheOrderOfTheirCameras) {
  const TempFolder folder;
  ASSERT_TRUE(WriteFrameTruth(folder / "truth/0000", TruthOfTriangle()).ok());
  const auto read = ReadFrameTruth(folder / "truth/0000");
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->views.size(), 2u);
  EXPECT_EQ(read->views[0].camera_id, "c1");
  EXPECT_EQ(read->views[1].camera_id, "c2");
  EXPECT_EQ(read->mesh.faces, TruthOfTriangle().mesh.faces);
}

TEST(TruthFile, NamesAFileWhoseVertexTheMeshLacks) {
  const TempFolder folder;
  FrameTruth truth = TruthOfTriangle();
  truth.views[0].nodes[0].vertex = 3;
  ASSERT_TRUE(WriteFrameTruth(folder / "0000", truth).ok());
  const absl::Status status = ReadFrameTruth(folder / "0000").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(),
              AllOf(HasSubstr(folder / "0000/c2.truth"), HasSubstr("names vertex 3, mesh.ply has 3")));
}

TEST(TruthFile, AFrameWithoutViewsIsNoTruth) {
  const TempFolder folder;
  FrameTruth truth = TruthOfTriangle();
  truth.views.clear();
  ASSERT_TRUE(WriteFrameTruth(folder / "0000", truth).ok());
  EXPECT_EQ(ReadFrameTruth(folder / "0000").status().code(), absl::StatusCode::kNotFound);
}

// A data set has its template beside the frames, with a mesh.ply of its own.
TEST(TruthFile, FramesAreFoldersWithAMeshAndNoTemplate) {
  const TempFolder folder;
  EXPECT_EQ(ListTruthFrames(folder / "truth").status().code(), absl::StatusCode::kNotFound);
  for (const char* frame : {"0001", "0000", "template"})
    ASSERT_TRUE(WriteFrameTruth(folder / ("truth/" + std::string(frame)), TruthOfTriangle()).ok());
  WriteBytes(folder / "truth/template/template.json", "{}");
  WriteBytes(folder / "truth/notes/text", "x");
  const auto frames = ListTruthFrames(folder / "truth");
  ASSERT_TRUE(frames.ok()) << frames.status();
  EXPECT_THAT(*frames, ElementsAre("0000", "0001"));
}

}  // namespace
}  // namespace weft
