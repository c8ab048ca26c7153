// weft motion make, list, show, import.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "absl/strings/str_cat.h"

#include "figure/motion_generator.h"
#include "services/formats/figure/motion_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

CommandRun MotionCommand(std::vector<std::string> words) {
  words.insert(words.begin(), "motion");
  return RunCommand(AddMotionCommand, std::move(words));
}

TEST(CommandMotion, ListsEveryKindThatCanBeMade) {
  const CommandRun run = MotionCommand({"list"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  std::istringstream lines(run.out);
  std::string line;
  for (const MotionKindInfo& kind : MotionKinds()) {
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_THAT(line, StartsWith(std::string(kind.name) + " "));
    EXPECT_THAT(line, HasSubstr(std::string(kind.about)));
  }
  EXPECT_FALSE(std::getline(lines, line));
}

TEST(CommandMotion, MakesTheMotionThatItsOptionsAskFor) {
  const TempFolder folder;
  const CommandRun run = MotionCommand({"make", "--kind", "squat", "--seconds", "2", "--fps", "30", "--seed",
                                        "5", "--out", folder / "a.motion"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  const auto made = ReadMotion(folder / "a.motion");
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->fps, 30);
  EXPECT_NEAR(made->DurationS(), 2, 0.05);
  EXPECT_EQ(run.out, folder / "a.motion" + std::string(": squat, 2.0 s, ") +
                         std::to_string(made->poses.size()) + " poses\n");
  const auto expected = MakeMotion({MotionKind::kSquat, 2, 30, 5});
  ASSERT_TRUE(expected.ok()) << expected.status();
  ASSERT_TRUE(WriteMotion(folder / "b.motion", *expected).ok());
  EXPECT_EQ(MotionHash(*made), MotionHash(*ReadMotion(folder / "b.motion")));
}

TEST(CommandMotion, ShowsWhatAMotionHoldsAndDrawsIt) {
  const TempFolder folder;
  ASSERT_TRUE(
      MotionCommand({"make", "--kind", "wave", "--seconds", "1", "--out", folder / "a.motion"}).status.ok());
  const CommandRun run = MotionCommand({"show", folder / "a.motion", "--picture", folder / "a.svg"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out,
              HasSubstr("poses at 60 a second, hash " + MotionHash(*ReadMotion(folder / "a.motion"))));
  EXPECT_THAT(run.out, HasSubstr("farthest, deg"));
  EXPECT_THAT(ReadBytes(folder / "a.svg"), HasSubstr("<svg"));
}

TEST(CommandMotion, AKindThatIsNoneIsAnsweredWithThoseThereAre) {
  const TempFolder folder;
  const CommandRun run = MotionCommand({"make", "--kind", "fly", "--out", folder / "a.motion"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  for (const MotionKindInfo& kind : MotionKinds())
    EXPECT_THAT(run.message(), HasSubstr(std::string(kind.name)));
  EXPECT_EQ(MotionCommand({"make", "--seconds=-1", "--out", folder / "a.motion"}).status.code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.motion"));
}

TEST(CommandMotion, ImportNamesTheOptionThatIsWrong) {
  const TempFolder folder;
  const auto import = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"import", folder / "walk.bvh", "--out", folder / "walk.motion"});
    return MotionCommand(more);
  };
  EXPECT_THAT(import({"--joint", "chest"}).message(),
              HasSubstr("--joint \"chest\" is not of the form OURS=THEIRS"));
  for (const char* axis : {"w", "-", "xy", "--z"}) {
    const CommandRun run = import({"--up=" + std::string(axis)});
    EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument) << axis;
    EXPECT_THAT(run.message(), HasSubstr("expected x, y, z, -x, -y or -z")) << axis;
  }
  EXPECT_THAT(import({"--sides", "swapped"}).message(), HasSubstr("auto, as-named, exchanged"));
  const CommandRun missing = import({"--up", "z"});
  EXPECT_EQ(missing.status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(missing.message(), HasSubstr(folder / "walk.bvh"));
}

struct WalkJoint {
  const char* name;
  const char* parent;
  const char* offset;
};
constexpr WalkJoint kWalk[] = {
    {"Hips", "", "0 0 0"},
    {"Spine", "Hips", "0 12 0"},
    {"Chest", "Spine", "0 14 0"},
    {"Head", "Chest", "0 32 0"},
    {"LeftArm", "Chest", "18 18 0"},
    {"LeftForeArm", "LeftArm", "28 0 0"},
    {"LeftHand", "LeftForeArm", "25 0 0"},
    {"RightArm", "Chest", "-18 18 0"},
    {"RightForeArm", "RightArm", "-28 0 0"},
    {"RightHand", "RightForeArm", "-25 0 0"},
    {"LeftUpLeg", "Hips", "9 -5 0"},
    {"LeftLeg", "LeftUpLeg", "0 -42 0"},
    {"LeftFoot", "LeftLeg", "0 -41 0"},
    {"LeftToeBase", "LeftFoot", "0 -6 13"},
    {"RightUpLeg", "Hips", "-9 -5 0"},
    {"RightLeg", "RightUpLeg", "0 -42 0"},
    {"RightFoot", "RightLeg", "0 -41 0"},
    {"RightToeBase", "RightFoot", "0 -6 13"},
};

void AddWalkJoint(const WalkJoint& joint, std::string& hierarchy, int& joints) {
  const bool is_root = *joint.parent == '\0';
  absl::StrAppend(&hierarchy, is_root ? "ROOT " : "JOINT ", joint.name, "\n{\nOFFSET ", joint.offset,
                  "\nCHANNELS ", is_root ? "6 Xposition Yposition Zposition " : "3 ",
                  "Zrotation Xrotation Yrotation\n");
  ++joints;
  bool is_end = true;
  for (const WalkJoint& below : kWalk) {
    if (std::string(below.parent) != joint.name) continue;
    AddWalkJoint(below, hierarchy, joints);
    is_end = false;
  }
  hierarchy += is_end ? "End Site { OFFSET 0 0 5 }\n}\n" : "}\n";
}

// Somebody who stands with arms spread and goes forwards, 3 frames of 50 ms; y is up.
void WriteWalk(const std::string& file) {
  std::string text = "HIERARCHY\n";
  int joints = 0;
  AddWalkJoint(kWalk[0], text, joints);
  text += "MOTION\nFrames: 3\nFrame Time: 0.05\n";
  for (int frame = 0; frame < 3; ++frame) {
    absl::StrAppend(&text, "0 94 ", 10 * frame);
    for (int i = 0; i < 3 * joints; ++i) text += i == 4 ? absl::StrCat(" ", 20 * frame) : " 0";
    text += "\n";
  }
  WriteBytes(file, text);
}

TEST(CommandMotion, ImportTellsWhichJointIsWhich) {
  const TempFolder folder;
  WriteWalk(folder / "walk.bvh");
  const auto import = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"import", folder / "walk.bvh", "--out", folder / "walk.motion"});
    const CommandRun run = MotionCommand(more);
    EXPECT_TRUE(run.status.ok()) << run.status;
    return run.out;
  };
  const auto hash = [&] { return MotionHash(*ReadMotion(folder / "walk.motion")); };
  // Left is what a viewer in front sees on the left.
  EXPECT_EQ(import({}),
            "pelvis           Hips\nspine            Spine\nchest            Chest\nhead             Head\n"
            "left-clavicle    -\nleft-upper-arm   RightArm\nleft-forearm     RightForeArm\n"
            "left-hand        RightHand\nright-clavicle   -\nright-upper-arm  LeftArm\n"
            "right-forearm    LeftForeArm\nright-hand       LeftHand\nleft-thigh       RightUpLeg\n"
            "left-shin        RightLeg\nright-thigh      LeftUpLeg\nright-shin       LeftLeg\n"
            "legs             83 in the file, from hip to ankle\n" +
                (folder / "walk.motion") + ": 0.1 s, 3 poses at 20 a second\n");
  const std::string as_found = hash();
  import({"--up", "y", "--angles", "degrees", "--sides", "as-named"});
  EXPECT_EQ(hash(), as_found);
  import({"--angles", "radians"});
  EXPECT_NE(hash(), as_found);
  EXPECT_THAT(import({"--up", "-y", "--sides", "as-named"}), HasSubstr("from hip to ankle"));
  EXPECT_NE(hash(), as_found);
  EXPECT_THAT(import({"--joint", "chest=Spine"}), HasSubstr("spine            -\nchest            Spine\n"));
  const std::string exchanged = import({"--sides", "exchanged"});
  EXPECT_THAT(exchanged, HasSubstr("\nleft-thigh       LeftUpLeg\n"));
  EXPECT_THAT(exchanged, HasSubstr("\nnote             toes point backwards: "));
  const CommandRun unknown = MotionCommand(
      {"import", folder / "walk.bvh", "--out", folder / "other.motion", "--joint", "arm=Spine"});
  EXPECT_EQ(unknown.message(), (folder / "walk.bvh") + ": joint \"arm\" is none of ours");
  EXPECT_FALSE(std::filesystem::exists(folder / "other.motion"));
}

TEST(CommandMotion, ShowsEveryJoint) {
  const TempFolder folder;
  ASSERT_TRUE(
      MotionCommand({"make", "--kind", "stand", "--seconds", "1", "--out", folder / "a.motion"})
          .status.ok() ||
      MotionCommand({"make", "--kind", "wave", "--seconds", "1", "--out", folder / "a.motion"}).status.ok());
  const CommandRun run = MotionCommand({"show", folder / "a.motion"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 2 + static_cast<int>(kJoints));
  EXPECT_THAT(run.out, HasSubstr("\njoint             farthest, deg   fastest, deg/s\npelvis  "));
  const CommandRun drawn = MotionCommand({"show", folder / "a.motion", "--picture", folder / "a.svg"});
  EXPECT_EQ(drawn.out, run.out + (folder / "a.svg") +
                           ": the motion as a strip of figures, from the front and from the side\n");
  EXPECT_EQ(MotionCommand({"show", folder / "none"}).status.code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
