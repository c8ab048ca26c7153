#include "services/studio/recording/take_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "capture/take/take_files.h"
#include "services/formats/files/json_file.h"
#include "services/studio/recording/clock_log.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::SizeIs;

class TakeFileTest : public ::testing::Test {
 protected:
  TakeFileTest() {
    fs::create_directories(take_);
    RecordPattern(take_, cameras_);
  }
  std::string File() const { return TakeJsonFile(take_); }
  // One byte of the file is another one.
  void Damage() const {
    std::string text = ReadBytes(File());
    text.replace(text.find("\"test\""), 6, "\"tesT\"");
    WriteBytes(File(), text);
  }
  v1::TakeInfo Info() const {
    const auto info = DescribeTake(take_);
    EXPECT_TRUE(info.ok()) << info.status();
    return info.value_or(v1::TakeInfo());
  }

  const TempFolder folder_;
  const std::string take_ = folder_ / "take";
  PatternFrames cameras_{{"left", "right"}, 64, 48};
};

TEST(NewTake, BeginsNowUnderANumberOfItsOwn) {
  const v1::Take take = NewTake("images of /i");
  EXPECT_THAT(take.id(), MatchesRegex("[0-9a-f]{16}"));
  EXPECT_EQ(take.state(), v1::TAKE_STATE_RECORDING);
  EXPECT_EQ(take.origin(), "images of /i");
  EXPECT_NE(take.weft_version(), "");
  EXPECT_GT(take.started_host_time_ns(), int64_t{1'600'000'000'000'000'000});
  EXPECT_EQ(TakeNumber(take) % 2, 1u);  // never 0, which means unknown
  EXPECT_NE(NewTake("").id(), take.id());
}

TEST(NewTake, NumbersAreHexDigits) {
  v1::Take take;
  EXPECT_EQ(TakeNumber(take), 0u);
  take.set_id("00000000000000ff");
  EXPECT_EQ(TakeNumber(take), 255u);
  take.set_id("the first");
  EXPECT_EQ(TakeNumber(take), 0u);
}

TEST_F(TakeFileTest, IsReadAsItWasWritten) {
  v1::Take take = NewTake("test");
  take.set_name("a name");
  ASSERT_TRUE(WriteTakeFile(take_, take).ok());
  const auto read = ReadTakeFileStrictly(take_);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(read->has_checksum);
  EXPECT_EQ(read->take.SerializeAsString(), take.SerializeAsString());
  EXPECT_THAT(ReadBytes(File()), HasSubstr("\"checksum\": \""));
}

TEST_F(TakeFileTest, OfAnEarlierVersionHasNoChecksum) {
  WriteBytes(File(), R"({"id": "00000000000000ff"})");
  const auto read = ReadTakeFileStrictly(take_);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_FALSE(read->has_checksum);
  EXPECT_EQ(read->take.id(), "00000000000000ff");
}

TEST_F(TakeFileTest, DamageIsSeenAndSaid) {
  Damage();
  const absl::Status changed = ReadTakeFileStrictly(take_).status();
  EXPECT_TRUE(absl::IsDataLoss(changed));
  EXPECT_EQ(changed.message(), File() + ": damaged: its text does not fit its checksum");
  const absl::Status remedy = ReadTakeFile(take_).status();
  EXPECT_TRUE(absl::IsDataLoss(remedy));
  EXPECT_THAT(std::string(remedy.message()),
              HasSubstr("; `weft take recover --force " + take_ + "` makes it anew"));
  WriteBytes(File(), R"({"checksum": "0"})");
  EXPECT_TRUE(absl::IsDataLoss(ReadTakeFileStrictly(take_).status()));
  WriteBytes(File(), "{\"id\": ");
  const absl::Status cut = ReadTakeFileStrictly(take_).status();
  EXPECT_TRUE(absl::IsDataLoss(cut));
  EXPECT_THAT(std::string(cut.message()), HasSubstr("damaged: "));
}

