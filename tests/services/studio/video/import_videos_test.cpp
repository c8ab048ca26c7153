#include "services/studio/video/import_videos.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/mutex.h"
#include "capture/take/check_take.h"
#include "capture/take/recorded_take.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/rig_file.h"
#include "services/ground/process/unique_fd.h"
#include "services/studio/recording/take_file.h"
#include "tests/services/studio/video/made_video.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Value of every frame by set, -1 where the camera has none.
std::vector<int> CountsOf(const std::string& take, size_t camera) {
  const auto recorded = RecordedTake::Open(take);
  EXPECT_TRUE(recorded.ok()) << recorded.status();
  std::vector<int> values;
  for (size_t set = 0; recorded.ok() && set < (*recorded)->sets().size(); ++set) {
    const auto frame = (*recorded)->ReadRaw(set, camera);
    values.push_back(frame.ok() ? frame->bytes->data()[0] : -1);
  }
  return values;
}

std::string Why(const VideoImportOptions& options, const std::string& out) {
  const auto result = ImportVideos(options, out);
  return result.ok() ? "" : std::string(result.status().message());
}

// Two clips of one scene: a frame's value is the scene's frame. The second begins 3 frames later and ends 2
// frames later.
VideoImportOptions TwoClips(const TempFolder& temp) {
  MakeVideo(temp / "left.mkv", Values(10, 8), "25", "-c:v ffv1 -timecode 10:00:00:23");
  MakeVideo(temp / "right.mkv", Values(13, 7), "25", "-c:v ffv1 -timecode 10:00:01:01");
  VideoImportOptions options;
  options.videos = {{"left", temp / "left.mkv"}, {"right", temp / "right.mkv"}};
  return options;
}

TEST(ImportVideos, PutsClipsInStepByTimecode) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  options.said.set_slate("12A take 3");
  const auto result = ImportVideos(options, temp / "take");
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(CountsOf(temp / "take", 0), ElementsAre(10, 11, 12, 13, 14, 15, 16, 17, -1, -1));
  EXPECT_THAT(CountsOf(temp / "take", 1), ElementsAre(-1, -1, -1, 13, 14, 15, 16, 17, 18, 19));
  EXPECT_THAT(result->warnings, AllOf(Contains(HasSubstr("left.mkv): it films sets 0 to 7 of 0 to 9")),
                                      Contains(HasSubstr("right.mkv): it films sets 3 to 9 of 0 to 9"))));
  const auto file = ReadTakeFileStrictly(temp / "take");
  ASSERT_TRUE(file.ok()) << file.status();
  const v1::Take& take = file->take;
  EXPECT_EQ(take.state(), v1::TAKE_STATE_COMPLETE);
  EXPECT_EQ(take.slate(), "12A take 3");
  EXPECT_EQ(take.timecode(), "10:00:00:23");
  EXPECT_EQ(take.timecode_fps(), 25);
  EXPECT_EQ(take.sets_recorded(), 10u);
  EXPECT_EQ(take.frames_missing(), 5u);
  EXPECT_EQ(take.cameras(1).sync().found_by(), "timecode");
  EXPECT_NEAR(take.cameras(1).sync().offset_s() - take.cameras(0).sync().offset_s(), 0.12, 1e-9);
  EXPECT_NEAR(take.cameras(1).sync().offset_sigma_s(), 0.04 / std::sqrt(12), 1e-4);
  EXPECT_FALSE(fs::exists(temp / "take.unfinished"));
  EXPECT_FALSE(fs::exists(temp / "take/import.json"));
  const auto recorded = RecordedTake::Open(temp / "take");
  EXPECT_THAT((*recorded)->warnings(), IsEmpty());
  EXPECT_EQ((*recorded)->ReadRaw(0, 1).status().message(), "the video begins later");
  EXPECT_EQ((*recorded)->ReadRaw(9, 0).status().message(), "the video has ended");
  EXPECT_EQ((*recorded)->Record(5, 0)->device_time_ns, 200'000'000);
  const auto check = VerifyTake(temp / "take");
  ASSERT_TRUE(check.ok()) << check.status();
  EXPECT_THAT(check->problems, IsEmpty());
  EXPECT_THAT(Why(options, temp / "take"), HasSubstr("is there already"));
}

