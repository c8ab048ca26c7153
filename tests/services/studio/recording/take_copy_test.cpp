#include "services/studio/recording/take_copy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "capture/image/image_file.h"
#include "capture/take/image_folder.h"
#include "capture/take/recorded_take.h"
#include "capture/take/recover_take.h"
#include "services/formats/files/atomic_file.h"
#include "services/studio/recording/clock_log.h"
#include "services/studio/recording/disk_speed.h"
#include "services/studio/recording/take_file.h"
#include "tests/capture/pattern_frames.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TakeCopyOptions SmallCopy() {
  TakeCopyOptions options;
  options.recorder.low_disk_bytes = 0;
  options.recorder.take.stream.preallocate_bytes = 0;
  return options;
}

// Grey images of two cameras in the frames 7, 9 and 10; one is broken, one is not there.
void WriteImages(const std::string& folder) {
  PatternFrames cameras({"left", "right"}, 33, 17, RawFormat::kMono8);
  for (const uint64_t frame : {7, 9, 10})
    for (size_t camera = 0; camera < 2; ++camera) {
      const std::string path =
          folder + "/" + FrameNameOf(frame) + "/" + cameras.camera_ids()[camera] + ".png";
      WriteBytes(path, "no image");
      if (frame == 9 && camera == 1) continue;
      const auto image = ToFrame(cameras.Frame(camera, frame));
      ASSERT_TRUE(image.ok() && WriteImageFile(path, *image).ok());
    }
  std::filesystem::remove(folder + "/0010/left.png");
}

TEST(TakeCopy, ImagesGoInAndComeOutBitByBit) {
  for (const bool compress : {false, true}) {
    const TempFolder temp;
    WriteImages(temp / "images");
    TakeCopyOptions options = SmallCopy();
    options.fps = 100;
    options.recorder.take.stream.compress = compress;
    options.mosaic = PixelFormat::kBayerGb8;
    const auto sets = ImportImages(temp / "images", temp / "take", options);
    ASSERT_TRUE(sets.ok()) << sets.status();
    EXPECT_EQ(sets->sets, 3u);
    EXPECT_THAT(VerifyTake(temp / "take")->problems, IsEmpty());
    const auto take = RecordedTake::Open(temp / "take");
    EXPECT_THAT((*take)->sets(), ElementsAre(7, 9, 10));
    EXPECT_EQ((*take)->ReadRaw(1, 0)->device_time_ns, 90'000'000);
    EXPECT_EQ((*take)->ReadRaw(1, 0)->format, RawFormat::kBayerGb8);
    EXPECT_THAT(std::string((*take)->ReadRaw(1, 1).status().message()),
                HasSubstr("not a PNG, JPEG or TIFF image"));
    EXPECT_EQ((*take)->ReadRaw(2, 0).status().message(), "no image in the dump");

    ASSERT_TRUE(ExportImages(temp / "take", temp / "out", false).ok());
    const auto images = ListImageFolder(temp / "out");
    ASSERT_TRUE(images.ok());
    PatternFrames cameras({"left", "right"}, 33, 17, RawFormat::kMono8);
    size_t count = 0;
    for (const auto& [frame, files] : images->frames)
      for (const auto& [camera, path] : files) {
        const RawFrame expected = cameras.Frame(camera == "right", std::stoul(frame));
        const auto image = ReadImageFile(path);
        ASSERT_TRUE(image.ok());
        EXPECT_EQ(0, std::memcmp(image->pixels->data(), expected.bytes->data(), expected.bytes->size()));
        ++count;
      }
    EXPECT_EQ(count, 4u);
  }
}

// One grey picture at each of these paths.
void WritePictures(const std::string& folder, const std::vector<std::string>& paths) {
  PatternFrames camera({"c00"}, 33, 17, RawFormat::kMono8);
  for (const std::string& path : paths) {
    std::filesystem::create_directories(std::filesystem::path(folder + "/" + path).parent_path());
    const auto image = ToFrame(camera.Frame(0, 1));
    ASSERT_TRUE(image.ok() && WriteImageFile(folder + "/" + path, *image).ok());
  }
}

struct Set {
  uint64_t number = 0;
  int64_t time_ns = 0;
  bool operator==(const Set&) const = default;
};

std::vector<Set> SetsOf(const std::string& take) {
  std::vector<Set> sets;
  const auto opened = RecordedTake::Open(take);
  EXPECT_TRUE(opened.ok()) << opened.status();
  for (size_t i = 0; i < (*opened)->sets().size(); ++i)
    sets.push_back({(*opened)->sets()[i], (*opened)->ReadRaw(i, 0)->device_time_ns});
  return sets;
}

