#include "services/formats/figure/bvh_file.h"

#include <gtest/gtest.h>

#include <cctype>

#include "base/angles.h"

namespace weft {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

const std::string kSmall = R"(HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0.5 10 -0.25
    CHANNELS 3 Yrotation Xrotation Zrotation
    End Site
    {
      OFFSET 0 12 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.02
1 90 2 10 20 30 0 0 0
1 91 2 0 0 0 40 50 60
)";

std::string With(const std::string& what, const std::string& instead) {
  std::string out = kSmall;
  out.replace(out.find(what), what.size(), instead);
  return out;
}

TEST(BvhFile, ReadsHierarchyAndChannelsInTheirOrder) {
  const absl::StatusOr<ForeignMotion> motion = ParseBvh(kSmall, "a.bvh");
  ASSERT_TRUE(motion.ok()) << motion.status();
  EXPECT_NEAR(motion->fps, 50, 1e-3);
  ASSERT_EQ(motion->joints.size(), 3u);
  EXPECT_EQ(motion->joints[0].name, "Hips");
  EXPECT_EQ(motion->joints[1].name, "Spine");
  EXPECT_EQ(motion->joints[1].parent, 0);
  EXPECT_LT((motion->joints[1].offset - Vector3d(0.5, 10, -0.25)).norm(), 1e-6);
  EXPECT_LT((motion->joints[2].offset - Vector3d(0, 12, 0)).norm(), 1e-6);
  ASSERT_EQ(motion->poses.size(), 2u);
  EXPECT_LT((motion->poses[1].place[0] - Vector3d(1, 91, 2)).norm(), 1e-5);
  const auto about = [](double degrees, const Vector3d& axis) {
    return AngleAxisd(kRadPerDeg * degrees, axis);
  };
  const Eigen::Quaterniond hips =
      about(10, Vector3d::UnitZ()) * about(20, Vector3d::UnitX()) * about(30, Vector3d::UnitY());
  const Eigen::Quaterniond spine =
      about(40, Vector3d::UnitY()) * about(50, Vector3d::UnitX()) * about(60, Vector3d::UnitZ());
  EXPECT_LT(motion->poses[0].rotation[0].angularDistance(hips), 1e-5);
  EXPECT_LT(motion->poses[1].rotation[1].angularDistance(spine), 1e-5);
}

void ExpectSame(const std::string& bytes, const std::string& what) {
  const absl::StatusOr<ForeignMotion> expected = ParseBvh(kSmall, "a.bvh"), motion = ParseBvh(bytes, what);
  ASSERT_TRUE(motion.ok()) << motion.status();
  ASSERT_EQ(motion->joints.size(), expected->joints.size()) << what;
  ASSERT_EQ(motion->poses.size(), expected->poses.size()) << what;
  for (size_t k = 0; k < motion->poses.size(); ++k) {
    const ForeignPosture a = PostureOf(*motion, motion->poses[k]),
                         b = PostureOf(*expected, expected->poses[k]);
    for (size_t j = 0; j < a.at.size(); ++j) {
      EXPECT_LT((a.at[j] - b.at[j]).norm(), 1e-9) << what;
      EXPECT_LT(a.rotation[j].angularDistance(b.rotation[j]), 1e-9) << what;
    }
  }
}

std::string Replaced(std::string text, const std::string& what, const std::string& instead) {
  for (size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += instead.size())
    text.replace(at, what.size(), instead);
  return text;
}

std::string InLowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(c));
  return text;
}

// As other importers read them.
TEST(BvhFile, ReadsTheSpellingsOfOtherPrograms) {
  ExpectSame("\xef\xbb\xbf" + kSmall, "byte order mark");
  ExpectSame(With("JOINT Spine", "JOINT Bip01 L  Spine"), "name with blanks");
  ExpectSame(Replaced(kSmall, "\n", "\r\n"), "CRLF");
  ExpectSame(Replaced(kSmall, "\n", "\r"), "CR");
  ExpectSame(Replaced(kSmall, " ", "\t"), "tabs");
  ExpectSame(Replaced(kSmall, "\n", " \n\n"), "empty lines");
  ExpectSame(InLowerCase(kSmall), "lower case");
  ExpectSame(Replaced(kSmall, ": ", ":"), "no blank after the colon");
  ExpectSame(Replaced(kSmall, ": ", " : "), "a blank before the colon");
  ExpectSame(With("End Site", "End Site SpineTip"), "named end");
  ExpectSame(With("End Site", "EndSite"), "EndSite");
  ExpectSame(With("Hips\n{", "Hips {"), "brace behind the name");
  ExpectSame(With("90", "+9.0e1"), "sign and exponent");
  ExpectSame(With("CHANNELS 3", "CHANNELS 2"), "more channels than their number");
  ExpectSame(With("30 0 0 0", "30 1e-400 0 0"), "a number too small for a double");
  ExpectSame(kSmall + "\n\n", "empty lines at the end");
  ExpectSame(kSmall.substr(0, kSmall.size() - 1), "no end of the last line");
}

