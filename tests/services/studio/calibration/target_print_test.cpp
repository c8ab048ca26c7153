#include "services/studio/calibration/target_print.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <sstream>

#include "capture/calibration/tag_detection.h"
#include "capture/image/image_file.h"
#include "tests/capture/calibration/simulated_calibration.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

constexpr double kPxPerMm = 6;

// The page as poppler renders it at 6 dots per mm.
Frame Rasterised(const std::string& stem) {
  const std::string command =
      std::string(WEFT_PDFTOPPM) + " -r 152.4 -png -singlefile \"" + stem + ".pdf\" \"" + stem + "\"";
  EXPECT_EQ(std::system(command.c_str()), 0);
  return ReadImageFile(stem + ".png").value();
}

TEST(TargetPrint, ThePrintHoldsTheBoardAtTrueScale) {
  for (const char* family : {"tag36h11", "tagStandard41h12"}) {
    TagBoard board = MakeBoard("A", 30, 3, 4, 20);
    board.family = family;
    board.gap_mm = 17;
    const TempFolder folder;
    const std::string stem = folder / "board";
    ASSERT_TRUE(WriteBoardPrint(board, stem).ok());
    const auto detector = TagDetector::Make({family}, {}).value();
    CalibrationViews views;
    AddSightings({"t", {board}, {}}, 0, 0, detector->Detect(Rasterised(stem)).value().tags, &views);
    ASSERT_EQ(views.boards.size(), 1u);
    const std::vector<BoardCorner>& corners = views.boards[0].corners;
    ASSERT_EQ(corners.size(), 48u);
    // Upright, unmirrored, and right in mm.
    for (const BoardCorner& corner : corners) {
      const Eigen::Vector3d should = FlatCorner(board, corner.index) - FlatCorner(board, corners[0].index);
      const Eigen::Vector2d is = (corner.pixel_px - corners[0].pixel_px) / kPxPerMm;
      EXPECT_LT((is - should.head<2>()).norm(), 0.15) << family << ", corner " << corner.index;
    }
  }
}

TEST(TargetPrint, SvgIsAsLargeAsThePdf) {
  const TempFolder folder;
  const std::string stem = folder / "board";
  ASSERT_TRUE(WriteBoardPrint(MakeBoard("A", 0, 2, 2, 50), stem).ok());
  const std::string svg = ReadBytes(stem + ".svg");
  double width_pt = 0;
  std::istringstream(svg.substr(svg.find("width=\"") + 7, 20)) >> width_pt;
  EXPECT_NEAR(width_pt / 72 * 25.4 * kPxPerMm, Rasterised(stem).width_px, 1);
}

TEST(TargetPrint, RefusesBoardsWhoseTagsTouch) {
  TagBoard board = MakeBoard("A", 0);
  board.gap_mm = 1;
  EXPECT_EQ(WriteBoardPrint(board, TempFolder() / "board").code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
