// From rendered images to a rig.json.
#include "services/studio/calibration/calibrate_dump.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "capture/image/image_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/target_file.h"
#include "services/studio/calibration/rehearsal.h"
#include "tests/capture/calibration/simulated_calibration.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/results/report/page_data.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

Frame WithPixels(Frame image, std::vector<uint8_t> pixels) {
  image.pixels = std::make_shared<const std::vector<uint8_t>>(std::move(pixels));
  return image;
}

// What a camera behind a cover sees.
Frame Covered(const Frame& image) {
  return WithPixels(image, std::vector<uint8_t>(image.pixels->size(), 90));
}

// Out of focus: every pixel the mean over 7 x 7.
Frame Unsharp(const Frame& image) {
  const int bytes = BytesPerPixel(image.format);
  std::vector<uint8_t> out(image.pixels->size());
  for (int y = 0; y < image.height_px; ++y) {
    for (int i = 0; i < image.width_px * bytes; ++i) {
      int sum = 0;
      for (int dy = -3; dy <= 3; ++dy) {
        const uint8_t* row = image.row(std::clamp(y + dy, 0, image.height_px - 1));
        for (int dx = -3; dx <= 3; ++dx) {
          const int x = std::clamp(i / bytes + dx, 0, image.width_px - 1);
          sum += row[x * bytes + i % bytes];
        }
      }
      out[static_cast<size_t>(y) * image.width_px * bytes + i] = static_cast<uint8_t>(sum / 49);
    }
  }
  return WithPixels(image, std::move(out));
}

CalibrationTarget OneBoard() {
  CalibrationTarget target{"one", {MakeBoard("A", 0, 5, 4, 28)}, {{"bar", "tag36h11", 500, 501, 260}}};
  target.boards[0].gap_mm = 7;
  return target;
}

// A dump of four cameras, rendered once.
class CalibrateDumpTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    RehearsalOptions options;
    options.rig = {.cameras = 4,
                   .width_px = 400,
                   .height_px = 320,
                   .distance_mm = 1200,
                   .around_deg = 70,
                   .object_width_mm = 380,
                   .object_height_mm = 300};
    options.motion = {.frames = 36, .reach_mm = {120, 90, 100}, .seed = 3};
    options.look.samples = 3;
    ASSERT_TRUE(WriteTarget(*folder_ / "target.json", OneBoard()).ok());
    ASSERT_TRUE(WriteRehearsal(*folder_ / "boards", OneBoard(), options).ok());
  }
  static void TearDownTestSuite() { delete folder_; }

  static CalibrationRequest Request() {
    CalibrationRequest request;
    request.dump = *folder_ / "boards";
    request.target = *folder_ / "target.json";
    request.out = *folder_ / "rig.json";
    return request;
  }
  static std::string Refusal(const CalibrationRequest& request) {
    const auto result = CalibrateDump(request);
    if (!result.ok()) return result.status().ToString();
    return std::string(IssuesStatus(result->issues).message());
  }

  // A copy of the dump in which the images that `which` chooses, by frame (from 0) and camera, are changed.
  static std::string ChangedDump(const std::string& name,
                                 const std::function<bool(int, const std::string&)>& which,
                                 const std::function<Frame(const Frame&)>& change) {
    const std::string copy = *folder_ / name;
    fs::copy(std::string(*folder_ / "boards"), copy, fs::copy_options::recursive);
    std::vector<fs::path> frames;
    for (const auto& entry : fs::directory_iterator(copy)) {
      if (fs::exists(entry.path() / "c00.png")) frames.push_back(entry.path());
    }
    std::sort(frames.begin(), frames.end());
    EXPECT_EQ(frames.size(), 36u);
    for (size_t f = 0; f < frames.size(); ++f) {
      for (const char* camera : {"c00", "c01", "c02", "c03"}) {
        if (!which(static_cast<int>(f), camera)) continue;
        const std::string file = frames[f] / (std::string(camera) + ".png");
        EXPECT_TRUE(WriteImageFile(file, change(ReadImageFile(file).value())).ok());
      }
    }
    return copy;
  }

  static TempFolder* folder_;
};
TempFolder* CalibrateDumpTest::folder_ = nullptr;