TEST(ImportVideos, WordsThatNoTakeMayHaveAreRefusedBeforeAnythingIsRead) {
  const TempFolder temp;
  VideoImportOptions options;
  options.videos = {{"left", temp / "missing.mkv"}};
  options.said.set_slate("12A\x1b[2J");
  EXPECT_THAT(Why(options, temp / "take"), HasSubstr("slate: must be UTF-8 text without control characters"));
  options.said.set_slate("");
  options.said.set_notes(std::string(4097, 'x'));
  EXPECT_THAT(Why(options, temp / "take"), HasSubstr("notes: 4097 bytes, at most 4096"));
  EXPECT_FALSE(fs::exists(temp / "take.unfinished"));
}

TEST(ImportVideos, AsksForARemedyWithoutTimecode) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  MakeVideo(temp / "right.mkv", Values(13, 7), "25");
  EXPECT_THAT(Why(options, temp / "take"),
              AllOf(HasSubstr("no timecode in the videos of right"), HasSubstr("--rig RIG --board BOARD"),
                    HasSubstr("--sync together")));
  options.sync = SyncWay::kTogether;
  const auto together = ImportVideos(options, temp / "take");
  ASSERT_TRUE(together.ok()) << together.status();
  EXPECT_THAT(CountsOf(temp / "take", 1), ElementsAre(13, 14, 15, 16, 17, 18, 19, -1));
}

TEST(ImportVideos, TakesOffsetsThatAreGiven) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  options.sync = SyncWay::kTogether;
  options.given_s = {{"left", 0}, {"right", 0.12}};
  ASSERT_TRUE(ImportVideos(options, temp / "take").ok());
  EXPECT_THAT(CountsOf(temp / "take", 1), ElementsAre(-1, -1, -1, 13, 14, 15, 16, 17, 18, 19));
  options.given_s = {{"middle", 0.12}};
  EXPECT_THAT(Why(options, temp / "other"), HasSubstr("--offset middle: there is no video"));
}

TEST(ImportVideos, KeepsEveryFrameOfAVariableRate) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  // Every fourth frame is lost.
  MakeVideo(temp / "right.mkv", Values(10, 8), "25",
            "-vf \"select='not(eq(mod(n,4),2))'\" -fps_mode vfr -c:v ffv1 -timecode 10:00:00:23");
  const auto result = ImportVideos(options, temp / "take");
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(CountsOf(temp / "take", 1), ElementsAre(10, 11, -1, 13, 14, 15, -1, 17));
  EXPECT_THAT(result->warnings,
              Contains(HasSubstr("right.mkv): its rate varies: frames are 40.0 to 80.0 ms")));
  EXPECT_NEAR(result->take.cameras(1).sync().longest_ms(), 80, 1.1);
}

TEST(ImportVideos, TakesWhatATruncatedVideoHolds) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  MakeVideo(temp / "whole.mkv", Values(10, 8), "25",
            "-c:v ffv1 -g 1 -vf noise=alls=90 -cluster_size_limit 400 -timecode 10:00:00:23");
  const std::string bytes = ReadBytes(temp / "whole.mkv");
  WriteBytes(temp / "right.mkv", bytes.substr(0, 6 * bytes.size() / 10));
  const auto result = ImportVideos(options, temp / "take");
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(result->warnings,
              Contains(AllOf(HasSubstr("right.mkv): it is damaged, "), HasSubstr("ffmpeg: "))));
  EXPECT_EQ(CountsOf(temp / "take", 1).back(), -1);
  EXPECT_THAT(CountsOf(temp / "take", 0), ElementsAre(10, 11, 12, 13, 14, 15, 16, 17));
}

