// What copies of takes say of themselves.
#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "capture/image/image_file.h"
#include "capture/take/recorded_take.h"
#include "services/studio/recording/take_copy.h"
#include "services/studio/recording/take_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using Step = std::pair<uint64_t, uint64_t>;
using Steps = std::vector<Step>;

CopyProgress KeepIn(Steps& steps) {
  return [&steps](uint64_t done, uint64_t total) { steps.emplace_back(done, total); };
}

// All that a part of a take has of the whole, but for its own id, version and times.
TEST(TakeOrigin, APartKeepsWhatTheTakeSaysOfItsCamerasAndClocks) {
  const TempFolder temp;
  PatternFrames cameras({"left", "right"}, 64, 48);
  RecordPattern(temp / "take", cameras);
  v1::Take whole = *ReadTakeFile(temp / "take");
  const std::string id = whole.id();
  const std::string about = R"(
      cameras { id: "left" source: "gige:1" model: "M" serial: "S" frames_received: 7 own_clock: true }
      cameras { id: "right" clock_problem: "it reads 0" }
      rig_hash: "rig" board_hash: "board" sync: "free run" own_clocks: true
      clocks_checksum: "0123456789abcdef")";
  v1::Take said;
  ASSERT_TRUE(google::protobuf::TextFormat::ParseFromString(about, &said));
  whole.MergeFrom(said);
  whole.set_slate("12A");
  ASSERT_TRUE(WriteTakeFile(temp / "take", whole).ok());
  TrimOptions options;
  options.recorder = SmallRecorder();
  options.view.first_set = 6;
  Steps steps;
  const auto sets = TrimTake(temp / "take", temp / "part", options, KeepIn(steps));
  ASSERT_TRUE(sets.ok()) << sets.status();
  EXPECT_EQ(*sets, 3u);
  EXPECT_THAT(steps, ElementsAre(Step(1, 3), Step(2, 3), Step(3, 3)));
  v1::Take part = *ReadTakeFile(temp / "part");
  EXPECT_NE(part.id(), id);
  EXPECT_GE(part.ended_host_time_ns(), part.started_host_time_ns());
  part.clear_id(), part.clear_weft_version();
  part.clear_started_host_time_ns(), part.clear_ended_host_time_ns();
  said.set_state(v1::TAKE_STATE_COMPLETE);
  said.set_origin("sets 6 to 8 of take " + id);
  said.set_sets_recorded(3);
  said.set_frames_missing(1);
  EXPECT_EQ(part.DebugString(), said.DebugString());
}

TEST(TakeOrigin, ATakeOfImagesNamesTheirFolder) {
  const TempFolder temp;
  PatternFrames cameras({"c00", "c01"}, 33, 17, RawFormat::kMono8);
  for (const char* frame : {"0007", "0009"})
    for (size_t camera = 0; camera < 2; ++camera) {
      const std::string path =
          temp / (std::string("images/") + frame + "/" + cameras.camera_ids()[camera] + ".png");
      std::filesystem::create_directories(std::filesystem::path(path).parent_path());
      const auto image = ToFrame(cameras.Frame(camera, 1));
      ASSERT_TRUE(image.ok() && WriteImageFile(path, *image).ok());
    }
  TakeCopyOptions options;
  options.recorder = SmallRecorder();
  options.fps = 10;
  Steps steps;
  const auto imported = ImportImages(temp / "images", temp / "take", options, KeepIn(steps));
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_THAT(steps, ElementsAre(Step(1, 2), Step(2, 2)));
  const v1::Take take = *ReadTakeFile(temp / "take");
  EXPECT_EQ(take.origin(), "images of images");
  EXPECT_EQ(take.state(), v1::TAKE_STATE_COMPLETE);
  EXPECT_EQ(take.sets_recorded(), 2u);
  ASSERT_EQ(take.cameras_size(), 2);
  for (const v1::TakeCamera& camera : take.cameras()) EXPECT_EQ(camera.source(), "images") << camera.id();
  const auto recorded = RecordedTake::Open(temp / "take");
  ASSERT_TRUE(recorded.ok()) << recorded.status();
  const auto frame = (*recorded)->ReadRaw(1, 1);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->camera_id, "c01");
  EXPECT_EQ(frame->device_frame_id, 9u);
  EXPECT_EQ(frame->device_time_ns, 900'000'000);

  options.fps = -1;
  EXPECT_EQ(ImportImages(temp / "images", temp / "other", options).status().message(),
            "fps must not be negative");
  options.fps = 0;
  std::filesystem::create_directories(temp / "empty");
  const absl::Status empty = ImportImages(temp / "empty", temp / "other", options).status();
  EXPECT_TRUE(absl::IsInvalidArgument(empty)) << empty;
  EXPECT_THAT(std::string(empty.message()),
              HasSubstr("empty: holds no image; expected <frame>/<camera>.png"));
  EXPECT_TRUE(absl::IsAlreadyExists(ImportImages(temp / "images", temp / "take", options).status()));
}

TEST(TakeOrigin, ImagesOfATakeAreMosaicsOrColours) {
  const TempFolder temp;
  PatternFrames cameras({"left"}, 64, 48);
  RecordPattern(temp / "take", cameras);
  for (const bool is_colour : {false, true}) {
    const std::string out = temp / (is_colour ? "colour" : "mosaic");
    Steps steps;
    const auto sets = ExportImages(temp / "take", out, is_colour, KeepIn(steps));
    ASSERT_TRUE(sets.ok()) << sets.status();
    EXPECT_EQ(*sets, 4u);
    EXPECT_THAT(steps, ElementsAre(Step(1, 4), Step(2, 4), Step(3, 4), Step(4, 4)));
    const auto image = ReadImageFile(out + "/0005/left.png");
    ASSERT_TRUE(image.ok()) << image.status();
    EXPECT_EQ(image->format, is_colour ? PixelFormat::kRgb8 : PixelFormat::kGrey8);
    EXPECT_EQ(image->width_px, 64);
    EXPECT_FALSE(std::filesystem::exists(out + "/0006/left.png")) << "it is missing there";
    EXPECT_TRUE(std::filesystem::exists(out + "/0006"));
  }
}

}  // namespace
}  // namespace weft
