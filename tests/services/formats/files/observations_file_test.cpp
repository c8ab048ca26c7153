#include "services/formats/files/observations_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <charconv>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Observation At(double x_px, double y_px, BoardNode node, float confidence, float sigma_px = 0) {
  Observation o;
  o.x_px = x_px;
  o.y_px = y_px;
  o.node = node;
  o.confidence = confidence;
  o.sigma_px = sigma_px;
  return o;
}

const char kColumns[] = "image,x_px,y_px,board_row,board_col,kind,confidence,sigma_px\n";
const char kOldColumns[] = "image,x_px,y_px,board_row,board_col,kind,confidence\n";

TEST(Observations, AreWrittenInTheDocumentedColumns) {
  EXPECT_EQ(ObservationsToCsv({{"cam1", {At(1.25, -0.5, {3, 4, NodeKind::kCenter}, 0.5f, 0.0625f)}},
                               {"cam2", {At(1e4, 2, {0, 0, NodeKind::kCorner}, 1)}}}),
            std::string(kColumns) +
                "cam1,1.2500,-0.5000,3,4,center,0.50000,0.06250\n"
                "cam2,10000.0000,2.0000,0,0,corner,1.00000,0.00000\n");
}

TEST(Observations, AreRoundedAsTheStandardLibraryDoes) {
  std::mt19937 random(1);
  std::vector<double> values = {0,           -0.0,      1e-9, -1e-9, 0.00005, -0.00005, 0.5,    9.99995,
                                99999.99995, 123456.25, 1e12, -1e12, 0.00015, 2.00025,  1.0 / 3};
  for (int k = 0; k < 20000; ++k)
    values.push_back(std::ldexp(random(), static_cast<int>(random() % 40) - 50));
  for (int k = 0; k < 2000; ++k) values.push_back((random() % 1000000 + 0.5) / 1e4);  // halves
  std::vector<ImageObservations> images(1);
  images[0].image = "c";
  std::string expected = "image,x_px,y_px,board_row,board_col,kind,confidence,sigma_px\n";
  for (const double value : values) {
    images[0].observations.push_back(
        {value, -value, {1, 2, NodeKind::kCenter}, static_cast<float>(value), static_cast<float>(value)});
    const auto text = [](double v, int digits) {
      char buffer[400];
      return std::string(
          buffer, std::to_chars(buffer, buffer + sizeof(buffer), v, std::chars_format::fixed, digits).ptr);
    };
    const auto single = static_cast<float>(value);
    expected += "c," + text(value, 4) + "," + text(-value, 4) + ",1,2,center," + text(single, 5) + "," +
                text(single, 5) + "\n";
  }
  EXPECT_TRUE(ObservationsToCsv(images) == expected);
}

TEST(Observations, ReadBackWithNamesThatNeedQuotes) {
  const TempFolder folder;
  const std::vector<ImageObservations> images = {
      {"left, \"upper\" row",
       {At(1.5, 2.5, {1, 2, NodeKind::kCenter}, 0.25f, 0.5f), At(3, 4, {1, 2, NodeKind::kCorner}, 0)}},
      {"two\nlines", {At(5, 6, {299, 899, NodeKind::kCenter}, 1)}}};
  ASSERT_TRUE(WriteObservations(folder / "o.csv", images).ok());
  const auto back = ReadObservations(folder / "o.csv");
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ((*back)[i].image, images[i].image);
    ASSERT_EQ((*back)[i].observations.size(), images[i].observations.size());
    for (size_t k = 0; k < images[i].observations.size(); ++k) {
      const Observation &a = (*back)[i].observations[k], &b = images[i].observations[k];
      EXPECT_EQ(a.x_px, b.x_px);
      EXPECT_EQ(a.y_px, b.y_px);
      EXPECT_EQ(a.node, b.node);
      EXPECT_EQ(a.confidence, b.confidence);
      EXPECT_EQ(a.sigma_px, b.sigma_px);
    }
  }
}

TEST(Observations, OfOneImageMayStandApart) {
  const auto images = ParseObservations(
      std::string(kColumns) + "a,1,1,0,0,center,1,1\r\nb,1,1,0,0,center,1,1\r\na,2,2,0,1,center,1,1",
      "o.csv");
  ASSERT_TRUE(images.ok()) << images.status();
  ASSERT_EQ(images->size(), 2u);
  EXPECT_EQ((*images)[0].observations.size(), 2u);
}

TEST(Observations, OfVersionsWithoutSigmaAreRead) {
  const auto images = ParseObservations(std::string(kOldColumns) + "a,1.5,1,0,0,center,0.5\n", "o.csv");
  ASSERT_TRUE(images.ok()) << images.status();
  EXPECT_EQ((*images)[0].observations[0].x_px, 1.5);
  EXPECT_EQ((*images)[0].observations[0].confidence, 0.5f);
  EXPECT_EQ((*images)[0].observations[0].sigma_px, 0);
  const auto mixed = ParseObservations(std::string(kOldColumns) + "a,1.5,1,0,0,center,0.5,0.1\n", "o.csv");
  EXPECT_THAT(mixed.status().message(), HasSubstr("8 columns, expected 7"));
}

TEST(Observations, NameFileLineAndColumnOfWhatIsWrong) {
  const auto error = [](const std::string& csv) {
    const auto images = ParseObservations(csv, "o.csv");
    EXPECT_EQ(images.status().code(), absl::StatusCode::kInvalidArgument) << csv;
    EXPECT_THAT(images.status().message(), HasSubstr("o.csv: line "));
    return std::string(images.status().message());
  };
  const std::string good = std::string(kColumns) + "a,1,1,0,0,center,1,1\n";
  EXPECT_THAT(error(""), HasSubstr("line 1: expected the columns image,x_px"));
  EXPECT_THAT(error("image,x,y\n"), HasSubstr("line 1"));
  EXPECT_THAT(error(good + "a,1,1,0,0,center,1\n"),
              AllOf(HasSubstr("line 3"), HasSubstr("7 columns, expected 8")));
  EXPECT_THAT(error(good + "a,nan,1,0,0,center,1,1\n"), HasSubstr("x_px \"nan\""));
  EXPECT_THAT(error(good + "a,1,one,0,0,center,1,1\n"), HasSubstr("y_px \"one\""));
  EXPECT_THAT(error(good + "a,1,1,-1,0,center,1,1\n"), HasSubstr("board_row \"-1\""));
  EXPECT_THAT(error(good + "a,1,1,0,4294967296,center,1,1\n"), HasSubstr("board_col"));
  EXPECT_THAT(error(good + "a,1,1,0,0,edge,1,1\n"), HasSubstr("neither center nor corner"));
  EXPECT_THAT(error(good + "a,1,1,0,0,center,1.5,1\n"), HasSubstr("confidence \"1.5\""));
  EXPECT_THAT(error(good + "a,1,1,0,0,center,1,-1\n"), HasSubstr("sigma_px \"-1\""));
  EXPECT_THAT(error(good + "a,1,1,0,0,center,1,inf\n"), HasSubstr("sigma_px \"inf\""));
}

}  // namespace
}  // namespace weft