TEST(ImportVideos, ComparesWithTheRig) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  options.rig = temp / "rig.json";
  const auto camera = [](const std::string& id, int width) {
    return "{\"id\":\"" + id + "\",\"width_px\":" + std::to_string(width) +
           ",\"height_px\":16,\"fx_px\":50,\"fy_px\":50,\"cx_px\":16,\"cy_px\":8,"
           "\"distortion\":[0,0,0,0,0],\"rotation\":[1,0,0,0,1,0,0,0,1],\"translation_mm\":[0,0,0]}";
  };
  WriteBytes(options.rig, "{\"cameras\":[" + camera("left", 32) + "," + camera("top", 32) + "]}");
  ASSERT_TRUE(ReadRig(options.rig).ok()) << ReadRig(options.rig).status();
  EXPECT_THAT(Why(options, temp / "take"),
              AllOf(HasSubstr("right.mkv: "), HasSubstr("has no camera right; it has left, top"),
                    HasSubstr("--camera NAME=")));
  WriteBytes(options.rig, "{\"cameras\":[" + camera("left", 32) + "," + camera("right", 64) + "]}");
  EXPECT_THAT(Why(options, temp / "take"), HasSubstr("its pictures are 32x16, "));
  WriteBytes(options.rig, "{\"cameras\":[" + camera("left", 32) + "," + camera("right", 32) + "," +
                              camera("top", 32) + "]}");
  const auto result = ImportVideos(options, temp / "take");
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(result->warnings, Contains(HasSubstr("top")));
  EXPECT_EQ(result->take.rig_hash(), ReadRig(options.rig)->ContentHash());
}

TEST(ImportVideos, GoesOnWhereItWasStopped) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  options.videos.push_back({"third", temp / "right.mkv"});
  uint64_t told = 0;
  const auto stopped = ImportVideos(options, temp / "take", [&](const char* stage, uint64_t done, uint64_t) {
    told = std::string(stage) == "import" ? done : 0;
    return told < 25;
  });
  EXPECT_TRUE(absl::IsCancelled(stopped.status())) << stopped.status();
  EXPECT_FALSE(fs::exists(temp / "take"));
  EXPECT_TRUE(fs::exists(temp / "take.unfinished/import.json"));
  bool looked = false;
  const auto result = ImportVideos(options, temp / "take", [&](const char* stage, uint64_t, uint64_t) {
    looked = looked || std::string(stage) == "look";
    return true;
  });
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_FALSE(looked);
  EXPECT_THAT(CountsOf(temp / "take", 0), ElementsAre(10, 11, 12, 13, 14, 15, 16, 17, -1, -1));
  EXPECT_THAT(CountsOf(temp / "take", 2), ElementsAre(-1, -1, -1, 13, 14, 15, 16, 17, 18, 19));
  EXPECT_THAT(VerifyTake(temp / "take")->problems, IsEmpty());
}

// All that take.json says, but for its id, its version and its times.
TEST(ImportVideos, TheTakeSaysWhatItWasMadeOf) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  options.said.set_slate("12A");
  options.said.set_name("walk");
  options.said.set_notes("wet");
  options.given_s = {{"right", 36001.08}};  // as timecode counts, whose 10:00:00:23 is the other one's
  options.mosaic = PixelFormat::kBayerRg8;
  std::vector<std::string> stages;
  const int64_t before_ns = HostTime_ns();
  Mutex mutex;
  const auto result =
      ImportVideos(options, temp / "take/", [&](const char* stage, uint64_t done, uint64_t total) {
        const MutexLock lock(mutex);
        if (std::string(stage) == "import") stages.push_back(absl::StrCat(done, " of ", total));
        return true;
      });
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(stages.size(), 22u);
  EXPECT_THAT(stages, Contains("22 of 22"));
  v1::Take take = *ReadTakeFile(temp / "take");
  EXPECT_GE(take.ended_host_time_ns(), before_ns);
  take.clear_id(), take.clear_weft_version();
  take.clear_started_host_time_ns(), take.clear_ended_host_time_ns();
  for (v1::TakeCamera& camera : *take.mutable_cameras()) {  // in microseconds
    camera.mutable_sync()->set_offset_s(std::round(1e6 * camera.sync().offset_s()));
    camera.mutable_sync()->set_offset_sigma_s(std::round(1e6 * camera.sync().offset_sigma_s()));
  }
  v1::Take expected;
  ASSERT_TRUE(google::protobuf::TextFormat::ParseFromString(
      R"(state: TAKE_STATE_COMPLETE origin: "videos left.mkv, right.mkv"
         cameras { id: "left" source: "video:left.mkv" width_px: 32 height_px: 16 pixel_format: "BayerRG8"
                   unsynchronized: true
                   sync { offset_sigma_s: 11547 found_by: "timecode" timecode: "10:00:00:23" period_ms: 40
                          frames: 8 } }
         cameras { id: "right" source: "video:right.mkv" width_px: 32 height_px: 16 pixel_format: "BayerRG8"
                   unsynchronized: true
                   sync { offset_s: 160000 found_by: "given" timecode: "10:00:01:01" period_ms: 40 frames: 7 } }
         sets_recorded: 11 frames_missing: 7 sync: "videos, offsets by given and timecode"
         slate: "12A" name: "walk" notes: "wet" timecode: "10:00:00:23" timecode_fps: 25)",
      &expected));
  EXPECT_EQ(take.DebugString(), expected.DebugString());
}

