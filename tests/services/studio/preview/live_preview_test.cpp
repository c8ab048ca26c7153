#include "services/studio/preview/live_preview.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <regex>
#include <thread>

#include "services/formats/files/atomic_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

RawFrame Photographed(const std::string& camera, const Board& board, double brightness) {
  Photograph photograph;
  photograph.width_px = 200;
  photograph.height_px = 180;
  Frame frame = Render(photograph, board);
  std::vector<uint8_t> pixels = *frame.pixels;
  for (uint8_t& value : pixels) value = static_cast<uint8_t>(std::min(255.0, brightness * value));
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(std::move(pixels));
  absl::StatusOr<RawFrame> raw = ToRawFrame(frame);
  EXPECT_TRUE(raw.ok()) << raw.status();
  raw->camera_id = camera;
  return *std::move(raw);
}

class LivePreviewTest : public ::testing::Test {
 protected:
  std::string Page() { return *ReadWholeFile(options_.folder + "/index.html"); }

  const TempFolder temp_;
  const Board board_ = *GenerateBoard(24, 24, 2.7, 3);
  LivePreviewOptions options_{.folder = temp_ / "preview", .interval_s = 0.1};
};

TEST_F(LivePreviewTest, ShowsPicturesMetersAndCoverage) {
  options_.board = board_;
  options_.decoded_views = 3;
  auto preview = LivePreview::Start(options_);
  ASSERT_TRUE(preview.ok()) << preview.status();
  EXPECT_THAT(Page(), HasSubstr("no frame set yet"));
  RawFrameSet set;
  set.number = 41;
  for (const char* camera : {"c1", "c2", "c3"}) set.frames.push_back(Photographed(camera, board_, 1));
  set.frames.push_back(Photographed("c4", board_, 0.2));
  set.missing = {{"c5", "5 packets lost"}};
  (*preview)->Offer(set);
  (*preview)->Describe("recording well");
  ASSERT_TRUE((*preview)->Finish().ok());
  const std::string page = Page();
  EXPECT_THAT(page, HasSubstr("frame set 41"));
  EXPECT_THAT(page, HasSubstr("recording well"));
  EXPECT_THAT(page, HasSubstr("2 of 5 cameras to check"));
  EXPECT_THAT(page, HasSubstr("too dark"));
  EXPECT_THAT(page, HasSubstr("no picture: 5 packets lost"));
  EXPECT_THAT(page, HasSubstr("3 of 5 cameras decoded so far"));
  // Three views of the same cells.
  std::smatch share;
  ASSERT_TRUE(std::regex_search(page, share, std::regex("class=share>([0-9.]+)")));
  EXPECT_GT(std::stod(share[1]), 30);
}

TEST_F(LivePreviewTest, DecodesTheCamerasInTurn) {
  options_.board = board_;
  options_.decoded_views = 1;
  auto preview = LivePreview::Start(options_);
  ASSERT_TRUE(preview.ok()) << preview.status();
  RawFrameSet set;
  for (const char* camera : {"c1", "c2"}) set.frames.push_back(Photographed(camera, board_, 1));
  for (; Page().find("2 of 2 cameras decoded so far") == std::string::npos; ++set.number) {
    ASSERT_LT(set.number, 4000u);
    (*preview)->Offer(set);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_TRUE((*preview)->Stop().ok());
}

TEST_F(LivePreviewTest, NobodyWaitsForIt) {
  options_.interval_s = 3600;
  auto preview = LivePreview::Start(options_);
  ASSERT_TRUE(preview.ok()) << preview.status();
  RawFrameSet set;
  set.frames = {Photographed("c1", board_, 1)};
  const std::weak_ptr<const AlignedBuffer> first = set.frames[0].bytes;
  for (set.number = 0; set.number < 1000; ++set.number) {
    (*preview)->Offer(set);
    if (set.number == 500) set.frames[0] = Photographed("c1", board_, 0.9);
  }
  ASSERT_TRUE((*preview)->Finish().ok());
  EXPECT_THAT(Page(), HasSubstr("frame set 999"));
  EXPECT_TRUE(first.expired());
}

TEST(LivePreviewOptions, AreChecked) {
  const LivePreviewOptions good{
      .folder = "preview", .interval_s = 0.1, .thumbnail_px = 16, .decoded_views = 0};
  EXPECT_TRUE(good.Validate().ok());
  const auto why = [&](const std::function<void(LivePreviewOptions&)>& change) {
    LivePreviewOptions options = good;
    change(options);
    return std::string(options.Validate().message());
  };
  EXPECT_EQ(why([](LivePreviewOptions& o) { o.thumbnail_px = 4096; }), "");
  EXPECT_EQ(why([](LivePreviewOptions& o) { o.folder = ""; }), "the preview needs a folder");
  EXPECT_EQ(why([](LivePreviewOptions& o) { o.interval_s = 0.09; }), "previews must be at least 0.1 s apart");
  for (const int width_px : {15, 4097})
    EXPECT_EQ(why([&](LivePreviewOptions& o) { o.thumbnail_px = width_px; }),
              "pictures of the preview must be 16 to 4096 px wide");
  EXPECT_EQ(why([](LivePreviewOptions& o) { o.decoded_views = -1; }),
            "the number of decoded views must not be negative");
  EXPECT_EQ(why([](LivePreviewOptions& o) { o.garment.emplace(); }), "coverage of a garment needs its board");
}

// Coverage is of the garment's cells, and its pictures are of the garment.
TEST_F(LivePreviewTest, ShowsTheGarmentThatIsGiven) {
  options_.board = board_;
  Template garment;
  garment.rest = {{{0, 0, 0}, {2.7, 0, 0}, {0, 2.7, 0}}, {{0, 2, 1}}};
  garment.node_of_vertex = {{10, 10}, {10, 11}, {11, 11, NodeKind::kCorner}};
  options_.garment = garment;
  auto preview = LivePreview::Start(options_);
  ASSERT_TRUE(preview.ok()) << preview.status();
  RawFrameSet set;
  set.number = 7;
  set.frames.push_back(Photographed("c1", board_, 1));
  set.frames.push_back(set.frames[0]);
  set.frames[1].camera_id = "c2";
  set.frames[1].format = RawFormat::kMotionJpeg;  // no picture is in these bytes
  (*preview)->Offer(set);
  ASSERT_TRUE((*preview)->Finish().ok());
  const std::string page = Page();
  EXPECT_THAT(page, HasSubstr("of 2 cells are read by three cameras or more"));
  EXPECT_THAT(page, ::testing::Not(HasSubstr("alt=\"The board\"")));
  for (const char* side : {"Front", "Back"})
    EXPECT_THAT(page, HasSubstr("alt=\"" + std::string(side) + "\""));
  EXPECT_THAT(page, HasSubstr("</b> no picture: camera c2: not a JPEG image</p>"));
}

}  // namespace
}  // namespace weft
