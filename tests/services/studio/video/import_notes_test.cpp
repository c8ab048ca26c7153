#include "services/studio/video/import_notes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Two films of ten frames at 25 a second, of which all are in the take; offsets by their sound.
struct TwoFilms {
  TwoFilms() {
    for (int c = 0; c < 2; ++c) {
      v1::VideoFacts& video = videos.emplace_back();
      video.set_camera(c == 0 ? "left" : "right");
      video.set_path(c == 0 ? "/films/l.mp4" : "/films/r.mp4");
      video.set_time_base_num(1);
      video.set_time_base_den(25);
      for (int64_t i = 0; i < 10; ++i) video.add_frame_pts(i);
      v1::CameraSync& sync = *take.add_cameras()->mutable_sync();
      sync.set_offset_s(0.0125 * c);
      sync.set_offset_sigma_s(0.002);
      sync.set_found_by("ltc");
      sync.set_period_ms(40);
      plan.frames.push_back({0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
    }
    plan.left_out = {0, 0};
  }
  std::vector<LedgerNote> Notes() const {
    return NotesOn({.folder = "take",
                    .take = take,
                    .videos = videos,
                    .plan = plan,
                    .times_s = {},
                    .stream = {},
                    .mosaic = {}});
  }
  // Of the second camera.
  std::vector<std::string> Warnings() const {
    std::vector<std::string> texts;
    for (const LedgerNote& note : Notes())
      if (note.is_warning && note.camera == "right") texts.push_back(note.text);
    return texts;
  }

  v1::Take take;
  std::vector<v1::VideoFacts> videos;
  FramePlan plan;
};

TEST(ImportNotes, TellWhatGaveEachCameraItsOffset) {
  TwoFilms films;
  films.take.set_timecode("01:00:00:00");
  films.take.set_timecode_fps(25);
  films.take.mutable_cameras(1)->mutable_sync()->set_timecode("00:59:59:24");
  const std::vector<LedgerNote> notes = films.Notes();
  ASSERT_EQ(notes.size(), 3u);
  EXPECT_EQ(notes[0].camera, "");
  EXPECT_EQ(notes[0].text, "timecode of the first frame set 01:00:00:00 at 25 frames a second");
  EXPECT_EQ(notes[1].camera, "left");
  EXPECT_EQ(notes[1].text, "offset 0.0000 s, sigma 0.0020 s, by ltc");
  EXPECT_EQ(notes[2].camera, "right");
  EXPECT_EQ(notes[2].text, "offset 0.0125 s, sigma 0.0020 s, by ltc, timecode 00:59:59:24");
  for (const LedgerNote& note : notes) EXPECT_FALSE(note.is_warning) << note.text;
}

TEST(ImportNotes, DamageSaysWhereAndWhatHelps) {
  TwoFilms films;
  v1::VideoFacts& video = films.videos[1];
  video.set_begin_pts(25);
  video.set_complaint("bad cabac");
  EXPECT_THAT(films.Warnings(),
              ElementsAre(HasSubstr("the take has the 10 pictures that it holds (ffmpeg: bad cabac)")));
  video.add_damaged_pts(50);  // a second after the beginning
  EXPECT_THAT(films.Warnings(),
              ElementsAre(HasSubstr("1 of 11 pictures are missing in the take, at 1.000 s: ")));
  video.add_damaged_pts(75);
  EXPECT_THAT(films.Warnings(),
              ElementsAre(HasSubstr("2 of 12 pictures are missing in the take, from 1.000 to 2.000 s: ")));
  EXPECT_THAT(films.Warnings(), Contains(HasSubstr("copy it again from the camera")));
}

TEST(ImportNotes, PicturesThatAreNotShownAreCountedOnce) {
  TwoFilms films;
  v1::VideoFacts& video = films.videos[1];
  video.set_frames_declared(10);
  EXPECT_THAT(films.Warnings(), IsEmpty());
  video.set_frames_declared(12);
  EXPECT_THAT(films.Warnings(), ElementsAre("its header lists 12 frames, and 10 are shown and in the take"));
  video.set_same_time(2);  // which are the two
  EXPECT_THAT(films.Warnings(), ElementsAre(HasSubstr("2 of its pictures have the time of the one before")));
  video.set_same_time(0);
  video.set_hidden(2);
  EXPECT_THAT(films.Warnings(), ElementsAre(HasSubstr("its edit list hides 2 of its pictures")));
}

TEST(ImportNotes, ARateThatVariesAndFieldsAreTold) {
  TwoFilms films;
  films.videos[1].set_interlaced(4);
  v1::CameraSync& sync = *films.take.mutable_cameras(1)->mutable_sync();
  sync.set_shortest_ms(20);
  sync.set_longest_ms(61.5);
  EXPECT_THAT(films.Warnings(), ElementsAre(HasSubstr("frames are 20.0 to 61.5 ms apart, 40.0 in the middle"),
                                            HasSubstr("4 of its 10 pictures are coded as two fields")));
}

TEST(ImportNotes, AClipThatIsShorterThanTheTakeSaysItsSets) {
  TwoFilms films;
  films.plan.frames[1] = {-1, -1, 0, 1, -1, 3, 4, 5, 6, -1};
  EXPECT_THAT(films.Warnings(), ElementsAre("it films sets 2 to 8 of 0 to 9; it is missing in the others"));
  films.plan.frames[1] = {0, 1, 2, -1, 4, 5, 6, 7, 8, 9};  // a gap within is none of its ends
  EXPECT_THAT(films.Warnings(), IsEmpty());
}

TEST(ImportNotes, FramesInNoSetAreToldWithBothPeriods) {
  TwoFilms films;
  films.plan.left_out[1] = 3;
  films.take.mutable_cameras(1)->mutable_sync()->set_period_ms(20);
  EXPECT_THAT(films.Warnings(),
              ElementsAre("3 of its 10 frames are in no set, since another one is nearer: frames "
                          "are 20.00 ms apart, sets 40.00 ms"));
}

TEST(ImportNotes, TimesOfFilesAreRightToASecondAlone) {
  TwoFilms films;
  films.take.mutable_cameras(1)->mutable_sync()->set_found_by("file-times");
  EXPECT_THAT(films.Warnings(),
              ElementsAre(HasSubstr("right to a second alone; motion or timecode tell more")));
}

// 29.97 frames a second whose labels leave no number out are slower than a clock, as 24, 25 and drop frames
// are not.
TEST(ImportNotes, TimecodesOfTwoSpeedsAreTold) {
  TwoFilms films;
  const auto label = [&](int camera, const std::string& timecode, double fps) {
    v1::VideoFacts& video = films.videos[static_cast<size_t>(camera)];
    video.set_timecode(timecode);
    video.set_timecode_fps(fps);
    video.set_is_timecode_fps_sure(true);
    films.take.mutable_cameras(camera)->mutable_sync()->set_found_by("timecode");
  };
  constexpr double kSlow = 30000.0 / 1001;
  const auto told = ElementsAre(HasSubstr("its timecode and that of left count at different speeds"));
  label(0, "10:00:00:00", 30);
  label(1, "10:00:00:00", kSlow);
  EXPECT_THAT(films.Warnings(), told);
  label(0, "10:00:00;00", kSlow);
  EXPECT_THAT(films.Warnings(), told);
  label(1, "10:00:00;00", kSlow);
  EXPECT_THAT(films.Warnings(), IsEmpty());
  label(0, "10:00:00:00", kSlow);
  label(1, "10:00:00:00", kSlow);
  EXPECT_THAT(films.Warnings(), IsEmpty());
  label(1, "10:00:00:00", 25);
  EXPECT_THAT(films.Warnings(), told);
  films.take.mutable_cameras(0)->mutable_sync()->set_found_by("given");
  EXPECT_THAT(films.Warnings(), IsEmpty()) << "there is no other timecode";
  label(0, "10:00:00:00", kSlow);
  films.take.mutable_cameras(1)->mutable_sync()->set_found_by("given");
  EXPECT_THAT(films.Warnings(), IsEmpty()) << "its own is not used";
}

TEST(ImportNotes, AWarningNamesTheFileOfItsCamera) {
  const TwoFilms films;
  EXPECT_EQ(WarningOf({"right", "it is short", true}, films.videos), "right (/films/r.mp4): it is short");
  EXPECT_EQ(WarningOf({"middle", "it is short", true}, films.videos), "middle: it is short");
}

}  // namespace
}  // namespace weft