TEST_F(TakeFileTest, OneThatIsMissingIsMadeOfTheStreams) {
  const v1::Take before = ReadTakeFile(take_).value();
  fs::remove(File());
  EXPECT_TRUE(absl::IsNotFound(ReadTakeFileStrictly(take_).status()));
  const auto take = ReadTakeFile(take_);
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_EQ(take->id(), before.id());
  EXPECT_EQ(take->state(), v1::TAKE_STATE_COMPLETE);
  EXPECT_EQ(take->stop_cause(), "");
  EXPECT_EQ(take->sets_recorded(), 4u);
  EXPECT_EQ(take->sets_dropped(), 0u);
  EXPECT_EQ(take->frames_missing(), 1u);
  EXPECT_GT(take->ended_host_time_ns(), 0);
  ASSERT_EQ(take->cameras_size(), 2);
  EXPECT_EQ(take->cameras(0).id(), "left");
  EXPECT_EQ(take->cameras(1).id(), "right");
  EXPECT_TRUE(absl::IsNotFound(ReadTakeFile(folder_ / "nothing").status()));
}

// Each stream's head has the details of its own camera.
TEST_F(TakeFileTest, StreamsKeepWhatIsSaidOfTakeAndCamera) {
  v1::Take take = NewTake("test");
  take.set_slate("12A");
  for (const char* id : {"left", "right"}) {
    v1::TakeCamera& camera = *take.add_cameras();
    camera.set_id(id);
    camera.set_model(std::string("model of ") + id);
  }
  v1::Take own;
  ASSERT_TRUE(ParseJson(StreamDescription(take, 1), "description", own).ok());
  EXPECT_EQ(own.slate(), "12A");
  EXPECT_EQ(own.cameras(0).id(), "left");
  EXPECT_EQ(own.cameras(0).model(), "");
  EXPECT_EQ(own.cameras(1).model(), "model of right");

  RecorderOptions options = SmallRecorder();
  options.take.descriptions = {"something else"};
  DescribeStreams(take, options.take);
  EXPECT_EQ(options.take.take, TakeNumber(take));
  EXPECT_THAT(options.take.descriptions, ElementsAre(StreamDescription(take, 0), StreamDescription(take, 1)));
  const std::string folder = folder_ / "described";
  {
    const auto recorder = Recorder::Start(folder, cameras_.camera_ids(), options);
    ASSERT_TRUE(recorder.ok()) << recorder.status();
    (*recorder)->NoteDropped(0, 2, 0, "too slow");
    ASSERT_TRUE((*recorder)->OfferAndWait(cameras_.Set(3)));
    ASSERT_TRUE((*recorder)->Stop().ok());
  }
  const auto found = TakeFromStreams(folder);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->slate(), "12A");
  EXPECT_EQ(found->sets_dropped(), 3u);
  EXPECT_EQ(found->sets_recorded(), 1u);
  ASSERT_EQ(found->cameras_size(), 2);
  EXPECT_EQ(found->cameras(0).model(), "model of left");
  EXPECT_EQ(found->cameras(1).model(), "model of right");
  // One whose stream is gone is known by the others' heads, and by its index.
  fs::remove(StreamFile(StreamFolder(folder), "left"));
  const auto without = TakeFromStreams(folder);
  ASSERT_TRUE(without.ok()) << without.status();
  ASSERT_EQ(without->cameras_size(), 2);
  EXPECT_EQ(without->cameras(0).id(), "left");
  EXPECT_EQ(without->cameras(0).model(), "");
  EXPECT_EQ(without->cameras(1).model(), "model of right");
}