TEST(TakeCopy, NamesThatAreTimesGiveTimes) {
  const struct {
    std::vector<std::string> names;
    double fps;
    std::vector<Set> sets;
    const char* note;  // nullptr: none
  } kDumps[] = {
      {{"1623840123456789012", "1623840123490122345", "1623840123556789012"},
       30,
       {{0, 1623840123456789012}, {1, 1623840123490122345}, {3, 1623840123556789012}},
       "times in ns since 1970"},
      {{"1623840123456", "1623840123490"},
       0,
       {{0, 1623840123456000000}, {1, 1623840123490000000}},
       "times in ms"},
      {{"1305031102.175304", "1305031102.211214"},
       0,
       {{0, 1305031102175304000}, {1, 1305031102211214000}},
       "times in s since 1970"},
      {{"0000", "0003", "0006"}, 100, {{0, 0}, {3, 30000000}, {6, 60000000}}, nullptr},
      {{"frame_0002", "frame_0010"}, 0, {{2, 0}, {10, 0}}, nullptr},
      {{"9223372036854775806", "9223372036854775807"},
       30,
       {{0, 0}, {1, 33333333}},
       "numbered from frame 9223"},
      {{"18446744073709551614", "18446744073709551615"}, 0, {{0, 0}, {1, 0}}, "neither times nor numbers"},
      {{"20210616101530", "20210616101531"}, 0, {{0, 0}, {1, 0}}, "numbered from frame 20210616101530"},
      {{"3", "20210616101530"}, 0, {{3, 0}, {4, 0}}, "neither times nor numbers"},
      {{"-1", "-2"}, 0, {{1, 0}, {2, 0}}, nullptr},
      {{"walk", "wave"}, 0, {{0, 0}, {1, 0}}, nullptr},
  };
  for (const auto& [names, fps, sets, note] : kDumps) {
    const TempFolder temp;
    std::vector<std::string> paths;
    for (const std::string& name : names) paths.push_back(name + "/c00.png");
    WritePictures(temp / "images", paths);
    TakeCopyOptions options = SmallCopy();
    options.fps = fps;
    const auto imported = ImportImages(temp / "images", temp / "take", options);
    ASSERT_TRUE(imported.ok()) << imported.status();
    EXPECT_EQ(SetsOf(temp / "take"), sets) << names[0];
    EXPECT_EQ(imported->notes.size(), note != nullptr ? 1u : 0u) << names[0];
    if (note == nullptr) continue;
    EXPECT_THAT(imported->notes, ElementsAre(HasSubstr(note)));
    EXPECT_THAT(DescribeTake(temp / "take")->notes(), ElementsAre(HasSubstr(note)));
  }
}

TEST(TakeCopy, RefusesRatesThatTimesContradictAndLeavesNothing) {
  const TempFolder temp;
  WritePictures(temp / "images", {"1623840123456789012/c00.png", "1623840123490122345/c00.png"});
  WritePictures(temp / "late", {"2147483646/c00.png", "2147483647/c00.png"});
  for (const auto& [images, fps] : {std::pair("images", 25.0), std::pair("late", 1e-10)}) {
    TakeCopyOptions options = SmallCopy();
    options.fps = fps;
    const auto imported = ImportImages(temp / images, temp / "take", options);
    EXPECT_EQ(imported.status().code(), absl::StatusCode::kInvalidArgument) << images;
    EXPECT_THAT(std::string(imported.status().message()), HasSubstr("fps"));
    EXPECT_FALSE(std::filesystem::exists(temp / "take"));
  }
}

TEST(TakeCopy, FoldersOfCamerasAndWhatWasLeftOutAreSaid) {
  const TempFolder temp;
  WritePictures(temp / "images",
                {"c00/0000.png", "c00/0001.png", "c01/0000.png", "c01/0001.png", "@eaDir/0000.png"});
  const auto imported = ImportImages(temp / "images", temp / "take", SmallCopy());
  ASSERT_TRUE(imported.ok()) << imported.status();
  const auto take = RecordedTake::Open(temp / "take");
  EXPECT_THAT((*take)->camera_ids(), ElementsAre("c00", "c01"));
  EXPECT_THAT((*take)->sets(), ElementsAre(0, 1));
  EXPECT_THAT(imported->notes, ElementsAre(HasSubstr("read as <camera>/<frame>"), HasSubstr("@eaDir")));
  EXPECT_THAT(DescribeTake(temp / "take")->notes(),
              ElementsAre(HasSubstr("read as <camera>/<frame>"), HasSubstr("@eaDir")));
}

