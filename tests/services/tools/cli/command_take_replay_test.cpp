// weft take replay, sync.
#include <filesystem>
#include <iostream>
#include <sstream>

#include "services/formats/verdict/verdict.h"
#include "tests/services/results/report/page_data.h"
#include "tests/services/tools/cli/small_take.h"
#include "weft/v1/replay.pb.h"

namespace weft {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

class CommandTakeReplay : public SmallTakeTest {
 protected:
  v1::TakeReplay Replayed(std::vector<std::string> words) const {
    words.insert(words.begin(), {"replay", take_, "--json"});
    const AloudRun run = Take(words);
    EXPECT_TRUE(run.status.ok()) << run.status;
    return FromJson<v1::TakeReplay>(run.out);
  }
};

// The lines of a text without what differs from run to run.
std::string WithoutTimes(const std::string& text) {
  std::string out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const size_t late = line.find("  late ");
    const size_t in = line.find(" MB in ");
    if (late != std::string::npos) line = line.substr(0, late) + line.substr(line.find("  ", late + 2));
    out += (in == std::string::npos ? line : line.substr(0, in)) + "\n";
  }
  return out;
}

TEST_F(CommandTakeReplay, ListsSetsAndSaysWhatCame) {
  const AloudRun run = Take({"replay", take_, "--fastest", "--list"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  const std::string checksum = Replayed({"--fastest"}).checksum();
  EXPECT_THAT(WithoutTimes(run.out),
              StartsWith("set 5      +0.000 ms  2 frames, 8192 bytes\n"
                         "set 6     +33.333 ms  1 frames, 4096 bytes; no right: no image in the dump\n"
                         "set 7     +66.667 ms  2 frames, 8192 bytes\n"
                         "set 8    +100.000 ms  2 frames, 8192 bytes\n" +
                         take_ + ": 4 frame sets, 7 frames, 1 missing, 0.0\n"));
  EXPECT_THAT(run.out, EndsWith("late: median 0.000 ms, worst 0.000 ms\nchecksum " + checksum + "\n"));
  const size_t rates = run.out.find("MB in ");
  EXPECT_THAT(run.out.substr(rates, run.out.find('\n', rates) - rates),
              MatchesRegex("MB in [0-9.]+ s .[0-9.]+ sets/s, [0-9.]+ MB/s."));
}

TEST_F(CommandTakeReplay, JsonTellsTheSameAndTheListGoesElsewhere) {
  const AloudRun run = Take({"replay", take_, "--fastest", "--list", "--json"});
  const auto replay = FromJson<v1::TakeReplay>(run.out);
  EXPECT_EQ(replay.take(), take_);
  EXPECT_EQ(replay.sets(), 4u);
  EXPECT_EQ(replay.frames(), 7u);
  EXPECT_EQ(replay.missing(), 1u);
  EXPECT_EQ(replay.bytes(), 7u * 4096) << "in pieces of the disk";
  EXPECT_THAT(run.err, StartsWith("set 5      +0.000 ms  late "));
  EXPECT_EQ(Take({"replay", take_, "--fastest", "--json"}).err, "");
}

TEST_F(CommandTakeReplay, APartIsPlayedWithShiftedTimes) {
  const v1::TakeReplay part = Replayed({"--fastest", "--frames", "6:8"});
  EXPECT_EQ(part.sets(), 2u);
  EXPECT_EQ(part.frames(), 3u);
  const v1::TakeReplay shifted = Replayed({"--fastest", "--frames", "6:8", "--shift", "left=2"});
  EXPECT_EQ(shifted.frames(), 3u);
  EXPECT_NE(shifted.checksum(), part.checksum());
  EXPECT_THAT(Take({"replay", take_, "--frames", "x"}).message(), HasSubstr("--frames x"));
}

// Sets come at their times, or later.
TEST_F(CommandTakeReplay, RunsAtTheSpeedThatIsAskedFor) {
  EXPECT_GE(Replayed({}).wall_s(), 0.0999);
  EXPECT_GE(Replayed({"--speed", "0.5"}).wall_s(), 0.1999);
  EXPECT_LT(Replayed({"--fastest"}).wall_s(), 0.0999);
}

TEST_F(CommandTakeReplay, StepsWithEachLineUntilQ) {
  std::istringstream input("\nanything\nq\n\n");
  std::streambuf* const before = std::cin.rdbuf(input.rdbuf());
  const AloudRun run = Take({"replay", take_, "--step"});
  std::cin.rdbuf(before);
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr("set 7 "));
  EXPECT_THAT(run.out, HasSubstr(": 3 frame sets, 5 frames, 1 missing"));
  std::istringstream ended("\n");
  std::cin.rdbuf(ended.rdbuf());
  EXPECT_EQ(Replayed({"--step"}).sets(), 2u) << "the input's end";
  std::cin.rdbuf(before);
  std::cin.clear();
}

TEST_F(CommandTakeReplay, APreviewShowsThePictures) {
  const AloudRun run = Take({"replay", take_, "--fastest", "--preview", folder_ / "look"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(ReadBytes(folder_ / "look/index.html"), HasSubstr("right"));
}

TEST_F(CommandTakeReplay, SyncTellsHowCamerasKeptTogether) {
  const std::string page = folder_ / "sync.html";
  const AloudRun run = Take({"sync", take_, "--report", page});
  EXPECT_TRUE(IsVerdict(run.status)) << run.status;
  EXPECT_THAT(
      run.out,
      StartsWith("bad: 3 of 4 frame sets have all cameras; right: 1 frame missing: no image in the dump\n"));
  EXPECT_THAT(run.out, HasSubstr("\n" + take_ + ": 4 frame sets, 3 of them complete, 0 dropped\n"));
  const AloudRun json = Take({"sync", take_, "--json"});
  EXPECT_TRUE(IsVerdict(json.status));
  EXPECT_EQ(MemberOf<v1::SyncReport>(ReadBytes(page), "report").sets(), 4u);
  EXPECT_EQ(FromJson<v1::SyncReport>(json.out).sets(), 4u);
  EXPECT_EQ(Take({"sync", folder_ / "none"}).status.code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
