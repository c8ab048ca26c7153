// Prints are measured and decoded: the PDF as poppler renders it, the TIFF by its own resolution.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <regex>
#include <sstream>

#include "pattern/board/board_generation.h"
#include "pattern/decoder.h"
#include "services/studio/print/panel_label.h"
#include "services/studio/print/print_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr double kPxPerMm = 10;  // 254 dpi

class Print : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("weft_print_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    BoardGenerationOptions options;
    options.rows = 30;
    options.cols = 60;
    options.cell_mm = 2.7;
    board_ = *GenerateBoard(options);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  PrintLayout Layout(const PrintOptions& options) const {
    const auto layout = LayOutBoard(board_, options);
    EXPECT_TRUE(layout.ok()) << layout.status();
    return *layout;
  }
  void Write(const PrintLayout& layout, const std::string& name, double dpi = 254) const {
    const auto files = WritePrintFiles(board_, layout, Path(name), {dpi});
    ASSERT_TRUE(files.ok()) << files.status();
  }
  // The first page at 10 px per mm.
  cv::Mat Rasterised(const std::string& pdf) const {
    const std::string command =
        std::string(WEFT_PDFTOPPM) + " -r 254 -png -singlefile " + Path(pdf) + " " + Path("page");
    EXPECT_EQ(std::system(command.c_str()), 0);
    return cv::imread(Path("page.png"));
  }

  fs::path folder_;
  Board board_;
};

bool IsDark(const cv::Mat& image, int x, int y) {
  const cv::Vec3b p = image.at<cv::Vec3b>(y, x);
  return p[0] < 100 && p[1] < 100 && p[2] < 100;
}
cv::Vec3b Rgb(CellColor color) {
  const auto rgb = CellColorRgb(color);
  return {rgb[2], rgb[1], rgb[0]};
}
double Difference(const cv::Vec3b& a, const cv::Vec3b& b) { return cv::norm(cv::Vec3d(a) - cv::Vec3d(b)); }

// The middle of every cell has its colour, and the ink lines have their width.
void ExpectCells(const cv::Mat& image, const Board& board, const PrintLayout& layout) {
  const PrintPiece& piece = layout.pages[0].pieces[0];
  int lines = 0, dark = 0;
  for (int r = 0; r < piece.rows; ++r) {
    for (int c = 0; c < piece.cols; ++c) {
      const double x = (piece.x_mm + (c + 0.5) * layout.cell_mm) * kPxPerMm,
                   y = (piece.y_mm + (r + 0.5) * layout.cell_mm) * kPxPerMm;
      const cv::Vec3b pixel = image.at<cv::Vec3b>(static_cast<int>(y), static_cast<int>(x));
      ASSERT_LT(Difference(pixel, Rgb(board.at(piece.row + r, piece.col + c))), 10) << r << " " << c;
      if (c == 0 || r == 0) continue;
      // Across the line on the left.
      for (int k = -13; k < 13; ++k)
        dark += IsDark(image, static_cast<int>(x - layout.cell_mm / 2 * kPxPerMm) + k, static_cast<int>(y));
      ++lines;
    }
  }
  EXPECT_NEAR(dark / static_cast<double>(lines) / kPxPerMm, layout.ink_line_mm, 0.1);
}

// Length of the head's first bar, 3 mm high, below the swatches: the first dark run along its upper edge.
double BarLengthMm(const cv::Mat& image) {
  const int y = static_cast<int>((15 + 42 + 0.1) * kPxPerMm);
  int first = 0;
  while (first < image.cols && !IsDark(image, first, y)) ++first;
  int last = first;
  while (last < image.cols && IsDark(image, last, y)) ++last;
  return (last - first) / kPxPerMm;
}

TEST_F(Print, PdfIsInTrueMm) {
  const PrintLayout layout = Layout({});
  Write(layout, "board.pdf");
  const cv::Mat page = Rasterised("board.pdf");
  ASSERT_FALSE(page.empty());
  EXPECT_NEAR(page.cols / kPxPerMm, layout.pages[0].width_mm, 0.2);
  EXPECT_NEAR(page.rows / kPxPerMm, layout.pages[0].height_mm, 0.2);
  ExpectCells(page, board_, layout);
  EXPECT_NEAR(BarLengthMm(page), 200, 0.2);
}