TEST(TakeCopy, TrimsToARangeAndShiftsTheTimesOfACamera) {
  const TempFolder temp;
  WriteImages(temp / "images");
  ASSERT_TRUE(ImportImages(temp / "images", temp / "take", SmallCopy()).ok());
  TrimOptions options;
  options.recorder = SmallCopy().recorder;
  options.view.first_set = 8;
  options.view.shift_ns["right"] = -250;
  const auto sets = TrimTake(temp / "take", temp / "part", options);
  ASSERT_TRUE(sets.ok()) << sets.status();
  const auto part = RecordedTake::Open(temp / "part");
  EXPECT_THAT((*part)->sets(), ElementsAre(9, 10));
  EXPECT_EQ((*part)->ReadRaw(1, 1)->device_time_ns, -250);
  EXPECT_EQ((*part)->ReadRaw(1, 0).status().message(), "no image in the dump");
  const auto info = DescribeTake(temp / "part");
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_THAT(info->take().origin(),
              AllOf(HasSubstr("sets 9 to 10 of take"), HasSubstr("camera right shifted by -0.000250 ms")));
  EXPECT_EQ(info->timing(1).frames(), 1u);
  EXPECT_EQ(info->causes_size(), 2);

  options.view.first_set = 11;
  EXPECT_THAT(std::string(TrimTake(temp / "take", temp / "none", options).status().message()),
              HasSubstr("it holds 7 to 10"));
  options.view.first_set = 0;
  options.view.shift_ns["up"] = 1;
  EXPECT_THAT(std::string(TrimTake(temp / "take", temp / "none", options).status().message()),
              HasSubstr("camera up"));
}

TEST(TakeCopy, TrimmingKeepsTheClocksAndWhySetsWereDropped) {
  const TempFolder temp;
  PatternFrames cameras({"left"}, 64, 48);
  const auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), SmallCopy().recorder);
  ASSERT_TRUE(recorder.ok()) << recorder.status();
  ASSERT_TRUE(WriteFileAtomically(ClockLogFile(temp / "take"), "readings").ok());
  for (const uint64_t number : {1, 2, 6}) ASSERT_TRUE((*recorder)->OfferAndWait(cameras.Set(number)));
  (*recorder)->NoteDropped(3, 5, 0, "disk too slow");
  ASSERT_TRUE((*recorder)->Stop().ok());
  TrimOptions options;
  options.recorder = SmallCopy().recorder;
  options.view.first_set = 2;
  EXPECT_EQ(*TrimTake(temp / "take", temp / "part", options), 2u);
  EXPECT_EQ(*ReadWholeFile(ClockLogFile(temp / "part")), "readings");
  EXPECT_EQ(VerifyTake(temp / "part")->dropped, 3u);
}

TEST(TakeCopy, StopsImportingAtTheLowDiskMark) {
  const TempFolder temp;
  WriteImages(temp / "images");
  TakeCopyOptions options = SmallCopy();
  options.recorder.low_disk_bytes = uint64_t{1} << 62;
  options.recorder.flush_interval_ms = 1;
  const auto sets = ImportImages(temp / "images", temp / "take", options);
  if (sets.ok()) {  // the three images may have been quicker than the look at the disk
    EXPECT_THAT(VerifyTake(temp / "take")->problems, IsEmpty());
    return;
  }
  EXPECT_THAT(std::string(sets.status().message()), HasSubstr("disk nearly full"));
  EXPECT_FALSE(std::filesystem::exists(temp / "take")) << "a part of the images is no take";
  EXPECT_FALSE(std::filesystem::exists(temp / "take.unfinished"));
}

// As long as it lives no file grows beyond this, as on a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit = {bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    signal(SIGXFSZ, handler_);
  }

 private:
  sighandler_t handler_;
  rlimit before_ = {};
};

