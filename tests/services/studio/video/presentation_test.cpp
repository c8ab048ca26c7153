#include "services/studio/video/presentation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/studio/video/frame_times.h"
#include "services/studio/video/video_facts.h"
#include "tests/services/studio/video/made_video.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// As AVI has them: when they are decoded.
std::vector<VideoPacket> InOrder(const std::vector<int64_t>& times) {
  std::vector<VideoPacket> packets;
  for (const int64_t time : times) packets.push_back({time, time, packets.empty(), false, false});
  return packets;
}

std::vector<int64_t> ByOrder(const std::vector<VideoPacket>& packets, const DecodedTimes& decoded) {
  const auto times = TimesByOrder(packets, decoded);
  EXPECT_TRUE(times.ok()) << times.status();
  return times.value_or(std::vector<int64_t>{-1});
}

TEST(TimesByOrder, PicturesThatComeLateAreShownAtThePacketsTimes) {
  EXPECT_THAT(ByOrder(InOrder({0, 1, 2, 3}), {{2, 3, 4, 5}, 2, false}), ElementsAre(0, 1, 2, 3));
  // As some MXF files say it: two of one time, and a gap.
  EXPECT_THAT(ByOrder(InOrder({0, 1, 2, 3}), {{0, 2, 3, 3}, 2, false}), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(ByOrder(InOrder({0, 2, 4, 8}), {{4, 8, 10, 12}, 2, false}), ElementsAre(0, 2, 4, 8));
}

TEST(TimesByOrder, PicturesThatAreShownAsTheyAreDecodedKeepTheirTimes) {
  EXPECT_THAT(ByOrder(InOrder({0, 1, 2, 3}), {{0, 1, 2, 3}, 0, false}), IsEmpty());
  EXPECT_THAT(ByOrder(InOrder({0, 1, 2, 3}), {{1, 3}, 0, true}), IsEmpty());  // others are damaged
  EXPECT_THAT(ByOrder({}, {{2, 3}, 2, false}), IsEmpty());
}

TEST(TimesByOrder, FilesThatSayWhenPicturesAreShownAreBelieved) {
  std::vector<VideoPacket> packets = InOrder({0, 3, 1, 2});
  packets[1].is_shown_by_itself = true;
  EXPECT_THAT(ByOrder(packets, {{1, 2, 3, 4}, 1, false}), IsEmpty());
}

TEST(TimesByOrder, FilesThatHidePicturesSayWhenTheyAreShown) {
  std::vector<VideoPacket> packets = InOrder({0, 1, 2, 3});
  packets[0].is_hidden = true;
  EXPECT_THAT(ByOrder(packets, {{2, 3, 4}, 2, false}), IsEmpty());
  EXPECT_THAT(ByOrder(InOrder({0, 1}), {{}, 2, true}), IsEmpty());
  // A decoder that waits, and whose first picture comes in time.
  EXPECT_THAT(ByOrder(InOrder({0, 1, 2, 3}), {{0, 1, 2, 3}, 2, false}), IsEmpty());
  EXPECT_THAT(ByOrder(InOrder({0, 1, 2, 3}), {{3, 2, 1}, 0, false}), IsEmpty());
  const absl::Status twice = TimesByOrder(InOrder({0, 1, 1}), {{2, 3, 4}, 2, false}).status();
  EXPECT_TRUE(absl::IsInvalidArgument(twice)) << "two packets of one time";
}

TEST(TimesByOrder, DamageIsRefusedWhereNothingTellsWhatItConcerns) {
  const std::vector<VideoPacket> packets = InOrder({0, 1, 2, 3, 4});
  for (const DecodedTimes& decoded :
       {DecodedTimes{{2, 3, 4, 5, 6}, 2, true}, DecodedTimes{{2, 3, 5, 6}, 2, false},
        DecodedTimes{{2, 3, 4}, 2, false}}) {
    const absl::Status status = TimesByOrder(packets, decoded).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr("not when they are shown"));
  }
}