TEST_F(CalibrateDumpTest, RenderedBoardsGiveTheRigThatTookThem) {
  const auto result = CalibrateDump(Request());
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE(IssuesStatus(result->issues).ok()) << IssuesStatus(result->issues);
  ASSERT_TRUE(result->solution.has_value());
  EXPECT_LT(result->solution->rms_px, 0.12);
  ASSERT_TRUE(WriteCalibration(Request().out, *result).ok());

  const Rig truth = ReadRig(*folder_ / "boards/truth/rig.json").value();
  const auto rig = ReadRig(Request().out);
  ASSERT_TRUE(rig.ok()) << rig.status();
  // Distances between cameras do not depend on the world frame.
  for (int c = 1; c < 4; ++c) {
    const double is = (rig->cameras[c].CenterWorld() - rig->cameras[0].CenterWorld()).norm();
    const double should = (truth.cameras[c].CenterWorld() - truth.cameras[0].CenterWorld()).norm();
    EXPECT_NEAR(is / should, 1, 6e-3);
    EXPECT_NEAR(rig->cameras[c].fx_px / truth.cameras[c].fx_px, 1, 8e-3);
  }
  ASSERT_EQ(result->solution->bars.size(), 1u);
  EXPECT_NEAR(result->solution->bars[0].length_mm, 260, 0.8);

  const auto record = ReadCalibrationRecord(Request().out);
  ASSERT_TRUE(record.ok() && record->has_value()) << record.status();
  EXPECT_EQ((*record)->version, 1);
  EXPECT_EQ((*record)->cameras.size(), 4u);
  EXPECT_GT((*record)->cameras[2].sigmas[0], 0);
  const auto page = ReadWholeFile(CalibrationReportPath(Request().out));
  ASSERT_TRUE(page.ok());
  EXPECT_NE(CalibrationVerdict(*result).grade(), v1::GRADE_BAD);
  EXPECT_EQ(MemberOf<v1::CalibrationReport>(*page, "report").verdict().checks(0).limits(),
            CalibrationVerdict(*result).checks(0).limits());
  const auto shown = MemberOf<v1::CalibrationPage>(*page, "page");
  ASSERT_EQ(shown.cameras_size(), 4);
  for (int c = 0; c < 4; ++c) {
    const v1::CalibrationPage::Camera& camera = shown.cameras(c);
    EXPECT_EQ(camera.corners_px_size(), camera.residuals_px_size());
    EXPECT_GE(camera.corners_px_size(), 2 * 100);
    EXPECT_DOUBLE_EQ(camera.lens(0), rig->cameras[c].fx_px);
    EXPECT_DOUBLE_EQ(camera.lens_sigmas(3), (*record)->cameras[c].sigmas[4]);
    EXPECT_NEAR(camera.center_mm(2), rig->cameras[c].CenterWorld().z(), 1e-6);
    EXPECT_EQ(camera.shared_size(), 4);
  }
  EXPECT_EQ(shown.solution().rig_version(), 1);
  EXPECT_EQ(shown.solution().boards_mm_size() % 3, 0);

  // Calibrated again, the version counts up and names what it replaces.
  const auto again = CalibrateDump(Request());
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->record.version, 2);
  EXPECT_EQ(again->record.replaces, rig->ContentHash());
  fs::remove(std::string(Request().out));
}

TEST_F(CalibrateDumpTest, RefusalsLeaveNoRigButAPage) {
  CalibrationTarget wrong = OneBoard();
  wrong.boards[0].tag_mm *= 1.05;
  wrong.boards[0].gap_mm *= 1.05;
  ASSERT_TRUE(WriteTarget(*folder_ / "wrong.json", wrong).ok());
  CalibrationRequest request = Request();
  request.target = *folder_ / "wrong.json";
  request.out = *folder_ / "refused.json";
  const auto result = CalibrateDump(request);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(std::string(IssuesStatus(result->issues).message()), HasSubstr("printed at 95."));
  ASSERT_TRUE(WriteCalibration(request.out, *result).ok());
  EXPECT_FALSE(fs::exists(std::string(request.out)));
  const auto page = ReadWholeFile(CalibrationReportPath(request.out));
  ASSERT_TRUE(page.ok());
  const auto shown = MemberOf<v1::CalibrationPage>(*page, "page");
  EXPECT_THAT(shown.headline(), HasSubstr("Calibration refused for"));
  EXPECT_EQ(MemberOf<v1::CalibrationReport>(*page, "report").verdict().grade(), v1::GRADE_BAD);
}