TEST_F(Print, TiffIsInTrueMmAndSaysItsResolution) {
  const PrintLayout layout = Layout({});
  Write(layout, "board.tif");
  const cv::Mat page = cv::imread(Path("board.tif"));
  ASSERT_FALSE(page.empty());
  EXPECT_NEAR(page.cols / kPxPerMm, layout.pages[0].width_mm, 0.1);
  ExpectCells(page, board_, layout);
  EXPECT_NEAR(BarLengthMm(page), 200, 0.2);
  // Tag 282 (XResolution) is the rational 254/1, tag 296 (ResolutionUnit) inches.
  std::ifstream file(Path("board.tif"), std::ios::binary);
  std::stringstream bytes;
  bytes << file.rdbuf();
  const std::string data = bytes.str();
  const auto number = [&](size_t at, int size) {
    uint32_t value = 0;
    for (int k = 0; k < size; ++k)
      value |= static_cast<uint32_t>(static_cast<uint8_t>(data[at + k])) << (8 * k);
    return value;
  };
  ASSERT_EQ(data.substr(0, 2), "II");
  const size_t directory = number(4, 4);
  double dpi = 0;
  for (uint32_t k = 0; k < number(directory, 2); ++k) {
    const size_t entry = directory + 2 + 12 * k;
    if (number(entry, 2) == 282)
      dpi = number(number(entry + 8, 4), 4) / double(number(number(entry + 8, 4) + 4, 4));
    if (number(entry, 2) == 296) {
      EXPECT_EQ(number(entry + 8, 2), 2u);
    }
  }
  EXPECT_EQ(dpi, 254);
}

TEST_F(Print, SvgSaysItsSizeInPoints) {
  const PrintLayout layout = Layout({});
  Write(layout, "board.svg");
  std::ifstream file(Path("board.svg"));
  std::stringstream text;
  text << file.rdbuf();
  std::smatch match;
  const std::string svg = text.str();
  ASSERT_TRUE(std::regex_search(svg, match, std::regex("width=\"([0-9.]+)pt\" height=\"([0-9.]+)pt\"")));
  EXPECT_NEAR(std::stod(match[1]) * 25.4 / 72, layout.pages[0].width_mm, 0.01);
  EXPECT_NEAR(std::stod(match[2]) * 25.4 / 72, layout.pages[0].height_mm, 0.01);
}

TEST_F(Print, PrintDecodes) {
  const PrintLayout layout = Layout({});
  Write(layout, "board.tif", 127);  // 5 px per mm: 13.5 px a cell
  const cv::Mat page = cv::imread(Path("board.tif"));
  ASSERT_FALSE(page.empty());
  Frame frame;
  frame.width_px = page.cols;
  frame.height_px = page.rows;
  frame.format = PixelFormat::kRgb8;
  auto pixels = std::make_shared<std::vector<uint8_t>>();
  for (int y = 0; y < page.rows; ++y) {
    for (int x = 0; x < page.cols; ++x) {
      const cv::Vec3b p = page.at<cv::Vec3b>(y, x);
      pixels->insert(pixels->end(), {p[2], p[1], p[0]});
    }
  }
  frame.pixels = pixels;
  const auto index = BoardIndex::Build(board_);
  ASSERT_TRUE(index.ok());
  const auto decoded = DecodeView(frame, *index, DecodeOptions{});
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  const PrintPiece& piece = layout.pages[0].pieces[0];
  int centers = 0, right = 0;
  double worst = 0;
  for (const Observation& o : decoded->observations) {
    if (o.node.kind != NodeKind::kCenter) continue;
    ++centers;
    const double x = (piece.x_mm + (o.node.col + 0.5) * 2.7) * 5 - 0.5,
                 y = (piece.y_mm + (o.node.row + 0.5) * 2.7) * 5 - 0.5;
    right += std::hypot(o.x_px - x, o.y_px - y) < 3.4;  // a quarter of a cell
    worst = std::max(worst, std::hypot(o.x_px - x, o.y_px - y));
  }
  EXPECT_GT(centers, 0.97 * 30 * 60);
  EXPECT_EQ(right, centers) << worst;
}