TEST(BvhFile, ChannelsMayBeMissingOrPositions) {
  // No channels: always at rest.
  const std::string still =
      Replaced(Replaced(With("    CHANNELS 3 Yrotation Xrotation Zrotation\n", ""), "30 0 0 0\n", "30\n"),
               " 40 50 60", "");
  const absl::StatusOr<ForeignMotion> motion = ParseBvh(still, "still");
  ASSERT_TRUE(motion.ok()) << motion.status();
  EXPECT_EQ(motion->poses[1].rotation[1].w(), 1);
  // A position is where a joint is, as most programs write it; near zero it is added to the offset.
  const std::string chain =
      "HIERARCHY\nROOT A\n{\nOFFSET 1 2 3\nCHANNELS 6 Xposition Yposition Zposition Xscale Yscale Zscale\n"
      "JOINT B\n{\nOFFSET 0 10 0\nJOINT C\n{\nOFFSET 0 12 0\nCHANNELS 2 Yposition Zposition\n}\n}\n}\n"
      "MOTION\nFrames: 2\nFrame Time: 0.02\n";
  const auto tip = [&](const std::string& rows) {
    const absl::StatusOr<ForeignMotion> read = ParseBvh(chain + rows, "chain");
    EXPECT_TRUE(read.ok()) << read.status();
    return PostureOf(*read, read->poses[1]).at[2];
  };
  EXPECT_LT((tip("0 90 0 1 1 1 12 0\n0 91 0 1 1 1 12.5 1\n") - Vector3d(0, 113.5, 1)).norm(), 1e-9);
  EXPECT_LT((tip("0 90 0 1 1 1 0 0\n0 91 0 1 1 1 0.5 1\n") - Vector3d(0, 113.5, 1)).norm(), 1e-9);
  // A joint's size counts for all that hangs on it.
  EXPECT_LT((tip("0 90 0 2 2 2 12 0\n0 91 0 2 2 2 12.5 1\n") - Vector3d(0, 136, 2)).norm(), 1e-9);
  EXPECT_NE(
      ParseBvh(chain + "0 90 0 1 1 1 12 0\n0 91 0 1 2 1 12 0\n", "chain").status().message().find("scale"),
      std::string::npos);
}

TEST(BvhFile, ReadsMoreRowsThanItSaysAndNotesIt) {
  const absl::StatusOr<ForeignMotion> motion = ParseBvh(With("Frames: 2", "Frames: 1"), "a.bvh");
  ASSERT_TRUE(motion.ok()) << motion.status();
  EXPECT_EQ(motion->poses.size(), 2u);
  ASSERT_EQ(motion->notes.size(), 1u);
  EXPECT_EQ(motion->notes[0], "Frames says 1, the file has 2; all were read");
}

