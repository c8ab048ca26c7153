#include "services/results/export/export_overlays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/results/export/export_folder.h"
#include "tests/services/results/export/filmed_result.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

OverlayRequest OverlayOfFilmed(const FilmedResult& filmed, OverlayKind kind) {
  OverlayRequest request;
  request.result = filmed.request.result;
  request.out = filmed.folder / "out";
  request.recording = filmed.recording;
  request.kind = kind;
  request.format = PictureFormat::kPng;
  return request;
}

TEST(ExportOverlaysTest, FormatsHaveTheirEndings) {
  EXPECT_STREQ(EndingOf(PictureFormat::kJpeg), "jpg");
  EXPECT_STREQ(EndingOf(PictureFormat::kPng), "png");
  EXPECT_STREQ(EndingOf(PictureFormat::kMp4), "mp4");
  EXPECT_STREQ(EndingOf(PictureFormat::kMkv), "mkv");
  EXPECT_FALSE(IsVideo(PictureFormat::kJpeg));
  EXPECT_FALSE(IsVideo(PictureFormat::kPng));
  EXPECT_TRUE(IsVideo(PictureFormat::kMp4));
  EXPECT_TRUE(IsVideo(PictureFormat::kMkv));
}

TEST(ExportOverlaysTest, NoneShowsEachPictureAsItWasTaken) {
  const FilmedResult filmed;
  const auto outcome = ExportOverlays(OverlayOfFilmed(filmed, OverlayKind::kNone), nullptr, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_THAT(outcome->manifest.files(), ElementsAre("c1", "c2"));
  EXPECT_EQ(outcome->manifest.overlay(), "none");
  for (const char* camera : {"c1", "c2"}) {
    for (const char* frame : {"0000", "0001", "0002"}) {
      const auto picture =
          ReadImageFile(filmed.folder / ("out/" + std::string(camera) + "/" + frame + ".png"));
      ASSERT_TRUE(picture.ok()) << picture.status();
      EXPECT_EQ(*picture->pixels, *FilmedResult::PictureOf().pixels) << camera << frame;
    }
  }
}

// The square spans pixels 30 to 130 and 25 to 75 at its first place.
TEST(ExportOverlaysTest, TheWireframeLiesWhereTheMeshIsInThePicture) {
  FilmedResult filmed;
  filmed.recording.cameras = {"c2"};
  OverlayRequest request = OverlayOfFilmed(filmed, OverlayKind::kWireframe);
  request.frames = "0000";
  ASSERT_TRUE(ExportOverlays(request, nullptr, {}).ok());
  EXPECT_FALSE(std::filesystem::exists(filmed.folder / "out/c1"));
  const auto picture = ReadImageFile(filmed.folder / "out/c2/0000.png");
  ASSERT_TRUE(picture.ok()) << picture.status();
  const auto is_painted = [&](int x, int y) {
    const uint8_t* rgb = picture->row(y) + 3 * x;
    return rgb[0] != FilmedResult::kColor[0] || rgb[2] != FilmedResult::kColor[2];
  };
  EXPECT_TRUE(is_painted(30, 50));
  EXPECT_TRUE(is_painted(130, 50));
  EXPECT_TRUE(is_painted(80, 50));  // the diagonal
  EXPECT_FALSE(is_painted(60, 35));
  EXPECT_FALSE(is_painted(10, 50));
  EXPECT_FALSE(is_painted(80, 10));
}

TEST(ExportOverlaysTest, UndistortedPicturesComeWithTheCamerasThatTheyAreOf) {
  FilmedResult filmed;
  filmed.rig.cameras[0].distortion[0] = -0.1;
  ASSERT_TRUE(WriteRig(filmed.recording.rig, filmed.rig).ok());
  filmed.recording.cameras = {"c1"};
  OverlayRequest request = OverlayOfFilmed(filmed, OverlayKind::kNone);
  request.undistort = true;
  const auto outcome = ExportOverlays(request, nullptr, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ(outcome->manifest.overlay(), "none, undistorted");
  const auto rig = ReadRig(filmed.folder / "out/rig.json");
  ASSERT_TRUE(rig.ok()) << rig.status();
  ASSERT_EQ(rig->cameras.size(), 1u);
  EXPECT_EQ(rig->cameras[0].id, "c1");
  EXPECT_EQ(rig->cameras[0].distortion, (std::array<double, 8>{}));
  EXPECT_EQ(rig->cameras[0].fx_px, 1000);
}

TEST(ExportOverlaysTest, AVideoNeedsARate) {
  const FilmedResult filmed;
  OverlayRequest request = OverlayOfFilmed(filmed, OverlayKind::kNone);
  request.format = PictureFormat::kMp4;
  const absl::Status status = ExportOverlays(request, nullptr, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("--fps: "), HasSubstr("give the frames per second")));
}

TEST(ExportOverlaysTest, APictureThatIsMissingIsLeftOutWithAWarning) {
  const FilmedResult filmed;
  std::filesystem::remove(filmed.Picture(1, "c2"));
  const auto outcome = ExportOverlays(OverlayOfFilmed(filmed, OverlayKind::kNone), nullptr, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  ASSERT_EQ(outcome->warnings.size(), 1u);
  EXPECT_THAT(outcome->warnings[0], ::testing::StartsWith("Frame 0001, camera c2: "));
  EXPECT_FALSE(std::filesystem::exists(filmed.folder / "out/c2/0001.png"));
  EXPECT_TRUE(std::filesystem::exists(filmed.folder / "out/c1/0001.png"));
  EXPECT_TRUE(std::filesystem::exists(filmed.folder / "out/export.json"));
}

TEST(ExportOverlaysTest, AStopKeepsWhatIsThereAndTheSameRequestGoesOn) {
  const FilmedResult filmed;
  const OverlayRequest request = OverlayOfFilmed(filmed, OverlayKind::kNone);
  std::stop_source stop;
  const auto stopped = ExportOverlays(
      request,
      [&stop](ExportStep step, size_t, size_t) {
        if (step == ExportStep::kWrite) stop.request_stop();
      },
      stop.get_token());
  EXPECT_EQ(stopped.status().code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(std::filesystem::exists(filmed.folder / "out/c1/0000.png"));
  EXPECT_FALSE(std::filesystem::exists(filmed.folder / "out/c1/0001.png"));
  const auto rest = ExportOverlays(request, nullptr, {});
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_FALSE(rest->was_complete);
  EXPECT_TRUE(std::filesystem::exists(filmed.folder / "out/c2/0002.png"));
  EXPECT_TRUE(ExportOverlays(request, nullptr, {})->was_complete);
}

TEST(ExportOverlaysTest, TheManifestNamesThePicturesAndTheRangeOfSigma) {
  const FilmedResult filmed;
  OverlayRequest request = OverlayOfFilmed(filmed, OverlayKind::kSigma);
  request.format = PictureFormat::kJpeg, request.undistort = true;
  std::vector<std::string> steps;
  const auto outcome = ExportOverlays(request,
                                      [&](ExportStep step, size_t done, size_t all) {
                                        if (step == ExportStep::kWrite)
                                          steps.push_back(absl::StrCat(done, "/", all));
                                      },
                                      {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_THAT(steps, ElementsAre("1/3", "2/3", "3/3"));
  EXPECT_EQ(outcome->manifest.format(), "jpg");
  EXPECT_EQ(outcome->manifest.overlay(), "sigma, undistorted");
  EXPECT_EQ(outcome->manifest.overlay_sigma_mm(), 1.5);
  EXPECT_THAT(outcome->manifest.files(), ElementsAre("c1", "c2", "rig.json"));
  EXPECT_EQ(ReadBytes(filmed.folder / "out/c1/0002.jpg").substr(0, 2), "\xFF\xD8");
  EXPECT_EQ(ReadRig(filmed.folder / "out/rig.json")->id, filmed.rig.id + " without distortion");
}

// What a killed export left is removed, what others wrote stays.
TEST(ExportOverlaysTest, LeftoversOfPicturesAreRemoved) {
  const FilmedResult filmed;
  WriteBytes(filmed.folder / "out/c1/0000.png.tmp.12345678.1", "half");
  WriteBytes(filmed.folder / "out/c1/notes.txt", "mine");
  OverlayRequest request = OverlayOfFilmed(filmed, OverlayKind::kNone);
  v1::Export manifest;
  {
    // The folder holds a part of this export.
    OverlayRequest other = request;
    other.out = filmed.folder / "other";
    const auto outcome = ExportOverlays(other, nullptr, {});
    ASSERT_TRUE(outcome.ok()) << outcome.status();
    manifest = outcome->manifest;
  }
  ASSERT_TRUE(ExportFolder(request.out).Begin(manifest).ok());
  ASSERT_TRUE(ExportOverlays(request, nullptr, {}).ok());
  EXPECT_FALSE(std::filesystem::exists(filmed.folder / "out/c1/0000.png.tmp.12345678.1"));
  EXPECT_EQ(ReadBytes(filmed.folder / "out/c1/notes.txt"), "mine");
}

}  // namespace
}  // namespace weft