TEST_F(Print, PanelsAreCutOutWithTheirAllowance) {
  board_.panels.assign(30 * 60, 0);
  for (int r = 5; r < 25; ++r)
    for (int c = 5; c < 50; ++c)
      if (c != 27) board_.panels[60 * r + c] = c < 27 ? 1 : 2;
  PrintOptions options;
  options.page_width_mm = 330;
  options.seam_allowance_mm = 5;  // two cells
  const PrintLayout layout = Layout(options);
  Write(layout, "panels.pdf");
  const cv::Mat page = Rasterised("panels.pdf");
  ASSERT_FALSE(page.empty());
  ASSERT_EQ(layout.pages[0].pieces.size(), 2u);
  for (const PrintPiece& piece : layout.pages[0].pieces) {
    const std::vector<uint8_t> cells = PieceCells(board_, piece, layout.allowance_cells);
    const PanelLabel label = PlacePanelLabel(piece, cells, 2.7);
    EXPECT_FALSE(label.leader_mm);
    for (int r = 0; r < piece.rows; ++r) {
      for (int c = 0; c < piece.cols; ++c) {
        const Eigen::Vector2d middle(piece.x_mm + (c + 0.5) * 2.7, piece.y_mm + (r + 0.5) * 2.7);
        if ((middle.array() > label.low_mm.array()).all() && (middle.array() < label.high_mm.array()).all())
          continue;
        const cv::Vec3b pixel =
            page.at<cv::Vec3b>(static_cast<int>((piece.y_mm + (r + 0.5) * 2.7) * kPxPerMm),
                               static_cast<int>((piece.x_mm + (c + 0.5) * 2.7) * kPxPerMm));
        const bool printed = cells[r * piece.cols + c] > 0;
        const cv::Vec3b expected =
            printed ? Rgb(board_.at(piece.row + r, piece.col + c)) : cv::Vec3b(255, 255, 255);
        ASSERT_LT(Difference(pixel, expected), 10) << piece.label << " " << r << " " << c;
      }
    }
    // The cut line runs along the outside.
    EXPECT_TRUE(IsDark(page, static_cast<int>((piece.x_mm + 10 * 2.7) * kPxPerMm),
                       static_cast<int>(piece.y_mm * kPxPerMm) - 1));
  }
}

TEST_F(Print, PagesOfImagesAreFilesOfTheirOwn) {
  PrintOptions options;
  options.page_width_mm = 330;
  options.page_height_mm = 150;
  options.overlap_mm = 6;
  const PrintLayout layout = Layout(options);
  ASSERT_EQ(layout.pages.size(), 4u);
  size_t heard = 0;
  const auto files =
      WritePrintFiles(board_, layout, Path("tiles.svg"), {}, [&](size_t page) { heard = page; });
  ASSERT_TRUE(files.ok());
  EXPECT_EQ(*files, (std::vector<std::string>{Path("tiles.svg"), Path("tiles-2.svg"), Path("tiles-3.svg"),
                                              Path("tiles-4.svg")}));
  for (const std::string& file : *files) EXPECT_TRUE(fs::exists(file));
  EXPECT_EQ(heard, 4u);
}

TEST_F(Print, SaysWhatIsWrong) {
  const PrintLayout layout = Layout({});
  EXPECT_THAT(WritePrintFiles(board_, layout, Path("board.doc"), {}).status().message(),
              HasSubstr(".pdf, .svg or .tif"));
  EXPECT_THAT(WritePrintFiles(board_, layout, Path("board.tif"), {4000}).status().message(),
              HasSubstr("print at"));
  EXPECT_THAT(WritePrintFiles(board_, layout, Path("board.tif"), {0}).status().message(), HasSubstr("dpi"));
}

}  // namespace
}  // namespace weft