TEST_F(CalibrateDumpTest, BlurredBoardsAreTheCauseThatIsNamed) {
  CalibrationRequest request = Request();
  request.detection.max_blur_px = 0.5;  // sharper than the lens
  EXPECT_THAT(Refusal(request), HasSubstr("tags are blurred"));
}

TEST_F(CalibrateDumpTest, MirroredImagesAreNamed) {
  CalibrationRequest request = Request();
  request.dump = ChangedDump(
      "mirrored", [](int, const std::string& camera) { return camera == "c01"; },
      [](const Frame& image) { return MirroredGrey(image).value(); });
  EXPECT_THAT(Refusal(request), HasSubstr("camera c01: its images are mirrored"));
}

TEST_F(CalibrateDumpTest, ACameraThatSeesNoBoardIsNamed) {
  CalibrationRequest request = Request();
  request.dump = ChangedDump(
      "covered", [](int, const std::string& camera) { return camera == "c02"; }, Covered);
  EXPECT_THAT(Refusal(request), HasSubstr("camera c02: saw no board in 36 images; nothing moves in them"));
}

TEST_F(CalibrateDumpTest, TagsOfAnotherFamilyAreNotCalledBlurred) {
  CalibrationRequest request = Request();
  CalibrationTarget other = OneBoard();
  other.boards[0].family = "tagStandard41h12";  // none of these is in the pictures
  other.boards[0].gap_mm = 28;
  other.scale_bars.clear();
  ASSERT_TRUE(WriteTarget(*folder_ / "other.json", other).ok());
  request.target = *folder_ / "other.json";
  EXPECT_THAT(Refusal(request), AllOf(HasSubstr("camera c02: saw no board in 36 images, though something"),
                                      HasSubstr("is sharp"), Not(HasSubstr("blurred"))));
}

TEST_F(CalibrateDumpTest, ACameraFarOutOfFocusIsNamed) {
  CalibrationRequest request = Request();
  request.dump = ChangedDump(
      "unsharp", [](int, const std::string& camera) { return camera == "c03"; }, Unsharp);
  // So far that no tag is found any more; what moves there tells.
  EXPECT_THAT(Refusal(request), AllOf(HasSubstr("camera c03: no tag can be read in 36 images"),
                                      HasSubstr("too blurred"), HasSubstr("focus the camera")));
}

TEST_F(CalibrateDumpTest, AMirroredBoardIsNamed) {
  CalibrationTarget wrong = OneBoard();
  for (int row = 0; row < 5; ++row) {
    std::reverse(wrong.boards[0].tag_ids.begin() + 4 * row, wrong.boards[0].tag_ids.begin() + 4 * row + 4);
  }
  ASSERT_TRUE(WriteTarget(*folder_ / "turned.json", wrong).ok());
  CalibrationRequest request = Request();
  request.target = *folder_ / "turned.json";
  EXPECT_THAT(Refusal(request), HasSubstr("board A: mirrored in"));
}

TEST_F(CalibrateDumpTest, TwoDisconnectedGroupsAreNamed) {
  // Cameras 0 and 1 are covered in every second frame, the others in the rest; camera 3 then sees no board.
  CalibrationRequest request = Request();
  request.dump = ChangedDump(
      "disconnected",
      [](int frame, const std::string& camera) { return (camera < "c02") == (frame % 2 == 0); }, Covered);
  EXPECT_THAT(Refusal(request), HasSubstr("camera c02 shares no board with cameras c00, c01"));
}

TEST_F(CalibrateDumpTest, ErrorsNameTheFile) {
  CalibrationRequest request = Request();
  request.target = *folder_ / "none.json";
  EXPECT_THAT(Refusal(request), HasSubstr("none.json"));
  request = Request();
  request.dump = *folder_ / "nothing";
  EXPECT_THAT(Refusal(request), HasSubstr("nothing"));
}

}  // namespace
}  // namespace weft
