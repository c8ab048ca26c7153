#include "services/studio/video/frame_times.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "services/studio/video/camera_offsets.h"
#include "services/studio/video/frame_plan.h"

namespace weft {
namespace {

// Frames at these times, in counts of 1/`counts` s.
v1::VideoFacts Film(const std::vector<double>& times_s, int64_t counts, double declared_fps = 0) {
  v1::VideoFacts facts;
  facts.set_time_base_num(1);
  facts.set_time_base_den(counts);
  facts.set_declared_fps(declared_fps);
  for (const double time_s : times_s) facts.add_frame_pts(std::llround(time_s * static_cast<double>(counts)));
  facts.set_begin_pts(facts.frame_pts(0));
  return facts;
}

std::vector<double> EvenTimes(double first_s, double fps, int frames) {
  std::vector<double> times_s;
  for (int i = 0; i < frames; ++i) times_s.push_back(first_s + i / fps);
  return times_s;
}

TEST(FrameTimes, MillisecondsAreRoundedTimesOfAnEvenFilm) {
  for (const double fps : {24000.0 / 1001, 25.0, 30000.0 / 1001, 30.0, 50.0, 60000.0 / 1001, 120.0, 28.7})
    for (const int frames : {90, 3000}) {
      const v1::VideoFacts film = Film(EvenTimes(0.4, fps, frames), 1000);
      EXPECT_NEAR(Period_s(film) * fps, 1, fps == 28.7 ? 1e-4 : 1e-12) << fps;
      EXPECT_FALSE(HasVariableRate(film)) << fps;
      EXPECT_NEAR(FrameTimes_s(film)[40], 0.4 + 40 / fps, 0.0006) << fps;
    }
}

TEST(FrameTimes, FramesThatAreLeftOutCount) {
  std::vector<double> times_s = EvenTimes(0, 30000.0 / 1001, 300);
  times_s.erase(times_s.begin() + 100, times_s.begin() + 180);
  const v1::VideoFacts film = Film(times_s, 1000);
  EXPECT_NEAR(Period_s(film), 0.1001 / 3, 1e-12);
  EXPECT_NEAR(FrameTimes_s(film).back(), times_s.back(), 0.0006);
  EXPECT_TRUE(HasVariableRate(film));
}

TEST(FrameTimes, ExactAndUnevenOnesStayAsTheyAre) {
  const v1::VideoFacts exact = Film(EvenTimes(0.1, 30, 90), 600);
  for (int i = 0; i < 90; ++i)
    EXPECT_DOUBLE_EQ(FrameTimes_s(exact)[static_cast<size_t>(i)], (60.0 + 20 * i) / 600);
  std::vector<double> late = EvenTimes(0, 30, 90);
  for (size_t i = 50; i < late.size(); ++i) late[i] += 0.005;
  const v1::VideoFacts phone = Film(late, 600);
  EXPECT_DOUBLE_EQ(Period_s(phone), 1.0 / 30);
  EXPECT_NEAR(FrameTimes_s(phone).back(), late.back(), 1e-9);
}

TEST(FrameTimes, TheFilmBeginsWithItsFirstPicture) {
  v1::VideoFacts film = Film(EvenTimes(0.5, 25, 10), 1000);
  film.set_begin_pts(220);
  EXPECT_NEAR(BeginTime_s(film), 0.22, 1e-9);
}

TEST(PlanFrames, CamerasInStepShareSetsThoughTheirTimesAreRounded) {
  // The first one films later; the others differ by 14.5 ms, and by half a period.
  const double fps = 30000.0 / 1001;
  for (const double late_s : {0.0145, 0.5 / fps}) {
    const v1::VideoFacts a = Film(EvenTimes(0, fps, 450), 1000), b = Film(EvenTimes(0, fps, 330), 1000);
    std::vector<v1::CameraSync> syncs(3);
    syncs[0].set_offset_s(300 / fps);
    syncs[2].set_offset_s(late_s);
    const FramePlan plan = PlanFrames(CommonFrameTimes_s({a, b, b}, syncs));
    EXPECT_EQ(plan.set_times_s.size(), 750u);
    EXPECT_TRUE(std::equal(plan.frames[1].begin(), plan.frames[1].begin() + 330, plan.frames[2].begin()));
    EXPECT_EQ(plan.left_out, std::vector<uint64_t>({0, 0, 0}));
  }
}

}  // namespace
}  // namespace weft