TEST_F(TakeFileTest, OutcomeIsThatOfTheRecorder) {
  RecorderCounters counters;
  counters.sets_recorded = 5;
  counters.sets_dropped = 6;
  counters.frames_missing = 7;
  v1::Take take = NewTake("test");
  SetOutcome(counters, take);
  EXPECT_EQ(take.state(), v1::TAKE_STATE_COMPLETE);
  EXPECT_EQ(take.sets_recorded(), 5u);
  EXPECT_EQ(take.sets_dropped(), 6u);
  EXPECT_EQ(take.frames_missing(), 7u);
  EXPECT_GE(take.ended_host_time_ns(), take.started_host_time_ns());
  counters.stop_cause = "disk nearly full";
  SetOutcome(counters, take);
  EXPECT_EQ(take.state(), v1::TAKE_STATE_STOPPED);
  EXPECT_EQ(take.stop_cause(), "disk nearly full");
}

TEST_F(TakeFileTest, IsDescribedWithNumbersAndVerdict) {
  v1::Take take = ReadTakeFile(take_).value();
  take.set_state(v1::TAKE_STATE_COMPLETE);
  ASSERT_TRUE(WriteTakeFile(take_, take).ok());
  const v1::TakeInfo info = Info();
  EXPECT_EQ(info.path(), take_);
  EXPECT_EQ(info.take().id(), take.id());
  EXPECT_EQ(info.sets(), 4u);
  EXPECT_EQ(info.sets_complete(), 3u);
  // A block for each of 8 chunks, and one for each of the 7 pictures of 64 x 48 bytes.
  EXPECT_EQ(info.bytes(), (8u + 7) * 4096);
  EXPECT_NEAR(info.duration_s(), 0.1, 1e-6);
  ASSERT_EQ(info.timing_size(), 2);
  ASSERT_EQ(info.causes_size(), 1);
  EXPECT_EQ(info.causes(0).cause(), "3 packets lost");
  EXPECT_THAT(info.warnings(), IsEmpty());
  EXPECT_EQ(info.verdict().grade(), v1::GRADE_BAD);  // 3 of 4 sets
  EXPECT_THAT(info.verdict().reason(), HasSubstr("3 of 4 frame sets have all cameras"));
}

TEST_F(TakeFileTest, IsDescribedByItsStreamsWhereTheFileIsDamaged) {
  Damage();
  const v1::TakeInfo info = Info();
  EXPECT_EQ(info.sets(), 4u);
  EXPECT_EQ(info.verdict().grade(), v1::GRADE_BAD);
  EXPECT_THAT(info.verdict().reason(), HasSubstr("take.json: damaged"));
  EXPECT_THAT(info.verdict().remedy(), HasSubstr("weft take recover --force " + take_));
  // Streams that cannot be opened leave a verdict alone.
  for (const char* id : {"left", "right"}) WriteBytes(StreamFile(StreamFolder(take_), id), "no stream");
  const v1::TakeInfo broken = Info();
  EXPECT_EQ(broken.sets(), 0u);
  EXPECT_EQ(broken.verdict().grade(), v1::GRADE_BAD);
  EXPECT_EQ(broken.verdict().checks_size(), 0);
  EXPECT_TRUE(absl::IsNotFound(DescribeTake(folder_ / "nothing").status()));
}

// The log of the clocks has to be there only where the take was closed with one.
TEST_F(TakeFileTest, IsUsableAtMostWhereTheLogOfItsClocksIsGone) {
  v1::Take take = ReadTakeFile(take_).value();
  take.set_clocks_checksum("0123456789abcdef");
  for (const v1::TakeState state : {v1::TAKE_STATE_COMPLETE, v1::TAKE_STATE_STOPPED}) {
    take.set_state(state);
    ASSERT_TRUE(WriteTakeFile(take_, take).ok());
    const v1::TakeInfo info = Info();
    bool is_said = info.verdict().reason() == "clocks.csv: is missing";
    for (const v1::VerdictFinding& finding : info.verdict().others())
      is_said =
          is_said || (finding.reason() == "clocks.csv: is missing" && finding.grade() == v1::GRADE_USABLE);
    EXPECT_TRUE(is_said) << info.verdict().DebugString();
  }
}

}  // namespace
}  // namespace weft
