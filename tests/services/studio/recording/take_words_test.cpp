#include "services/studio/recording/take_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "services/studio/recording/loss_verdict.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

void AddCause(v1::TakeInfo& info, const std::string& camera, const std::string& cause, uint64_t count) {
  v1::TakeCause& added = *info.add_causes();
  added.set_camera(camera);
  added.set_cause(cause);
  added.set_count(count);
}

TEST(TakeWords, AreThoseOfTheField) {
  EXPECT_EQ(WithSeparators(0), "0");
  EXPECT_EQ(WithSeparators(999), "999");
  EXPECT_EQ(WithSeparators(17953431873), "17,953,431,873");
  EXPECT_EQ(NamesInShort({"a"}), "a");
  EXPECT_EQ(NamesInShort({"a", "b", "c"}), "a, b and c");
  EXPECT_EQ(NamesInShort({"a", "b", "c", "d", "e"}), "a, b, c and 2 more");
  EXPECT_EQ(RoomText(76e9, 7.9e6, 2.6e9),
            "76 GB free: 2.7 h at this session's 7.9 MB/s (29 s at the disk's full speed)");
  EXPECT_EQ(RoomText(7.64e9, 0, 2.6e9), "7.6 GB free: 3 s at the disk's full speed");
  EXPECT_EQ(RoomText(76e9, 0, 0), "76 GB free");
  // 2.45 GB above the mark at 31.4 MB/s.
  EXPECT_EQ(RoomText(4.6e9, 31.4e6, 0, 2.15e9),
            "4.6 GB free, 2.1 GB of it stay free: 78 s at this session's 31.4 MB/s");
}

TEST(TakeWords, EqualCausesAreOneLine) {
  v1::TakeInfo info;
  AddCause(info, "", "no camera delivered a frame", 17953431873);
  AddCause(info, "c01", "2.4 to 25.0 ms late (tolerance 2 ms)", 40);
  for (const char* camera : {"c02", "c03", "c04", "c05", "c06"})
    AddCause(info, camera, "the camera is disconnected", 7);
  AddCause(info, "", "disk too slow: the queue of 2 MiB is full", 1);
  EXPECT_THAT(
      CauseLines(info.causes()),
      ElementsAre("no camera delivered a frame at 17,953,431,873 triggers",
                  "c01: 40 frames missing, 2.4 to 25.0 ms late (tolerance 2 ms)",
                  "5 cameras (c02, c03, c04 and 2 more): 35 frames missing: the camera is disconnected",
                  "1 frame set dropped: disk too slow: the queue of 2 MiB is full"));
  EXPECT_THAT(CameraLines({{"a", "late"}, {"b", "early"}, {"c", "late"}}, 3),
              ElementsAre("2 of 3 cameras (a and c): late", "camera b: early"));
}

v1::Verdict VerdictOf(v1::TakeInfo info) {
  AssessLosses(info);
  return info.verdict();
}

TEST(LossVerdict, SaysWhatHappenedAndWhatToDo) {
  v1::TakeInfo info;
  info.set_path("walk");
  EXPECT_EQ(VerdictOf(info).grade(), v1::GRADE_BAD);
  EXPECT_EQ(VerdictOf(info).reason(), "the take holds no frame set");
  info.set_sets(1000);
  info.set_sets_complete(1000);
  EXPECT_EQ(VerdictOf(info).grade(), v1::GRADE_GOOD);
  EXPECT_EQ(VerdictOf(info).reason(), "all 1,000 frame sets have all cameras");
  EXPECT_EQ(VerdictOf(info).remedy(), "");
  info.set_sets_complete(950);
  AddCause(info, "c02", "the camera is disconnected", 50);
  EXPECT_EQ(VerdictOf(info).grade(), v1::GRADE_USABLE);
  info.set_sets_dropped(3000);
  AddCause(info, "", "no camera delivered a frame: all are disconnected", 3000);
  const v1::Verdict bad = VerdictOf(info);
  EXPECT_EQ(bad.grade(), v1::GRADE_BAD);
  EXPECT_EQ(bad.reason(),
            "950 of 4,000 frame sets have all cameras; no camera delivered a frame at 3,000 triggers: "
            "all are disconnected");
  EXPECT_THAT(bad.remedy(), HasSubstr("retake now"));
}

TEST(AssessLosses, RemediesOfVideosAreOfVideos) {
  for (const auto& [cause, remedy] :
       {std::pair{"the video begins later", "take trim"}, std::pair{"the video has ended", "--offset"},
        std::pair{"the video is damaged at this time", "Copy the video again"},
        std::pair{"the video has no frame at this time", "at a fixed rate"}}) {
    v1::TakeInfo info;
    info.set_sets(100);
    info.set_sets_complete(50);
    AddCause(info, "c02", cause, 50);
    EXPECT_THAT(VerdictOf(info).remedy(), HasSubstr(remedy));
    EXPECT_THAT(VerdictOf(info).remedy(), ::testing::Not(HasSubstr("take sync")));
  }
}

}  // namespace
}  // namespace weft
