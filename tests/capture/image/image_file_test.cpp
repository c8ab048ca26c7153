#include "capture/image/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/image/image_header.h"
#include "tests/capture/file_size_limit.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

Frame Gradient(PixelFormat format) {
  Frame frame;
  frame.width_px = 64;
  frame.height_px = 48;
  frame.format = format;
  std::vector<uint8_t> pixels;
  for (int i = 0; i < 64 * 48 * BytesPerPixel(format); ++i) pixels.push_back(static_cast<uint8_t>(i * 7));
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(pixels);
  return frame;
}

TEST(ImageFile, LosslessFormatsRoundTrip) {
  const TempFolder folder;
  for (const char* name : {"a.png", "a.tif"}) {
    for (const PixelFormat format : {PixelFormat::kGrey8, PixelFormat::kRgb8}) {
      const Frame frame = Gradient(format);
      ASSERT_TRUE(WriteImageFile(folder / name, frame).ok());
      const auto read = ReadImageFile(folder / name);
      ASSERT_TRUE(read.ok()) << read.status();
      EXPECT_EQ(read->format, format);
      EXPECT_EQ(*read->pixels, *frame.pixels);
    }
  }
}

TEST(ImageFile, ReadsColoursInTheRightOrder) {
  const TempFolder folder;
  cv::Mat red(8, 8, CV_8UC3, cv::Scalar(0, 0, 255));  // OpenCV: blue, green, red
  for (const char* name : {"red.png", "red.jpg", "red.tif"}) {
    cv::imwrite(folder / name, red);
    const auto read = ReadImageFile(folder / name);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_GT(read->row(4)[12], 250) << name;
    EXPECT_LT(read->row(4)[13], 5) << name;
    EXPECT_LT(read->row(4)[14], 5) << name;
  }
}

TEST(ImageFile, ScalesSixteenBitsToEight) {
  const TempFolder folder;
  cv::imwrite(folder / "a.png", cv::Mat(4, 4, CV_16UC1, cv::Scalar(65535)));
  cv::imwrite(folder / "b.tif", cv::Mat(4, 4, CV_16UC1, cv::Scalar(32896)));
  EXPECT_EQ(ReadImageFile(folder / "a.png")->row(0)[0], 255);
  EXPECT_EQ(ReadImageFile(folder / "b.tif")->row(0)[0], 128);
}

// Cameras of 10 to 14 bits often leave the upper bits of 16 empty, or the lower ones.
TEST(ImageFile, KeepsTheBitsThatDeepImagesUse) {
  const TempFolder folder;
  cv::Mat eight(64, 64, CV_8UC3);
  cv::RNG(5).fill(eight, cv::RNG::UNIFORM, 0, 256);
  eight.at<cv::Vec3b>(0, 0) = {255, 255, 255};
  for (const char* name : {"deep.png", "deep.tif"}) {
    for (const int bits : {10, 12, 14}) {
      for (const int empty : {0, 16 - bits}) {  // lower bits
        cv::Mat deep;
        eight.convertTo(deep, CV_16U, ((1 << bits) - 1) / 255.0);
        deep *= 1 << empty;
        cv::imwrite(folder / name, deep);
        const auto read = ReadImageFile(folder / name);
        ASSERT_TRUE(read.ok()) << read.status();
        cv::Mat rgb(64, 64, CV_8UC3, const_cast<uint8_t*>(read->row(0))), bgr;
        cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
        EXPECT_LE(cv::norm(bgr, eight, cv::NORM_INF), 1) << name << " " << bits << " " << empty;
      }
    }
  }
}

TEST(ImageFile, ReadsGreyFilesAsMosaicOnRequest) {
  const TempFolder folder;
  ASSERT_TRUE(WriteImageFile(folder / "raw.png", Gradient(PixelFormat::kGrey8)).ok());
  EXPECT_EQ(ReadImageFile(folder / "raw.png", PixelFormat::kBayerGb8)->format, PixelFormat::kBayerGb8);
  ASSERT_TRUE(WriteImageFile(folder / "rgb.png", Gradient(PixelFormat::kRgb8)).ok());
  EXPECT_EQ(ReadImageFile(folder / "rgb.png", PixelFormat::kBayerGb8)->format, PixelFormat::kRgb8);
}