TEST(Edits, AreReadOfTheStream) {
  const char* log =
      "[mov @ 0x1] Processing st: 0, edit list 0 - media time: 12012, duration: 30030\n"
      "[mov @ 0x1] Processing st: 1, edit list 0 - media time: 7, duration: 8\n"
      "[mov @ 0x1] Processing st: 0, edit list 1 - media time: -1, duration: 5\nnonsense\n"
      "[mov @ 0x1] Processing st: 0, edit list 2 - media time: x, duration: 5\n";
  const std::vector<VideoEdit> edits = ParseEdits(log, 0);
  ASSERT_EQ(edits.size(), 2u);
  EXPECT_EQ(edits[0].media_time, 12012);
  EXPECT_EQ(edits[0].duration, 30030);
  EXPECT_EQ(edits[1].media_time, -1);
}

TEST(Edits, MayTrimAndWaitButNotCut) {
  const std::vector<VideoPacket> packets = InOrder({0, 1000, 2000, 3000, 4000});
  const auto check = [&](const std::vector<VideoEdit>& edits) {
    return std::string(CheckEdits(edits, packets, 1e-3).message());
  };
  EXPECT_EQ(check({}), "");
  EXPECT_EQ(check({{1500, 3000}}), "");
  EXPECT_EQ(check({{-1, 700}, {1500, 3000}}), "");
  EXPECT_EQ(check({{0, 2000}, {2010, 3000}}), "");  // durations are rounded
  EXPECT_THAT(check({{0, 2000}, {4000, 1000}}),
              AllOf(HasSubstr("a cut 2.000 s after its begin"), HasSubstr("2.000 s later than it is shown")));
  EXPECT_THAT(check({{2000, 2000}, {0, 1000}}), HasSubstr("4.000 s earlier than it is shown"));
  EXPECT_THAT(check({{0, 2000}, {-1, 1000}, {2000, 1000}}), HasSubstr("1.000 s earlier"));
}

TEST(Edits, ACutIsMoreThanHalfAPeriod) {
  const std::vector<VideoPacket> packets = InOrder({3000, 0, 1000, 2000});
  EXPECT_TRUE(CheckEdits({{0, 2000}, {2500, 3000}}, packets, 1e-3).ok());
  const absl::Status cut = CheckEdits({{-1, 100}, {0, 2000}, {2501, 3000}}, packets, 1e-3);
  EXPECT_TRUE(absl::IsInvalidArgument(cut));
  EXPECT_EQ(
      cut.message(),
      "its edit list has a cut 2.100 s after its begin: what follows was filmed 0.501 s later than it is "
      "shown; give the file as the camera wrote it, or each part as a file of its own");
  EXPECT_THAT(std::string(CheckEdits({{0, 2000}, {2001, 3000}}, InOrder({7}), 1e-3).message()),
              HasSubstr("0.001 s later"))
      << "one picture has no period";
}

TEST(Edits, HaveNumbersThatCanBeAddedUp) {
  const auto edits = [](const std::string& numbers) {
    return ParseEdits("Processing st: 2, edit list 0 - media time: " + numbers, 2).size();
  };
  EXPECT_EQ(edits("8796093022207, duration: 8796093022207"), 1u);
  EXPECT_EQ(edits("8796093022208, duration: 5"), 0u);
  EXPECT_EQ(edits("5, duration: 8796093022208"), 0u);
  EXPECT_EQ(edits("-8796093022208, duration: 5"), 0u);
  EXPECT_EQ(edits("5"), 0u);
}

// The first picture has the file's label, whatever the decoder waits for.
TEST(InspectVideo, KnowsWhenPicturesOfAviAreShown) {
  const TempFolder temp;
  MakeVideo(temp / "b.avi", Values(10, 30), "25", "-c:v libx264 -bf 2 -metadata timecode=10:00:00:00");
  const auto facts = InspectVideo(temp / "b.avi");
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(facts->complaint(), "");
  ASSERT_EQ(facts->frame_pts_size(), 30);
  EXPECT_EQ(facts->frame_pts(0), facts->begin_pts());
  EXPECT_NEAR(FrameTimes_s(*facts).front(), BeginTime_s(*facts), 1e-9);
  EXPECT_NEAR(FrameTimes_s(*facts).back() - FrameTimes_s(*facts).front(), 29 * 0.04, 1e-9);
}

}  // namespace
}  // namespace weft