TEST(BvhFile, SaysWhatIsWrongWithAFile) {
  const auto message = [](const std::string& bytes) {
    const absl::StatusOr<ForeignMotion> motion = ParseBvh(bytes, "a.bvh");
    EXPECT_EQ(motion.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(motion.status().message());
  };
  EXPECT_NE(message("solid cube").find("a.bvh: is not BVH"), std::string::npos);
  EXPECT_NE(message(kSmall.substr(0, kSmall.size() - 12)).find("a.bvh: is damaged: line"), std::string::npos);
  EXPECT_NE(message(With("Frames: 2", "Frames: 4000000000")).find("too short"), std::string::npos);
  EXPECT_NE(message(With("10 20 30", "10 x 30")).find("is damaged"), std::string::npos);
  EXPECT_NE(message(With("10 20 30", "10 nan 30")).find("number"), std::string::npos);
  EXPECT_NE(message(With("0.02", "0")).find("line 18: Frame Time is 0, expected the seconds"),
            std::string::npos);
  EXPECT_NE(message(With("0.02", "0,02")).find("line 18: \"0,02\" has a comma"), std::string::npos);
  EXPECT_NE(message(With("0.5 10", "0,5 10")).find("line 8: \"0,5\" has a comma"), std::string::npos);
  EXPECT_NE(message(With("MOTION", "ROOT Other\n{\n}\nMOTION")).find("line 16: a second ROOT, \"Other\""),
            std::string::npos);
  EXPECT_NE(
      message(With("30 0 0 0\n", "30 0 0\n")).find("line 19: a row of 8 numbers, expected one for each of 9"),
      std::string::npos);
  EXPECT_NE(message(With("30 0 0 0\n", "30 0 0 0 0\n")).find("line 19: a row of more numbers"),
            std::string::npos);
  EXPECT_NE(message(With("Frames: 2", "Frames: 3")).find("it says 3 and has 2"), std::string::npos);
  EXPECT_NE(message(With("Zrotation\n    End", "Wrotation\n    End")).find("\"Wrotation\" is no channel"),
            std::string::npos);
  EXPECT_NE(
      message(With("Yrotation Xrotation Zrotation", "Yrotation Yrotation Zrotation")).find("stands twice"),
      std::string::npos);
  EXPECT_NE(message(With("JOINT Spine", "JOINT")).find("a JOINT without a name"), std::string::npos);
  EXPECT_NE(message("\xff\xfeH").find("UTF-16"), std::string::npos);
  std::string many = "HIERARCHY\nROOT A\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n";
  for (int k = 0; k < 100000; ++k) many += "JOINT B" + std::to_string(k) + "\n{\nOFFSET 0 0 0\n";
  EXPECT_NE(message(many).find("more than 4096 joints"), std::string::npos);
  EXPECT_EQ(ReadBvh("/nowhere/a.bvh").status().code(), absl::StatusCode::kNotFound);
}

// Somebody with a root and four joints, at each frame `way` further, whose joints turn by up to `most`.
std::string Person(double most, double way, int frames = 10) {
  std::string out =
      "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition "
      "Zrotation Xrotation Yrotation\n";
  for (int j = 0; j < 4; ++j)
    out += "JOINT J" + std::to_string(j) + "\n{\nOFFSET 0 20 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n";
  out += "End Site\n{\nOFFSET 0 20 0\n}\n}\n}\n}\n}\n}\nMOTION\nFrames: " + std::to_string(frames) +
         "\nFrame Time: 0.04\n";
  for (int f = 0; f < frames; ++f) {
    out += "0 90 " + std::to_string(way * f) + " 0 0 " + std::to_string(0.5 * most);
    for (int j = 0; j < 4; ++j) out += " 0 " + std::to_string(most * (j + 1) / 4 * f / (frames - 1)) + " 0";
    out += "\n";
  }
  return out;
}

TEST(BvhFile, AnglesOfSomebodyWhoWalksAreRadiansWhereNoneIsAbove2Pi) {
  const auto radians = ParseBvh(Person(1.2, 10), "a.bvh");
  ASSERT_TRUE(radians.ok()) << radians.status();
  EXPECT_NEAR(radians->poses.back().rotation[4].angularDistance(Eigen::Quaterniond::Identity()), 1.2, 1e-6);
  ASSERT_EQ(radians->notes.size(), 1u);
  EXPECT_NE(radians->notes[0].find("--angles degrees"), std::string::npos) << radians->notes[0];
  const auto told = ParseBvh(Person(1.2, 10), "a.bvh", BvhAngles::kDegrees);
  EXPECT_NEAR(told->poses.back().rotation[4].angularDistance(Eigen::Quaterniond::Identity()),
              kRadPerDeg * 1.2, 1e-6);
  EXPECT_TRUE(told->notes.empty());
  const auto also = ParseBvh(Person(40, 10), "a.bvh", BvhAngles::kRadians);
  EXPECT_TRUE(also->notes.empty());
}

TEST(BvhFile, AnglesOfSomebodyWhoStandsStillAreDegreesAndSmallOnesAreNoted) {
  for (const double most : {1.2, 5.0}) {
    const auto still = ParseBvh(Person(most, 0), "a.bvh");
    EXPECT_NEAR(still->poses.back().rotation[4].angularDistance(Eigen::Quaterniond::Identity()),
                kRadPerDeg * most, 1e-6);
    EXPECT_EQ(still->notes.size(), most < 3 ? 1u : 0u) << most;
  }
  for (const double most : {0.0, 0.05, 40.0}) EXPECT_TRUE(ParseBvh(Person(most, 10), "a.bvh")->notes.empty());
}

}  // namespace
}  // namespace weft