TEST(ImageFile, RefusesTruncatedImagesOfEveryFormat) {
  const TempFolder folder;
  for (const char* name : {"a.png", "a.jpg", "a.tif"}) {
    ASSERT_TRUE(WriteImageFile(folder / name, Gradient(PixelFormat::kRgb8)).ok());
    const std::string whole = ReadBytes(folder / name);
    for (const double share : {0.01, 0.5, 0.98}) {
      WriteBytes(folder / name,
                 whole.substr(0, static_cast<size_t>(static_cast<double>(whole.size()) * share)));
      const auto read = ReadImageFile(folder / name);
      EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << name << " cut to " << share;
      EXPECT_THAT(std::string(read.status().message()), HasSubstr(name));
    }
  }
}

// A picture with edges and noise, so that every part of a decoder has something to do.
cv::Mat Picture(int type) {
  cv::Mat image(77, 101, type);
  cv::RNG random(7);
  random.fill(image, cv::RNG::UNIFORM, 0, image.depth() == CV_16U ? 65536 : 256);
  cv::GaussianBlur(image, image, {0, 0}, 1.5);
  cv::rectangle(image, {20, 10}, {60, 50}, cv::Scalar::all(40), cv::FILLED);
  return image;
}

// As OpenCV decodes the file: red, green, blue or grey, 8 bits.
cv::Mat Reference(const std::string& path) {
  cv::Mat image = cv::imread(path, cv::IMREAD_UNCHANGED);
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / 257.0);
  if (image.channels() == 3) cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
  if (image.channels() == 4) cv::cvtColor(image, image, cv::COLOR_BGRA2RGB);
  return image;
}

TEST(ImageFile, DecodesEveryKindToTheBytesOfOpenCv) {
  const TempFolder folder;
  const struct {
    const char* name;
    int type;
    std::vector<int> parameters;
  } kKinds[] = {{"grey.jpg", CV_8UC1, {}},
                {"colour.jpg", CV_8UC3, {cv::IMWRITE_JPEG_QUALITY, 70}},
                {"fine.jpg", CV_8UC3, {cv::IMWRITE_JPEG_QUALITY, 100}},
                {"progressive.jpg", CV_8UC3, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}},
                {"restarts.jpg", CV_8UC3, {cv::IMWRITE_JPEG_RST_INTERVAL, 3}},
                {"grey.png", CV_8UC1, {}},
                {"bilevel.png", CV_8UC1, {cv::IMWRITE_PNG_BILEVEL, 1}},
                {"colour.png", CV_8UC3, {}},
                {"alpha.png", CV_8UC4, {}},
                {"deep_grey.png", CV_16UC1, {}},
                {"deep_colour.png", CV_16UC3, {}},
                {"deep_alpha.png", CV_16UC4, {}},
                {"grey.tif", CV_8UC1, {}},
                {"colour.tif", CV_8UC3, {}},
                {"deep.tif", CV_16UC3, {}}};
  for (const auto& kind : kKinds) {
    ASSERT_TRUE(cv::imwrite(folder / kind.name, Picture(kind.type), kind.parameters)) << kind.name;
    const auto read = ReadImageFile(folder / kind.name);
    ASSERT_TRUE(read.ok()) << read.status();
    const cv::Mat expected = Reference(folder / kind.name);
    ASSERT_EQ(read->pixels->size(), expected.total() * expected.elemSize()) << kind.name;
    EXPECT_TRUE(std::equal(read->pixels->begin(), read->pixels->end(), expected.datastart)) << kind.name;
  }
}

TEST(ImageFile, RefusesPixelsThatADecoderWouldMakeUp) {
  const TempFolder folder;
  cv::imwrite(folder / "a.jpg", Picture(CV_8UC3));
  cv::imwrite(folder / "a.png", Picture(CV_8UC3));
  const std::string jpeg = ReadBytes(folder / "a.jpg"), png = ReadBytes(folder / "a.png");
  WriteBytes(folder / "half.jpg", jpeg.substr(0, jpeg.size() / 2) + "\xff\xd9");
  WriteBytes(folder / "half.png", png.substr(0, png.size() / 2) + png.substr(png.size() - 12));
  std::string bit = png;
  bit[bit.size() / 2] ^= 1;
  WriteBytes(folder / "bit.png", bit);
  for (const char* name : {"half.jpg", "half.png", "bit.png"}) {
    const auto read = ReadImageFile(folder / name);
    EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << name;
    EXPECT_THAT(std::string(read.status().message()), HasSubstr(name));
    EXPECT_THAT(std::string(read.status().message()), HasSubstr("damaged or truncated"));
  }
}