TEST(TakeCopy, CopiesThatFailLeaveNothing) {
  const TempFolder temp;
  PatternFrames cameras({"left", "right"}, 64, 48);
  const auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), SmallCopy().recorder);
  ASSERT_TRUE(recorder.ok()) << recorder.status();
  for (uint64_t number = 1; number <= 9; ++number)
    ASSERT_TRUE((*recorder)->OfferAndWait(cameras.Set(number)));
  ASSERT_TRUE((*recorder)->Stop().ok());
  v1::Take about = NewTake("");
  for (const std::string& id : cameras.camera_ids()) about.add_cameras()->set_id(id);
  ASSERT_TRUE(WriteTakeFile(temp / "take", about).ok());
  WritePictures(temp / "pictures", {"0001/left.png", "0002/left.png"});
  TrimOptions options;
  options.recorder = SmallCopy().recorder;
  {
    const FullDisk no_images(20);
    EXPECT_FALSE(ExportImages(temp / "take", temp / "images", false).ok());
    EXPECT_FALSE(ImportImages(temp / "pictures", temp / "imported", SmallCopy()).ok());
  }
  {
    const FullDisk streams_end(30'000);
    EXPECT_FALSE(TrimTake(temp / "take", temp / "part", options).ok());
  }
  for (const char* left :
       {"part", "part.unfinished", "images", "images.unfinished", "imported", "imported.unfinished"})
    EXPECT_FALSE(std::filesystem::exists(temp / left)) << left;
  // With room they are as ever.
  EXPECT_EQ(*TrimTake(temp / "take", temp / "part", options), 9u);
  EXPECT_EQ(*ExportImages(temp / "take", temp / "images", false), 9u);
  // Nor do they begin where something stands.
  WriteBytes(temp / "notes/day.txt", "kept");
  EXPECT_EQ(TrimTake(temp / "take", temp / "notes", options).status().code(),
            absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(ExportImages(temp / "take", temp / "notes", false).status().code(),
            absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(ReadBytes(temp / "notes/day.txt"), "kept");
}

TEST(DiskSpeed, MeasuresAndLeavesNothingBehind) {
  const TempFolder temp;
  const auto speed = MeasureDiskSpeed(temp.path(), 16 << 20);
  ASSERT_TRUE(speed.ok()) << speed.status();
  EXPECT_GT(speed->bytes_per_s, 0);
  EXPECT_TRUE(std::filesystem::is_empty(temp.path()));
  EXPECT_FALSE(MeasureDiskSpeed(temp / "nowhere", 1).ok());
}

TEST(TakeCopy, PicturesOfAnotherSizeAreMissingAndNamed) {
  const TempFolder temp;
  std::vector<std::string> paths;
  for (const char* frame : {"0000", "0001", "0002", "0003"}) paths.push_back(std::string(frame) + "/c00.png");
  WritePictures(temp / "images", paths);
  Frame other;
  other.width_px = 3, other.height_px = 5;
  other.pixels = std::make_shared<const std::vector<uint8_t>>(15, uint8_t{7});
  ASSERT_TRUE(WriteImageFile(temp / "images/0002/c00.png", other).ok());
  const auto imported = ImportImages(temp / "images", temp / "take", SmallCopy());
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_THAT(imported->notes, ElementsAre(HasSubstr("missing: 3x5 (0002)"),
                                           HasSubstr("1 of 4 pictures are missing, the first: ")));
  const auto take = RecordedTake::Open(temp / "take");
  EXPECT_TRUE((*take)->ReadRaw(1, 0).ok());
  EXPECT_THAT(std::string((*take)->ReadRaw(2, 0).status().message()),
              HasSubstr("is 3x5 pixels, most pictures"));
}

TEST(TakeCopy, PicturesOfWhichNoneCanBeReadAreNoTake) {
  const TempFolder temp;
  WriteBytes(temp / "images/0000/c00.png", "\x89PNG\r\n\x1a\nends here");
  const auto imported = ImportImages(temp / "images", temp / "take", SmallCopy());
  EXPECT_EQ(imported.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(imported.status().message()), HasSubstr("none of the 1 pictures could be read"));
  EXPECT_FALSE(std::filesystem::exists(temp / "take"));
}

TEST(TakeCopy, FramesOfOneCameraEachAreSaid) {
  const TempFolder temp;
  WritePictures(temp / "images", {"0000/c00.png", "0001/c01.png"});
  const auto imported = ImportImages(temp / "images", temp / "take", SmallCopy());
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_THAT(imported->notes.back(), HasSubstr("no frame has pictures of all cameras"));
}

TEST(TakeCopy, NumbersThatMayBeTimesAreSaidAndTaken) {
  const TempFolder temp;
  WritePictures(temp / "images", {"000040/c00.png", "000080/c00.png", "000120/c00.png"});
  const auto numbers = ImportImages(temp / "images", temp / "numbers", SmallCopy());
  ASSERT_TRUE(numbers.ok()) << numbers.status();
  EXPECT_THAT(numbers->notes, ElementsAre(HasSubstr("--names s, ms, us, ns or clock")));
  EXPECT_EQ(SetsOf(temp / "numbers")[1].number, 80u);
  TakeCopyOptions options = SmallCopy();
  options.names = NameMeaning::kMilliseconds;
  const auto times = ImportImages(temp / "images", temp / "times", options);
  ASSERT_TRUE(times.ok()) << times.status();
  EXPECT_THAT(times->notes, ElementsAre(HasSubstr("times in ms")));
  EXPECT_EQ(SetsOf(temp / "times")[1].number, 1u);
  EXPECT_EQ(SetsOf(temp / "times")[1].time_ns, 80'000'000);
}

}  // namespace
}  // namespace weft
