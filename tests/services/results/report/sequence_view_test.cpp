#include "services/results/report/sequence_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace weft {
namespace {

using ::testing::ElementsAre;

SequenceFrame FrameOf(const std::string& name, float shift) {
  return {name,
          "",
          {{shift, 100, 1200}, {shift + 300, 100, 1200}, {shift, 600.5f, 1200}},
          {{1, 0, 2}, {0, 254, 255}}};
}

v1::PageSequence Triangle() { return BeginSequence({{4, 7, 9}, {{0, 1, 2}}}, Viewpoint()); }

TEST(SequenceView, PositionsComeBackToSixteenBits) {
  v1::PageSequence sequence = Triangle();
  AddFrame(FrameOf("0001", 0), sequence);
  AddFrame(FrameOf("0002", 41.7f), sequence);
  const v1::PageSequence::Frame& second = sequence.frames(1);
  EXPECT_NEAR(second.step_mm(), 500.5 / 65535, 1e-9);
  ASSERT_EQ(second.bytes().size(), 3u * 6 + 2 * 3);
  std::array<uint16_t, 9> words{};
  std::memcpy(words.data(), second.bytes().data(), sizeof(words));
  // Relative to the mean of the frame's vertices.
  const std::vector<Eigen::Vector3f> given = FrameOf("", 41.7f).vertices_mm;
  const Eigen::Vector3f mean = (given[0] + given[1] + given[2]) / 3;
  for (int v = 0; v < 3; ++v)
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(words[3 * v + axis] * second.step_mm() - second.center_mm(axis), (given[v] - mean)[axis],
                  0.5 * second.step_mm() + 1e-4);
  EXPECT_EQ(second.bytes().substr(18), std::string("\x01\x00\x02\x00\xfe\xff", 6));
}

TEST(SequenceView, FacesAndFramesAreTold) {
  v1::PageSequence sequence = Triangle();
  AddFrame(FrameOf("0001", 0), sequence);
  SequenceFrame bridged = FrameOf("<b>", 1);
  bridged.note = "bridged";
  AddFrame(bridged, sequence);
  AddFrame({}, sequence);
  EXPECT_EQ(sequence.faces(), std::string("\x00\x00\x01\x00\x02\x00", 6));
  EXPECT_EQ(sequence.vertices(), 3);
  ASSERT_EQ(sequence.frames_size(), 2);
  EXPECT_EQ(sequence.frames(1).name() + sequence.frames(1).note(), "<b>bridged");
  EXPECT_GT(sequence.radius_mm(), 100);
  EXPECT_THAT(sequence.up(), ElementsAre(0, -1, 0));
}

Eigen::Vector3f ColorAt(const v1::PageSequence::Coloring& coloring, uint8_t index) {
  Eigen::Vector3f color;
  for (int c = 0; c < 3; ++c)
    color[c] = static_cast<float>(static_cast<uint8_t>(coloring.palette()[3 * index + c])) / 255;
  return color;
}

TEST(SequenceView, PalettesAreTheColoursOfThePictures) {
  const v1::PageSequence::Coloring states = ColoringByState();
  ASSERT_EQ(states.palette().size(), 768u);
  for (const VertexState state : {VertexState::kObserved, VertexState::kBridged, VertexState::kDriven})
    EXPECT_LT((ColorAt(states, static_cast<uint8_t>(state)) - StateColor(state)).norm(), 0.01);
  EXPECT_LT((ColorAt(states, 200) - UnknownColor()).norm(), 0.01);
  const v1::PageSequence::Coloring sigma = ColoringByValue("sigma", "sigma", "mm", {0, 2});
  ASSERT_EQ(sigma.palette().size(), 768u);
  for (const double value : {0.0, 0.7, 1.3, 2.0, 5.0})
    EXPECT_LT((ColorAt(sigma, PaletteIndex(value, {0, 2})) - ScalarColors({value}, {0, 2})[0]).norm(), 0.015)
        << value;
  const uint8_t none = PaletteIndex(std::numeric_limits<double>::quiet_NaN(), {0, 2});
  EXPECT_LT((ColorAt(sigma, none) - UnknownColor()).norm(), 0.01);
}

TEST(SequenceView, LongTakesAreThinnedSoThatPagesOpenAtOnce) {
  EXPECT_THAT(SequenceFrames(3), ElementsAre(0, 1, 2));
  const std::vector<size_t> shown = SequenceFrames(5000);
  ASSERT_EQ(shown.size(), 300u);
  EXPECT_EQ(shown.front(), 0u);
  EXPECT_EQ(shown.back(), 4999u);
  for (size_t i = 1; i < shown.size(); ++i) EXPECT_NEAR(shown[i] - shown[i - 1], 4999 / 299.0, 1);
  for (const size_t frames : {1, 20, 100, 300, 5000}) {
    for (const size_t colorings : {2, 5}) {
      const size_t vertices = SequenceVertices(frames, colorings);
      EXPECT_LE(vertices, 65'536u);
      EXPECT_GE(vertices, 5'000u);
      EXPECT_LT(4.0 / 3 * vertices * (6 + colorings) * std::min<size_t>(frames, 300), 25e6);
    }
  }
}

TEST(SequenceView, SizesOfPagesAreFixed) {
  EXPECT_EQ(SequenceVertices(0, 2), 16'000u);
  EXPECT_EQ(SequenceVertices(140, 2), 16'000u);
  EXPECT_EQ(SequenceVertices(150, 2), 15'000u) << "18 MB of 150 frames with 8 bytes a vertex";
  EXPECT_EQ(SequenceVertices(300, 2), 7'500u);
  EXPECT_EQ(SequenceVertices(301, 2), 7'500u) << "no more frames are shown";
  EXPECT_EQ(SequenceVertices(300, 4), 6'000u);
  EXPECT_EQ(SequenceFrames(300).size(), 300u);
  EXPECT_EQ(SequenceFrames(300)[299], 299u);
  EXPECT_EQ(SequenceFrames(301).size(), 300u);
  EXPECT_EQ(SequenceFrames(301)[299], 300u);
  EXPECT_EQ(SequenceFrames(301)[1], 1u);
}

TEST(SequenceView, FramesKnowTheirMiddleAndTheSequenceItsRadius) {
  v1::PageSequence sequence = Triangle();
  AddFrame(FrameOf("1", 0), sequence);
  // Corners at (0, 100), (300, 100) and (0, 600.5); their mean is at (100, 266.83).
  ASSERT_EQ(sequence.frames(0).center_mm_size(), 3);
  EXPECT_NEAR(sequence.frames(0).center_mm(0), 100, 1e-4);
  EXPECT_NEAR(sequence.frames(0).center_mm(1), 500.5 / 3, 1e-4);
  EXPECT_NEAR(sequence.frames(0).center_mm(2), 0, 1e-4);
  EXPECT_NEAR(sequence.radius_mm(), std::hypot(100, 2 * 500.5 / 3), 1e-4);
  AddFrame({"2", "", {{7, 8, 9}}, {{1}}}, sequence);
  EXPECT_EQ(sequence.frames(1).step_mm(), 1) << "a point has no extent";
  EXPECT_NEAR(sequence.radius_mm(), std::hypot(100, 2 * 500.5 / 3), 1e-4) << "of the largest frame";
  EXPECT_THAT(sequence.right(), ElementsAre(1, 0, 0));
}

TEST(SequenceView, PalettesHaveAnEntryForEachPartOfTheRange) {
  EXPECT_EQ(PaletteIndex(1, {0, 2}), 127);
  EXPECT_EQ(PaletteIndex(3, {1, 5}), 127);
  EXPECT_EQ(PaletteIndex(-1, {0, 2}), 0);
  EXPECT_EQ(PaletteIndex(9, {0, 2}), 254);
  EXPECT_EQ(PaletteIndex(2.5, {2, 2}), 127) << "a range without extent is one";
  const v1::PageSequence::Coloring states = ColoringByState();
  EXPECT_EQ(states.name(), "state");
  EXPECT_EQ(states.key().entries_size(), 5);
  EXPECT_LT((ColorAt(states, 4) - StateColor(VertexState::kDriven)).norm(), 0.01);
  EXPECT_LT((ColorAt(states, 5) - UnknownColor()).norm(), 0.01);
  const v1::PageSequence::Coloring values = ColoringByValue("a", "b", "c", {0, 2});
  EXPECT_EQ(values.name() + values.key().scale().label() + values.key().scale().unit(), "abc");
  EXPECT_LT((ColorAt(values, 254) - MapColor(1)).norm(), 0.01);
  EXPECT_LT((ColorAt(values, 127) - MapColor(0.5)).norm(), 0.01);
}

}  // namespace
}  // namespace weft