// EXIF data as cameras write them: big-endian, one tag.
std::string Exif(int orientation) {
  return std::string("MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0", 19) +
         static_cast<char>(orientation) + std::string(6, '\0');
}

// A segment of a JPEG file whose length is `off` by so many bytes.
std::string Segment(char marker, const std::string& content, int off = 0) {
  const size_t length = content.size() + 2 + static_cast<size_t>(off);
  return std::string("\xff") + marker + static_cast<char>(length >> 8) + static_cast<char>(length) + content;
}

TEST(ImageFile, ReadsJpegWhoseMetadataStateAWrongLength) {
  const TempFolder folder;
  cv::imwrite(folder / "a.jpg", Picture(CV_8UC3));
  const std::string jpeg = ReadBytes(folder / "a.jpg");
  const auto right = ReadImageFile(folder / "a.jpg");
  const std::string start = jpeg.substr(0, 2), rest = jpeg.substr(2);
  const std::string metadata[] = {Segment('\xe1', "Exif" + std::string(40, '\x11'), -9),
                                  Segment('\xed', std::string(300, 'x'), -150), std::string(7, '\0'),
                                  Segment('\xe0', std::string("JFIF\0\x03\x01\0\0\x01\0\x01\0\0", 14))};
  for (const std::string& odd : metadata) {
    WriteBytes(folder / "odd.jpg", start + odd + rest);
    const auto read = ReadImageFile(folder / "odd.jpg", {}, ImageSize{101, 77});
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(*read->pixels, *right->pixels);
  }
}

std::string Crc32Big(const std::string& chunk) {
  uint32_t crc = 0xffffffff;
  for (const char c : chunk) {
    crc ^= static_cast<uint8_t>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
  }
  crc = ~crc;
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(crc >> shift);
  return bytes;
}

TEST(ImageFile, TurnsNoFormatByItsOrientation) {
  const TempFolder folder;
  cv::imwrite(folder / "plain.jpg", Picture(CV_8UC3));
  cv::imwrite(folder / "plain.png", Picture(CV_8UC3));
  const std::string jpeg = ReadBytes(folder / "plain.jpg"), png = ReadBytes(folder / "plain.png");
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const std::string exif = Exif(orientation), chunk = "eXIf" + exif;
    const std::string in_png =
        std::string("\0\0\0", 3) + static_cast<char>(exif.size()) + chunk + Crc32Big(chunk);
    constexpr size_t kBeforePixels = 33, kEnd = 12;
    const struct {
      const char* name;
      std::string bytes;
    } kFiles[] = {
        {"a.jpg", jpeg.substr(0, 2) + Segment('\xe1', std::string("Exif\0\0", 6) + exif) + jpeg.substr(2)},
        {"a.png", png.substr(0, kBeforePixels) + in_png + png.substr(kBeforePixels)},
        {"b.png", png.substr(0, png.size() - kEnd) + in_png + png.substr(png.size() - kEnd)}};
    for (const auto& [name, bytes] : kFiles) {
      WriteBytes(folder / name, bytes);
      const auto read = ReadImageFile(folder / name);
      ASSERT_TRUE(read.ok()) << read.status();
      const auto plain = ReadImageFile(folder / (name[2] == 'j' ? "plain.jpg" : "plain.png"));
      EXPECT_EQ(*read->pixels, *plain->pixels) << name;
      const auto header = ReadImageFileHeader(folder / name);
      ASSERT_TRUE(header.ok()) << header.status();
      EXPECT_EQ(header->orientation, orientation) << name;
      EXPECT_EQ(header->width_px, 101);
      EXPECT_EQ(header->height_px, 77);
    }
  }
}

// Opening one that nobody writes would never end.
TEST(ImageFile, IsNoFifo) {
  const TempFolder folder;
  ASSERT_EQ(mkfifo((folder / "a.png").c_str(), 0600), 0);
  const auto read = ReadImageFile(folder / "a.png");
  EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(read.status().message()), HasSubstr("a.png: not a file"));
  EXPECT_EQ(ReadImageFileHeader(folder / "a.png").status(), read.status());
}

TEST(ImageFile, ReadsPngWhoseMetadataAreDamaged) {
  const TempFolder folder;
  cv::imwrite(folder / "a.png", Picture(CV_8UC3));
  const std::string png = ReadBytes(folder / "a.png");
  const std::string text = std::string("\0\0\0\5", 4) + "tEXtTitle" + "????";  // a wrong checksum
  WriteBytes(folder / "b.png", png.substr(0, 33) + text + png.substr(33));
  const auto right = ReadImageFile(folder / "a.png"), read = ReadImageFile(folder / "b.png");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read->pixels, *right->pixels);
}