TEST(ImportVideos, TheFirstVideoWithTimecodeLabelsTheFirstSet) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  MakeVideo(temp / "left.mkv", Values(10, 8), "25");
  options.given_s = {{"left", -0.12}, {"right", 0}};
  const auto result = ImportVideos(options, temp / "take");
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->take.timecode(), "10:00:00:23");  // three frames before the right one's
  EXPECT_EQ(result->take.timecode_fps(), 25);
}

TEST(ImportVideos, OneVideoNeedsNoTimecode) {
  const TempFolder temp;
  MakeVideo(temp / "left.mkv", Values(10, 4), "25");
  VideoImportOptions options;
  options.videos = {{"left", temp / "left.mkv"}};
  const auto result = ImportVideos(options, temp / "take");
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->take.sync(), "videos, offsets by together");
  EXPECT_EQ(result->take.sets_recorded(), 4u);
  EXPECT_EQ(result->take.timecode(), "");
  // A folder without content is as good as none.
  fs::create_directory(temp / "empty");
  EXPECT_TRUE(ImportVideos(options, temp / "empty").ok());
}

TEST(ImportVideos, MotionNeedsARigAndABoard) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  options.sync = SyncWay::kMotion;
  EXPECT_EQ(Why(options, temp / "take"),
            "offsets from motion need a rig and a board: --rig RIG --board BOARD");
  options.sync = SyncWay::kFileTimes;
  EXPECT_THAT(Why(options, temp / "take"), HasSubstr("left.mkv: does not say when it was filmed"));
}

TEST(ImportVideos, TwoImportsDoNotWriteToOneFolder) {
  const TempFolder temp;
  const VideoImportOptions options = TwoClips(temp);
  fs::create_directories(temp / "take.unfinished");
  const UniqueFd held(open((temp / "take.unfinished").c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(flock(held.get(), LOCK_EX | LOCK_NB), 0);
  const absl::Status status = ImportVideos(options, temp / "take").status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status));
  EXPECT_EQ(status.message(), temp / "take.unfinished" + std::string(": another import writes there"));
}

