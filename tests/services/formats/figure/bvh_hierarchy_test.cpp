#include "services/formats/figure/bvh_hierarchy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

absl::StatusOr<BvhHierarchy> HierarchyOf(const std::string& file) {
  BvhText text(file);
  return ReadBvhHierarchy(text);
}

std::string FaultOf(const std::string& file) {
  const absl::StatusOr<BvhHierarchy> read = HierarchyOf(file);
  EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << file;
  return std::string(read.status().message());
}

TEST(BvhHierarchyTest, JointsAreReadDepthFirstWithTheirChannelsInOrder) {
  BvhText text(
      "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n CHANNELS 3 Xposition Zrotation Yrotation\n"
      " JOINT Left Arm\n {\n  OFFSET 1 -2 3.5\n  CHANNELS 0\n  End Site\n  {\n   OFFSET 0 5 0\n  }\n }\n"
      " JOINT Right Arm { OFFSET -1 -2 3.5 CHANNELS 1 XROTATION }\n}\nMOTION\nFrames: 1\n");
  const auto read = ReadBvhHierarchy(text);
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->joints.size(), 4u);
  EXPECT_EQ(read->joints[0].name, "Hips");
  EXPECT_EQ(read->joints[0].parent, -1);
  EXPECT_EQ(read->joints[1].name, "Left Arm");
  EXPECT_EQ(read->joints[1].offset, Eigen::Vector3d(1, -2, 3.5));
  EXPECT_EQ(read->joints[2].name, "");
  EXPECT_EQ(read->joints[2].parent, 1);
  EXPECT_EQ(read->joints[3].parent, 0);
  EXPECT_THAT(read->channels[0],
              ElementsAre(BvhChannel::kXPosition, BvhChannel::kZRotation, BvhChannel::kYRotation));
  EXPECT_THAT(read->channels[1], IsEmpty());
  EXPECT_THAT(read->channels[3], ElementsAre(BvhChannel::kXRotation));
  EXPECT_EQ(read->numbers, 4u);
  EXPECT_THAT(read->notes, IsEmpty());
  EXPECT_EQ(text.Peek(), "Frames");  // MOTION is taken
}

TEST(BvhHierarchyTest, NamesOfChannelsCountAndTheirNumberIsChecked) {
  const auto more = HierarchyOf("HIERARCHY ROOT a\n{ OFFSET 0 0 0 CHANNELS 1 Xrotation Yrotation }");
  ASSERT_TRUE(more.ok()) << more.status();
  EXPECT_EQ(more->numbers, 2u);
  EXPECT_THAT(more->notes, ElementsAre("\"a\" has 2 channels where CHANNELS says 1; all were read"));
  EXPECT_THAT(
      FaultOf("HIERARCHY ROOT a\n{\nCHANNELS 3 Xrotation Yrotation Wrotation\n}"),
      AllOf(HasSubstr("line 3"), HasSubstr("CHANNELS says 3, but has 2 names; \"Wrotation\" is no channel")));
  EXPECT_THAT(FaultOf("HIERARCHY ROOT a\n{\nCHANNELS 2 Xrotation xrotation\n}"),
              HasSubstr("channel xrotation stands twice at a joint"));
}

TEST(BvhHierarchyTest, WhatIsMissingOrTooMuchIsNamed) {
  EXPECT_THAT(FaultOf("ROOT a { }"), HasSubstr("does not begin with HIERARCHY"));
  EXPECT_THAT(FaultOf("HIERARCHY MOTION"), HasSubstr("has no ROOT"));
  EXPECT_THAT(FaultOf("HIERARCHY JOINT a { }"), HasSubstr("expected ROOT or MOTION, found \"JOINT\""));
  EXPECT_THAT(FaultOf("HIERARCHY\nROOT a\n{\n}\nROOT b\n{\n}\n"),
              AllOf(HasSubstr("line 5"), HasSubstr("a second ROOT, \"b\"")));
  EXPECT_THAT(FaultOf("HIERARCHY ROOT a\n{ JOINT b\n{ }\nMOTION"), HasSubstr("a closing brace is missing"));
  EXPECT_THAT(FaultOf("HIERARCHY ROOT a\n{ SCALE 1 }"),
              HasSubstr("expected OFFSET, CHANNELS, JOINT, End Site or }, found \"SCALE\""));
  EXPECT_THAT(FaultOf("HIERARCHY ROOT a\n{ JOINT\n{ } }"), HasSubstr("a JOINT without a name"));
  EXPECT_THAT(FaultOf("HIERARCHY ROOT a\n{ OFFSET 0 x 0 }"), HasSubstr("\"x\" is no number"));
}

TEST(BvhHierarchyTest, NoFileMakesMoreJointsThanPeopleHave) {
  std::string file = "HIERARCHY ROOT a\n{\n";
  for (int i = 0; i < 4095; ++i) file += "JOINT b\n{ }\n";
  EXPECT_TRUE(HierarchyOf(file + "}").ok());
  EXPECT_THAT(FaultOf(file + "JOINT b\n{ }\n}"), HasSubstr("more than 4096 joints"));
}

}  // namespace
}  // namespace weft