TEST(ImageFile, NamesAKindOfJpegThatIsNotRead) {
  const TempFolder folder;
  cv::imwrite(folder / "a.jpg", Picture(CV_8UC3));
  const std::string jpeg = ReadBytes(folder / "a.jpg");
  const size_t frame = jpeg.find("\xff\xc0");
  ASSERT_NE(frame, std::string::npos);
  std::string lossless = jpeg, deep = jpeg;
  lossless[frame + 1] = '\xc3';
  deep[frame + 4] = 12;
  for (const std::string& bytes : {lossless, deep}) {
    WriteBytes(folder / "b.jpg", bytes);
    EXPECT_THAT(std::string(ReadImageFile(folder / "b.jpg").status().message()),
                HasSubstr("b.jpg: a JPEG image of a kind that is not read"));
  }
}

TEST(ImageFile, ReadsTheThreePromisedFormatsOnly) {
  const TempFolder folder;
  for (const char* ending : {".bmp", ".webp", ".ppm"}) {
    cv::imwrite(folder / ("a" + std::string(ending)), Picture(CV_8UC3));
    std::filesystem::rename(folder / ("a" + std::string(ending)), folder / "a.png");
    const auto read = ReadImageFile(folder / "a.png");
    EXPECT_THAT(std::string(read.status().message()), HasSubstr("not a PNG, JPEG or TIFF")) << ending;
  }
  // By content: the name does not matter.
  cv::imwrite(folder / "b.jpg", Picture(CV_8UC3));
  std::filesystem::rename(folder / "b.jpg", folder / "b.png");
  EXPECT_TRUE(ReadImageFile(folder / "b.png").ok());
}

TEST(ImageFile, ChecksTheSizeBeforePixelsAreDecoded) {
  const TempFolder folder;
  for (const char* name : {"a.png", "a.jpg", "a.tif"}) {
    cv::imwrite(folder / name, Picture(CV_8UC3));
    EXPECT_TRUE(ReadImageFile(folder / name, {}, ImageSize{101, 77}).ok());
    const auto read = ReadImageFile(folder / name, {}, ImageSize{640, 480});
    EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(read.status().message()), HasSubstr("image is 101x77, the rig says 640x480"));
    const std::optional<WrongSize> sizes = WrongSizeOf(StatusAt("frame 3", read.status()));
    ASSERT_TRUE(sizes.has_value());
    EXPECT_EQ(sizes->found, (ImageSize{101, 77}));
    EXPECT_EQ(sizes->expected, (ImageSize{640, 480}));
  }
  EXPECT_FALSE(WrongSizeOf(absl::InvalidArgumentError("image is 1x2, the rig says 3x4")).has_value());
  std::string big = ReadBytes(folder / "a.png");
  for (const size_t at : {16, 20}) big.replace(at, 4, std::string("\0\0\x4e\x20", 4));  // 20000
  WriteBytes(folder / "big.png", big);
  EXPECT_THAT(std::string(ReadImageFile(folder / "big.png").status().message()),
              HasSubstr("big.png: image is 20000x20000, more than the 256 Mi pixels"));
}

TEST(ImageFile, TellsAbsentEmptyAndForeignFilesApart) {
  const TempFolder folder;
  EXPECT_EQ(ReadImageFile(folder / "none.png").status().code(), absl::StatusCode::kNotFound);
  WriteBytes(folder / "empty.png", "");
  EXPECT_THAT(std::string(ReadImageFile(folder / "empty.png").status().message()), HasSubstr("empty"));
  WriteBytes(folder / "text.png", "this is no image");
  EXPECT_EQ(ReadImageFile(folder / "text.png").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ImageFile, WritesNothingWhereItCannot) {
  const TempFolder folder;
  EXPECT_EQ(WriteImageFile(folder / "no such folder/a.png", Gradient(PixelFormat::kGrey8)).code(),
            absl::StatusCode::kNotFound);
  {
    const FileSizeLimit limit(10);
    EXPECT_THAT(std::string(WriteImageFile(folder / "a.png", Gradient(PixelFormat::kGrey8)).message()),
                HasSubstr("(File too large); raise the limit on the size of files (ulimit -f)"));
  }
  EXPECT_EQ(WriteImageFile(folder / "a.xyz", Gradient(PixelFormat::kGrey8)).code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace weft
