#include "services/calibration/target_print.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "capture/calibration/tag_detection.h"
#include "tests/capture/calibration/simulated_calibration.h"

namespace weft {
namespace {

constexpr double kPxPerMm = 6;

// The page as a printer at 6 dots per mm would put it on paper: every "x y w h re" of the PDF, which is drawn
// in mm.
Frame PrintPdf(const std::string& pdf) {
  double width_pt = 0, height_pt = 0;
  const size_t box = pdf.find("/MediaBox [0 0 ");
  std::istringstream(pdf.substr(box + 15, 60)) >> width_pt >> height_pt;
  Frame page;
  page.width_px = static_cast<int>(std::lround(width_pt / 72 * 25.4 * kPxPerMm));
  page.height_px = static_cast<int>(std::lround(height_pt / 72 * 25.4 * kPxPerMm));
  auto paper =
      std::make_shared<std::vector<uint8_t>>(static_cast<size_t>(page.width_px) * page.height_px, 250);
  std::istringstream lines(pdf);
  for (std::string line; std::getline(lines, line);) {
    if (line.size() < 3 || line.substr(line.size() - 3) != " re") continue;
    double x, y, w, h;
    std::istringstream(line) >> x >> y >> w >> h;
    for (int row = static_cast<int>(std::lround(y * kPxPerMm)); row < std::lround((y + h) * kPxPerMm);
         ++row) {
      for (int col = static_cast<int>(std::lround(x * kPxPerMm)); col < std::lround((x + w) * kPxPerMm);
           ++col)
        (*paper)[row * page.width_px + col] = 20;
    }
  }
  page.pixels = paper;
  return page;
}

TEST(TargetPrint, ThePrintHoldsTheBoardAtTrueScale) {
  for (const char* family : {"tag36h11", "tagStandard41h12"}) {
    TagBoard board = MakeBoard("A", 30, 3, 4, 20);
    board.family = family;
    board.gap_mm = 17;
    const auto pdf = BoardPdf(board);
    ASSERT_TRUE(pdf.ok()) << pdf.status();
    const auto detector = TagDetector::Make({family}, {}).value();
    CalibrationViews views;
    AddSightings({"t", {board}, {}}, 0, 0, detector->Detect(PrintPdf(*pdf)).value().tags, &views);
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
  const TagBoard board = MakeBoard("A", 0, 2, 2, 50);
  const std::string svg = BoardSvg(board).value(), pdf = BoardPdf(board).value();
  double width_mm = 0, width_pt = 0;
  std::istringstream(svg.substr(svg.find("width=\"") + 7, 20)) >> width_mm;
  std::istringstream(pdf.substr(pdf.find("/MediaBox [0 0 ") + 15, 20)) >> width_pt;
  EXPECT_NEAR(width_mm, width_pt * 25.4 / 72, 1e-3);
}

TEST(TargetPrint, RefusesBoardsWhoseTagsTouch) {
  TagBoard board = MakeBoard("A", 0);
  board.gap_mm = 1;
  EXPECT_EQ(BoardPdf(board).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
