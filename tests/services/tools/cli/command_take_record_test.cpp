// weft take record: of a take that is played as if its cameras were live.
#include <filesystem>

#include "services/formats/verdict/verdict.h"
#include "tests/services/tools/cli/small_take.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

class CommandTakeRecord : public SmallTakeTest {
 protected:
  CommandTakeRecord() { WriteSession("take"); }
  void WriteSession(const std::string& take) {
    WriteBytes(session_,
               R"({"fps": 30, "low_disk_gib": 0.001, "cameras": [{"id": "left", "replay": {"take": ")" +
                   take + R"("}}, {"id": "right", "replay": {"take": ")" + take + R"("}}]})");
  }
  AloudRun Record(std::vector<std::string> words) const {
    words.insert(words.begin(), {"record", "--session", session_, "--out", out_});
    return Take(words);
  }

  const std::string session_ = folder_ / "session.json", out_ = folder_ / "new/out";
};

TEST_F(CommandTakeRecord, TellsWhatWasRecordedOfEachCamera) {
  const AloudRun run = Record({});
  EXPECT_TRUE(IsVerdict(run.status)) << run.status;  // a frame is missing, and a trigger at the end
  EXPECT_THAT(run.out, HasSubstr(out_ + ": take " + IdOf(out_) + ", closed; 3 of "));
  const std::string cameras = run.out.substr(run.out.find("camera left: 4"));
  EXPECT_THAT(
      cameras,
      MatchesRegex("camera left: 4 frames, [0-9]+ lost, 0 packets resent, 0 packets missing, 0 times away, 0 "
                   "times back\ncamera right: 3 frames, [0-9]+ lost, 0 packets resent, 0 packets missing, 0 "
                   "times away, 0 times back\n"));
  const auto taken = ReadTakeFileStrictly(out_);
  ASSERT_TRUE(taken.ok()) << taken.status();
  EXPECT_EQ(taken->take.sets_recorded(), 4u);
}

TEST_F(CommandTakeRecord, JsonIsTheTakeAndTheDiskNeedNotBeTested) {
  const AloudRun run = Record({"--json", "--no-disk-test", "--preview", folder_ / "look"});
  EXPECT_TRUE(IsVerdict(run.status)) << run.status;
  const auto info = FromJson<v1::TakeInfo>(run.out);
  EXPECT_EQ(info.path(), out_);
  EXPECT_EQ(info.sets(), 4u);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "look/index.html"));
}

TEST_F(CommandTakeRecord, EndsAfterItsTime) {
  const std::string longer = folder_ / "longer";
  PatternFrames cameras({"left", "right"}, 64, 48, RawFormat::kMono8);
  std::vector<RawFrameSet> sets;
  for (uint64_t number = 0; number < 60; ++number) sets.push_back(cameras.Set(number));
  RecordSets(longer, cameras.camera_ids(), sets);
  WriteSession(longer);
  const AloudRun run = Record({"--seconds", "0.3", "--no-disk-test"});
  EXPECT_TRUE(run.status.ok()) << run.status << run.out;
  EXPECT_LT(ReadTakeFileStrictly(out_)->take.sets_recorded(), 55u);
  EXPECT_THAT(run.out, HasSubstr("good: "));
}

TEST_F(CommandTakeRecord, WhatCannotBeOpenedIsNamed) {
  WriteSession("none");
  EXPECT_THAT(Record({}).message(), HasSubstr(folder_ / "none"));
  EXPECT_FALSE(std::filesystem::exists(out_));
  WriteSession("take");
  const AloudRun there = Take({"record", "--session", session_, "--out", take_, "--no-disk-test"});
  EXPECT_FALSE(there.status.ok());
  EXPECT_FALSE(IsVerdict(there.status)) << there.out;
}

}  // namespace
}  // namespace weft