// What an import that was stopped has looked at, and offsets that other options would change.
TEST(ImportVideos, LooksAgainAtFilesAndOptionsThatWereChanged) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  const std::string state_file = temp / "take.unfinished/import.json";
  const auto looks = [&] {
    Mutex mutex;
    bool has_looked = false;
    const auto stopped = ImportVideos(options, temp / "take", [&](const char* stage, uint64_t, uint64_t) {
      const MutexLock lock(mutex);
      has_looked = has_looked || std::string(stage) == "look";
      return std::string(stage) != "import";
    });
    EXPECT_TRUE(absl::IsCancelled(stopped.status())) << stopped.status();
    return has_looked;
  };
  const auto state = [&] {
    v1::VideoImport read;
    EXPECT_TRUE(ReadJsonFile(state_file, read).ok());
    return read;
  };
  looks();
  const v1::VideoImport first = state();
  EXPECT_EQ(first.version(), 3);
  ASSERT_EQ(first.videos_size(), 2);
  EXPECT_EQ(first.videos(1).camera(), "right");
  EXPECT_NEAR(first.take().cameras(1).sync().offset_s(), 0.12, 1e-9);
  looks();
  EXPECT_EQ(state().DebugString(), first.DebugString());
  options.given_s = {{"right", 36001.12}};
  looks();
  EXPECT_NEAR(state().take().cameras(1).sync().offset_s(), 0.2, 1e-6);
  EXPECT_NE(state().take().id(), first.take().id());
  // Each option makes another take: its key says so.
  std::set<std::string> keys = {first.key(), state().key()};
  const auto differs = [&](const char* what) {
    looks();
    EXPECT_TRUE(keys.insert(state().key()).second) << what;
  };
  options.max_offset_s = 1;
  differs("max_offset_s");
  options.stream.compress = true;
  differs("compress");
  options.mosaic = PixelFormat::kBayerRg8;
  differs("mosaic");
  options.ltc = {{"top", "c.wav"}};
  options.sync = SyncWay::kTimecode;
  differs("ltc");
  options.board = "board";
  differs("board");
  // Facts of another version are not believed, nor those of a file that is another one now.
  v1::VideoImport old = state();
  old.mutable_videos(0)->set_width_px(77);
  ASSERT_TRUE(WriteJsonFile(state_file, old).ok());
  looks();
  EXPECT_EQ(state().videos(0).width_px(), 77);
  old.set_version(2);
  ASSERT_TRUE(WriteJsonFile(state_file, old).ok());
  looks();
  EXPECT_EQ(state().videos(0).width_px(), 32);
  for (const bool is_size : {false, true}) {
    old.set_version(3);
    old.mutable_videos(0)->set_bytes(first.videos(0).bytes() + (is_size ? 1 : 0));
    old.mutable_videos(0)->set_modified_unix_ns(first.videos(0).modified_unix_ns() + (is_size ? 0 : 1));
    ASSERT_TRUE(WriteJsonFile(state_file, old).ok());
    looks();
    EXPECT_EQ(state().videos(0).width_px(), 32);
  }
}

TEST(ImportVideos, ARecordingThatGoesOnInAnotherFileIsToldOf) {
  const TempFolder temp;
  VideoImportOptions options;
  options.videos = {{"left", temp / "GX010042.MP4"}};
  MakeVideo(temp / "GX010042.MP4", Values(10, 3), "25", "-c:v libx264");
  WriteBytes(temp / "GX020042.MP4", "");
  const auto result = ImportVideos(options, temp / "take");
  ASSERT_TRUE(result.ok()) << result.status();
  const std::string path = fs::canonical(temp / "GX010042.MP4").string();
  EXPECT_THAT(
      result->warnings,
      ElementsAre(HasSubstr("left (" + path + "): its recording goes on in GX020042.MP4, which is not")));
  options.videos.push_back({"right", temp / "GX020042.MP4"});
  EXPECT_THAT(Why(options, temp / "other"), HasSubstr("is a chapter of the same recording as"));
}

TEST(ImportVideos, NamesTwoVideosOfOneCamera) {
  const TempFolder temp;
  VideoImportOptions options = TwoClips(temp);
  options.videos[1].camera = "left";
  EXPECT_EQ(Why(options, temp / "take"), "camera left: two videos, " + options.videos[0].path + " and " +
                                             options.videos[1].path +
                                             "; one per camera, named by --camera NAME=FILE");
  options.videos[1].camera = "../left";
  EXPECT_THAT(Why(options, temp / "take"), HasSubstr("cannot be the name of a stream"));
  options.videos.clear();
  EXPECT_THAT(Why(options, temp / "take"), HasSubstr("no video is named"));
}

}  // namespace
}  // namespace weft
