#include "services/work/pipeline/scratch_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "capture/image/image_file.h"
#include "capture/take/open_dump.h"
#include "capture/take/take_writer.h"
#include "tests/capture/pattern_frames.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kWidth_px = 64, kHeight_px = 48, kFilmed = 4;
constexpr uint64_t kMib = 1 << 20;

class ScratchFramesTest : public ::testing::Test {
 protected:
  ScratchFramesTest() : cameras_({"cam1", "cam2"}, kWidth_px, kHeight_px) {
    for (const std::string& id : cameras_.camera_ids()) {
      CameraModel camera;
      camera.id = id;
      camera.width_px = kWidth_px;
      camera.height_px = kHeight_px;
      camera.fx_px = camera.fy_px = 50;
      rig_.cameras.push_back(camera);
    }
  }

  void WriteFolder() {
    for (int k = 0; k < kFilmed; ++k) {
      for (size_t i = 0; i < rig_.cameras.size(); ++i) {
        Frame frame;
        frame.width_px = kWidth_px;
        frame.height_px = kHeight_px;
        frame.pixels = std::make_shared<const std::vector<uint8_t>>(kWidth_px * kHeight_px, 10 * k + i);
        fs::create_directories(folder_ / ("take/" + std::to_string(k)));
        ASSERT_TRUE(WriteImageFile(ImageOf(k, i), frame).ok());
      }
    }
  }
  std::string ImageOf(int frame, size_t camera) {
    return folder_ / ("take/" + std::to_string(frame) + "/" + rig_.cameras[camera].id + ".png");
  }
  void Record() {
    TakeWriterOptions options;
    options.take = 7;
    options.stream.compress = true;
    const auto writer = TakeWriter::Create(folder_ / "take", cameras_.camera_ids(), options);
    ASSERT_TRUE(writer.ok()) << writer.status();
    std::vector<LedgerEntry> entries;
    for (uint64_t number = 0; number < kFilmed; ++number) {
      const RawFrameSet set = cameras_.Set(number);
      for (size_t camera = 0; camera < 2; ++camera) ASSERT_TRUE((*writer)->Append(camera, set).ok());
      for (const LedgerEntry& entry : EntriesOfRecorded(set, 1)) entries.push_back(entry);
    }
    ASSERT_TRUE((*writer)->Commit(kFilmed - 1, entries).ok());
    ASSERT_TRUE((*writer)->Close(kFilmed - 1, {}, {}).ok());
  }

  std::unique_ptr<FrameSource> Open() {
    auto dump = OpenDump(folder_ / "take", rig_);
    EXPECT_TRUE(dump.ok()) << dump.status();
    return *std::move(dump);
  }
  std::unique_ptr<ScratchFrames> Scratch(uint64_t quota_bytes = kMib) {
    auto frames = ScratchFrames::Create(Open(), rig_.cameras.size(),
                                        {.folder = folder_ / "scratch", .quota_bytes = quota_bytes});
    EXPECT_TRUE(frames.ok()) << frames.status();
    return *std::move(frames);
  }
  int FoldersOfScratch() {
    int count = 0;
    for (const auto& entry : fs::directory_iterator(folder_ / "scratch")) count += entry.is_directory();
    return count;
  }

  TempFolder folder_;
  Rig rig_;
  PatternFrames cameras_;
};

TEST_F(ScratchFramesTest, ImagesOfAFolderAreReadFromCopies) {
  WriteFolder();
  const std::unique_ptr<FrameSource> shared = Open();
  const auto expected = shared->ReadView(1, 1);
  ASSERT_TRUE(expected.ok()) << expected.status();
  {
    const std::unique_ptr<ScratchFrames> frames = Scratch();
    ASSERT_TRUE(frames->Hold(1, std::nullopt).ok());
    EXPECT_EQ(frames->bytes_held(), fs::file_size(ImageOf(1, 0)) + fs::file_size(ImageOf(1, 1)));
    fs::remove_all(folder_ / "take/1");
    const auto view = frames->ReadView(1, 1);
    ASSERT_TRUE(view.ok()) << view.status();
    EXPECT_EQ(*view->pixels, *expected->pixels);
    EXPECT_EQ(view->origin, expected->origin);
    EXPECT_EQ(view->camera_id, "cam2");
    // Others come from where they lie, and copies last as long as they are wanted.
    EXPECT_TRUE(frames->ReadView(2, 0).ok());
    ASSERT_TRUE(frames->Hold(2, 3).ok());
    EXPECT_FALSE(frames->ReadView(1, 1).ok());
    EXPECT_EQ(FoldersOfScratch(), 1);
  }
  EXPECT_EQ(FoldersOfScratch(), 0);
}

TEST_F(ScratchFramesTest, FramesOfATakeAreReadFromCopies) {
  Record();
  const std::unique_ptr<FrameSource> shared = Open();
  const std::unique_ptr<ScratchFrames> frames = Scratch();
  for (size_t k = 0; k < kFilmed; ++k) {
    const std::optional<size_t> next = k + 1 < kFilmed ? std::optional(k + 1) : std::nullopt;
    ASSERT_TRUE(frames->Hold(k, next).ok());
    EXPECT_GT(frames->bytes_held(), 0u);
    for (size_t camera = 0; camera < 2; ++camera) {
      const auto view = frames->ReadView(k, camera), expected = shared->ReadView(k, camera);
      ASSERT_TRUE(view.ok()) << view.status();
      EXPECT_EQ(*view->pixels, *expected->pixels);
      EXPECT_EQ(view->origin, expected->origin);
    }
    EXPECT_EQ(*frames->Fingerprint(k), *shared->Fingerprint(k));
  }
}

