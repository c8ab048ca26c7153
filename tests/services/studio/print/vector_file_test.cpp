// Files as another program renders them.
#include "services/studio/print/vector_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "tests/capture/file_size_limit.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class VectorFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("weft_vector_file_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  // Page `number` (from 1) at 10 px per mm.
  cv::Mat Page(const std::string& pdf, int number) const {
    const std::string page = std::to_string(number);
    const std::string command = std::string(WEFT_PDFTOPPM) + " -r 254 -png -singlefile -f " + page + " -l " +
                                page + " " + Path(pdf) + " " + Path("page");
    EXPECT_EQ(std::system(command.c_str()), 0);
    return cv::imread(Path("page.png"), cv::IMREAD_GRAYSCALE);
  }

  fs::path folder_;
};

// A black square of 10 mm whose upper left corner is at (x, 5) mm.
void DrawSquare(cairo_t* context, double x_mm) {
  cairo_set_source_rgb(context, 0, 0, 0);
  cairo_rectangle(context, x_mm, 5, 10, 10);
  cairo_fill(context);
}

void ExpectSquareAt(const cv::Mat& page, int x_px) {
  EXPECT_LT(page.at<uint8_t>(51, x_px + 1), 50);
  EXPECT_LT(page.at<uint8_t>(148, x_px + 98), 50);
  EXPECT_GT(page.at<uint8_t>(48, x_px + 50), 200);
  EXPECT_GT(page.at<uint8_t>(152, x_px + 50), 200);
  EXPECT_GT(page.at<uint8_t>(100, x_px - 2), 200);
  EXPECT_GT(page.at<uint8_t>(100, x_px + 102), 200);
}

TEST_F(VectorFile, PagesOfAPdfHaveTheirOwnSizesInTrueMm) {
  ASSERT_TRUE(WritePdf(Path("two.pdf"), "two squares", {{60, 40}, {100, 25}}, [](size_t page, cairo_t* to) {
                DrawSquare(to, page == 0 ? 20 : 70);
              }).ok());
  const cv::Mat first = Page("two.pdf", 1), second = Page("two.pdf", 2);
  EXPECT_NEAR(first.cols, 600, 1);
  EXPECT_NEAR(first.rows, 400, 1);
  EXPECT_NEAR(second.cols, 1000, 1);
  EXPECT_NEAR(second.rows, 250, 1);
  ExpectSquareAt(first, 200);
  ExpectSquareAt(second, 700);
}

TEST_F(VectorFile, AnSvgSaysItsSizeAndHoldsPathsInTrueMm) {
  ASSERT_TRUE(WriteSvg(Path("one.svg"), {60, 40}, [](cairo_t* to) { DrawSquare(to, 20); }).ok());
  std::stringstream text;
  text << std::ifstream(Path("one.svg")).rdbuf();
  // 60 and 40 mm in points; the square's left side at 20 mm.
  EXPECT_THAT(text.str(), HasSubstr("width=\"170.0"));
  EXPECT_THAT(text.str(), HasSubstr("height=\"113.3"));
  EXPECT_THAT(text.str(), HasSubstr("M 56.69"));
}

TEST_F(VectorFile, FilesThatCannotBeWrittenAreNamed) {
  const std::string nowhere = Path("missing/file");
  const absl::Status pdf = WritePdf(nowhere, "", {{10, 10}}, [](size_t, cairo_t*) {}),
                     svg = WriteSvg(nowhere, {10, 10}, [](cairo_t*) {});
  for (const absl::Status& status : {pdf, svg}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
    EXPECT_THAT(status.message(), HasSubstr(nowhere));
  }
  const FileSizeLimit limit(10);
  EXPECT_THAT(std::string(WriteSvg(Path("large.svg"), {10, 10}, [](cairo_t*) {}).message()),
              HasSubstr("raise the limit on the size of files (ulimit -f)"));
}

}  // namespace
}  // namespace weft