TEST_F(ScratchFramesTest, StaysWithinItsQuota) {
  WriteFolder();
  const uint64_t frame_bytes = fs::file_size(ImageOf(0, 0)) + fs::file_size(ImageOf(0, 1));
  const std::unique_ptr<ScratchFrames> frames = Scratch(frame_bytes + 100);
  for (size_t k = 0; k + 1 < kFilmed; ++k) {
    ASSERT_TRUE(frames->Hold(k, k + 1).ok());
    EXPECT_GT(frames->bytes_held(), 0u);
    EXPECT_LE(frames->bytes_held(), frame_bytes + 100);
  }
  const absl::Status status = Scratch(frame_bytes / 2)->Hold(0, 1);
  EXPECT_TRUE(absl::IsFailedPrecondition(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("raise --slurm-scratch-mib"));
}

TEST_F(ScratchFramesTest, RemovesWhatAKilledProcessLeftAndNothingElse) {
  WriteFolder();
  WriteBytes(folder_ / "scratch/weft-scratch-killed/lock", "");
  WriteBytes(folder_ / "scratch/weft-scratch-killed/0-0", "an image");
  WriteBytes(folder_ / "scratch/weft-scratch-early/0-0", "without a lock");
  WriteBytes(folder_ / "scratch/of-somebody-else/file", "");
  const std::unique_ptr<ScratchFrames> alive = Scratch();
  ASSERT_TRUE(alive->Hold(0, 1).ok());
  const std::unique_ptr<ScratchFrames> other = Scratch();
  EXPECT_EQ(FoldersOfScratch(), 3);
  EXPECT_TRUE(fs::exists(folder_ / "scratch/of-somebody-else/file"));
  fs::remove_all(folder_ / "take/0");
  EXPECT_TRUE(alive->ReadView(0, 0).ok());
}

TEST_F(ScratchFramesTest, DamageIsToldAsWithoutCopies) {
  WriteFolder();
  WriteBytes(ImageOf(0, 0), "no image");
  fs::remove(ImageOf(1, 1));
  const std::unique_ptr<FrameSource> shared = Open();
  const std::unique_ptr<ScratchFrames> frames = Scratch();
  ASSERT_TRUE(frames->Hold(0, 1).ok());
  EXPECT_EQ(frames->ReadView(0, 0).status(), shared->ReadView(0, 0).status());
  ASSERT_TRUE(frames->Hold(1, 2).ok());
  EXPECT_EQ(frames->ReadView(1, 1).status(), shared->ReadView(1, 1).status());
}

TEST_F(ScratchFramesTest, AQuotaIsMetToTheByte) {
  WriteFolder();
  const auto bytes_of = [this](int frame) {
    return fs::file_size(ImageOf(frame, 0)) + fs::file_size(ImageOf(frame, 1));
  };
  const uint64_t first = bytes_of(0), second = bytes_of(1);
  const absl::Status status = Scratch(first - 1)->Hold(0, std::nullopt);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("frame 0: its images take "));
  EXPECT_THAT(std::string(status.message()), HasSubstr(" MiB, and the quota of " + folder_ / "scratch"));
  {
    const auto alone = Scratch(first);
    EXPECT_TRUE(alone->Hold(0, 1).ok());
    EXPECT_EQ(alone->bytes_held(), first);
  }
  {
    const auto short_of = Scratch(first + second - 1);
    EXPECT_TRUE(short_of->Hold(0, 1).ok());
    EXPECT_EQ(short_of->bytes_held(), first);
  }
  const auto both = Scratch(first + second);
  ASSERT_TRUE(both->Hold(0, 1).ok());
  for (int k = 0; k < 500 && both->bytes_held() < first + second; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(both->bytes_held(), first + second);
  // The one that was copied ahead is there when it is asked for, and its copies are not made again.
  fs::remove_all(folder_ / "take/1");
  ASSERT_TRUE(both->Hold(1, std::nullopt).ok());
  EXPECT_EQ(both->bytes_held(), second);
  EXPECT_TRUE(both->ReadView(1, 0).ok());
  // One that nobody asks for any more goes.
  ASSERT_TRUE(both->Hold(2, 3).ok());
  ASSERT_TRUE(both->Hold(0, std::nullopt).ok());
  EXPECT_EQ(both->bytes_held(), first);
}

TEST_F(ScratchFramesTest, CopiesOfLargeFilesAreWhole) {
  WriteFolder();
  std::string large;
  for (int k = 0; k < 300'000; ++k) large += std::to_string(k);  // of more than one piece
  WriteBytes(ImageOf(0, 0), large);
  const auto frames = Scratch(10 * kMib);
  ASSERT_TRUE(frames->Hold(0, std::nullopt).ok());
  std::string copy;
  for (const auto& entry : fs::directory_iterator(folder_ / "scratch"))
    if (entry.is_directory()) copy = entry.path().string() + "/0-0";
  EXPECT_TRUE(ReadBytes(copy) == large);
}

TEST_F(ScratchFramesTest, AFolderThatCannotBeMadeIsNamed) {
  WriteFolder();
  WriteBytes(folder_ / "file", "x");
  const auto frames = ScratchFrames::Create(Open(), 2, {.folder = folder_ / "file", .quota_bytes = kMib});
  EXPECT_FALSE(frames.ok());
  EXPECT_THAT(std::string(frames.status().message()), HasSubstr(folder_ / "file"));
}

}  // namespace
}  // namespace weft
