#include "capture/image/raw_frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/take/frame_codec.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

RawFrame FrameOf(RawFormat format, int width_px, int height_px, const std::vector<uint8_t>& content) {
  RawFrame frame;
  frame.camera_id = "cam";
  frame.width_px = width_px;
  frame.height_px = height_px;
  frame.format = format;
  auto bytes = std::make_shared<AlignedBuffer>(content.size());
  std::copy(content.begin(), content.end(), bytes->data());
  frame.bytes = std::move(bytes);
  return frame;
}

// Values of `bits` each as a little-endian stream of bits, written bit by bit.
std::vector<uint8_t> BitStream(const std::vector<unsigned>& values, int bits) {
  std::vector<uint8_t> out((values.size() * bits + 7) / 8, 0);
  size_t at = 0;
  for (const unsigned value : values)
    for (int bit = 0; bit < bits; ++bit, ++at)
      if (value >> bit & 1) out[at / 8] = static_cast<uint8_t>(out[at / 8] | 1 << at % 8);
  return out;
}

TEST(RawFrame, KeepsTheUpperBitsOfDeepPixels) {
  const std::vector<unsigned> values = {0, 1023, 512, 4, 259, 1020};
  const std::vector<uint8_t> expected = {0, 255, 128, 1, 64, 255};
  std::vector<uint8_t> words;
  for (const unsigned v : values)
    words.insert(words.end(), {static_cast<uint8_t>(v), static_cast<uint8_t>(v >> 8)});
  // GigE Vision's packing: the upper bytes of two pixels around their lower bits.
  std::vector<uint8_t> pairs;
  for (size_t i = 0; i < values.size(); i += 2) {
    pairs.push_back(static_cast<uint8_t>(values[i] >> 2));
    pairs.push_back(static_cast<uint8_t>((values[i] & 3) | (values[i + 1] & 3) << 4));
    pairs.push_back(static_cast<uint8_t>(values[i + 1] >> 2));
  }
  const RawFrame frames[] = {FrameOf(RawFormat::kMono10, 3, 2, words),
                             FrameOf(RawFormat::kBayerRg10p, 3, 2, BitStream(values, 10)),
                             FrameOf(RawFormat::kMono10Packed, 3, 2, pairs)};
  for (const RawFrame& raw : frames) {
    // GigE Vision counts 12 bits a pixel for both of its packings.
    const auto frame = ToFrame(raw);
    ASSERT_TRUE(frame.ok()) << frame.status();
    EXPECT_EQ(*frame->pixels, expected) << RawFormatName(raw.format);
  }
  EXPECT_EQ(ToFrame(frames[1])->format, PixelFormat::kBayerRg8);
  const auto twelve = ToFrame(FrameOf(RawFormat::kMono12p, 2, 1, BitStream({0xabc, 0x123}, 12)));
  ASSERT_TRUE(twelve.ok());
  EXPECT_EQ(*twelve->pixels, (std::vector<uint8_t>{0xab, 0x12}));
}

TEST(RawFrame, KeepsTheUpperBitsOfCsi2Pixels) {
  // Four pixels of 10 bits in 5 bytes, two of 12 in 3: upper bytes, then the lower bits, first pixel lowest.
  const auto ten = ToFrame(FrameOf(RawFormat::kBayerRg10Csi2, 4, 1, {0xab, 0x01, 0xff, 0x80, 0b11'10'01'00}));
  ASSERT_TRUE(ten.ok());
  EXPECT_EQ(*ten->pixels, (std::vector<uint8_t>{0xab, 0x01, 0xff, 0x80}));
  EXPECT_EQ(ten->format, PixelFormat::kBayerRg8);
  const auto twelve = ToFrame(FrameOf(RawFormat::kMono12Csi2, 2, 2, {1, 2, 0xff, 3, 4, 0xff}));
  ASSERT_TRUE(twelve.ok());
  EXPECT_EQ(*twelve->pixels, (std::vector<uint8_t>{1, 2, 3, 4}));
}

// The frame of the values in a format of GenICam, with `bits` a value.
RawFrame DeepFrame(RawFormat format, int bits, int width_px, int height_px, const std::vector<unsigned>& v) {
  std::vector<uint8_t> bytes;
  switch (format) {
    case RawFormat::kBayerRg10Packed:
    case RawFormat::kBayerRg12Packed:
      for (size_t i = 0; i < v.size(); i += 2) {
        const unsigned second = i + 1 < v.size() ? v[i + 1] : 0, lower = (1u << (bits - 8)) - 1;
        bytes.insert(bytes.end(), {static_cast<uint8_t>(v[i] >> (bits - 8)),
                                   static_cast<uint8_t>((v[i] & lower) | (second & lower) << 4),
                                   static_cast<uint8_t>(second >> (bits - 8))});
      }
      break;
    case RawFormat::kBayerRg10Csi2:
    case RawFormat::kBayerRg12Csi2: {
      const size_t group = bits == 10 ? 4 : 2;
      for (size_t i = 0; i < v.size(); i += group) {
        unsigned rest = 0;
        for (size_t k = 0; k < group; ++k) {
          const unsigned value = i + k < v.size() ? v[i + k] : 0;
          bytes.push_back(static_cast<uint8_t>(value >> (bits - 8)));
          rest |= (value & ((1u << (bits - 8)) - 1)) << (k * static_cast<size_t>(bits - 8));
        }
        bytes.push_back(static_cast<uint8_t>(rest));
      }
      break;
    }
    case RawFormat::kBayerRg10p:
    case RawFormat::kBayerRg12p:
      bytes = BitStream(v, bits);
      break;
    default:
      for (const unsigned value : v)
        bytes.insert(bytes.end(), {static_cast<uint8_t>(value), static_cast<uint8_t>(value >> 8)});
  }
  bytes.resize(RawBytes(format, width_px, height_px));
  return FrameOf(format, width_px, height_px, bytes);
}

// Underexposed cameras, and those of 12 bits that deliver Mono16.
TEST(RawFrame, DarkFramesKeepTheBitsThatTheyUse) {
  constexpr int kWidth = 37, kHeight = 29;  // odd: the last group of pixels is not full
  const struct {
    RawFormat format;
    int bits;
  } kDeep[] = {
      {RawFormat::kBayerRg10, 10},       {RawFormat::kBayerRg12, 12},     {RawFormat::kMono16, 16},
      {RawFormat::kBayerRg10p, 10},      {RawFormat::kBayerRg12p, 12},    {RawFormat::kBayerRg10Packed, 10},
      {RawFormat::kBayerRg12Packed, 12}, {RawFormat::kBayerRg10Csi2, 10}, {RawFormat::kBayerRg12Csi2, 12}};
  for (const auto& [format, bits] : kDeep) {
    for (int used = 8; used <= bits; ++used) {
      std::vector<unsigned> values;
      for (unsigned k = 0; k < kWidth * kHeight; ++k) values.push_back((k * 7919) % (1u << used));
      const RawFrame raw = DeepFrame(format, bits, kWidth, kHeight, values);
      const auto frame = ToFrame(raw, DeepBits::kUsed), upper = ToFrame(raw);
      ASSERT_TRUE(frame.ok() && upper.ok()) << frame.status();
      for (size_t k = 0; k < values.size(); ++k) {
        ASSERT_EQ((*frame->pixels)[k], values[k] >> (used - 8)) << RawFormatName(format) << " " << used;
        ASSERT_EQ((*upper->pixels)[k], values[k] >> (bits - 8)) << RawFormatName(format) << " " << used;
      }
    }
  }
}

// ITU-R BT.601, luma 16 to 235: colours by its definition and not by a library.
TEST(RawFrame, ColoursOfYuvAreThoseOfBt601) {
  for (const auto& [r, g, b] : {std::array{200., 30., 60.}, {20., 220., 90.}, {90., 80., 250.}}) {
    const double y = 0.299 * r + 0.587 * g + 0.114 * b;
    const auto luma = static_cast<uint8_t>(std::lround(16 + y * 219 / 255));
    const auto cb = static_cast<uint8_t>(std::lround(128 + (b - y) / 1.772 * 224 / 255));
    const auto cr = static_cast<uint8_t>(std::lround(128 + (r - y) / 1.402 * 224 / 255));
    for (const auto& frame : {ToFrame(FrameOf(RawFormat::kYuyv, 2, 1, {luma, cb, luma, cr})),
                              ToFrame(FrameOf(RawFormat::kUyvy, 2, 1, {cb, luma, cr, luma}))}) {
      ASSERT_TRUE(frame.ok());
      EXPECT_NEAR((*frame->pixels)[0], r, 2);
      EXPECT_NEAR((*frame->pixels)[4], g, 2);
      EXPECT_NEAR((*frame->pixels)[5], b, 2);
    }
  }
}

TEST(RawFrame, MotionJpegShowsWhatWasEncoded) {
  cv::Mat image(48, 64, CV_8UC3);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<cv::Vec3b>(y, x) = {static_cast<uint8_t>(2 * x), static_cast<uint8_t>(3 * y), 60};
  std::vector<uint8_t> jpeg;
  ASSERT_TRUE(cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, 98}));
  const auto frame = ToFrame(FrameOf(RawFormat::kMotionJpeg, 64, 48, jpeg));
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->format, PixelFormat::kRgb8);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR((*frame->pixels)[3 * (y * 64 + x) + c], image.at<cv::Vec3b>(y, x)[2 - c], 12);
  EXPECT_THAT(std::string(ToFrame(FrameOf(RawFormat::kMotionJpeg, 32, 48, jpeg)).status().message()),
              HasSubstr("JPEG is 64x48"));
}

// The file of `frame` without the segments of the marker `code`.
std::vector<uint8_t> WithoutSegments(const std::vector<uint8_t>& jpeg, uint8_t code) {
  std::vector<uint8_t> out(jpeg.begin(), jpeg.begin() + 2);
  size_t at = 2;
  while (jpeg[at + 1] != 0xDA) {  // start of scan
    const size_t size = 2 + (size_t{jpeg[at + 2]} << 8 | jpeg[at + 3]);
    if (jpeg[at + 1] != code) out.insert(out.end(), &jpeg[at], &jpeg[at] + size);
    at += size;
  }
  out.insert(out.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at), jpeg.end());
  return out;
}

TEST(RawFrame, ReadsMotionJpegAsWebcamsWriteIt) {
  const cv::Mat image(48, 64, CV_8UC3, cv::Scalar(40, 90, 160));
  std::vector<uint8_t> jpeg;
  ASSERT_TRUE(cv::imencode(".jpg", image, jpeg));
  const auto whole = ToFrame(FrameOf(RawFormat::kMotionJpeg, 64, 48, jpeg));
  ASSERT_TRUE(whole.ok()) << whole.status();
  // Without the Huffman tables that everybody knows.
  constexpr uint8_t kHuffmanTables = 0xC4;
  const auto short_file =
      ToFrame(FrameOf(RawFormat::kMotionJpeg, 64, 48, WithoutSegments(jpeg, kHuffmanTables)));
  ASSERT_TRUE(short_file.ok()) << short_file.status();
  EXPECT_EQ(*short_file->pixels, *whole->pixels);
  // With bytes between pixels and end.
  std::vector<uint8_t> padded = jpeg;
  padded.insert(padded.end() - 2, 3, 0);
  const auto padded_frame = ToFrame(FrameOf(RawFormat::kMotionJpeg, 64, 48, padded));
  ASSERT_TRUE(padded_frame.ok()) << padded_frame.status();
  EXPECT_EQ(*padded_frame->pixels, *whole->pixels);
  // Not with pixels missing.
  const std::vector<uint8_t> cut(jpeg.begin(), jpeg.end() - static_cast<std::ptrdiff_t>(jpeg.size() / 20));
  EXPECT_THAT(std::string(ToFrame(FrameOf(RawFormat::kMotionJpeg, 64, 48, cut)).status().message()),
              HasSubstr("damaged or truncated"));
}

TEST(RawFrame, TurnsOtherOrdersIntoRgb) {
  EXPECT_EQ(*ToFrame(FrameOf(RawFormat::kBgr8, 1, 1, {1, 2, 3}))->pixels, (std::vector<uint8_t>{3, 2, 1}));
  // Without chroma, luma 16 is black and 235 white.
  EXPECT_EQ(*ToFrame(FrameOf(RawFormat::kYuyv, 2, 1, {16, 128, 235, 128}))->pixels,
            (std::vector<uint8_t>{0, 0, 0, 255, 255, 255}));
  EXPECT_EQ(*ToFrame(FrameOf(RawFormat::kUyvy, 2, 1, {128, 16, 128, 235}))->pixels,
            (std::vector<uint8_t>{0, 0, 0, 255, 255, 255}));
}

TEST(RawFrame, RefusesWhatIsNoImageAndNamesTheCamera) {
  EXPECT_THAT(
      std::string(ToFrame(FrameOf(RawFormat::kMono8, 4, 4, std::vector<uint8_t>(15))).status().message()),
      HasSubstr("camera cam: 15 bytes, expected 16 for 4x4 Mono8"));
  EXPECT_FALSE(FrameOf(static_cast<RawFormat>(7), 1, 1, {0}).Validate().ok());
  EXPECT_FALSE(FrameOf(RawFormat::kMono8, 0, 4, {}).Validate().ok());
  EXPECT_FALSE(ToFrame(FrameOf(RawFormat::kMotionJpeg, 4, 4, {1, 2, 3})).ok());
}

TEST(RawFrame, KnowsItsFormatsByName) {
  EXPECT_EQ(*RawFormatFromName("BayerRG12p"), RawFormat::kBayerRg12p);
  EXPECT_THAT(std::string(RawFormatFromName("Mono9").status().message()), HasSubstr("Mono8, Mono10"));
}

TEST(FrameCodec, GivesBackEveryByteOfEveryFormat) {
  uint32_t state = 1;
  for (const char* name :
       {"Mono8", "Mono12", "Mono12p", "BayerRG8", "BayerGB10", "BayerBG12p", "RGB8", "YUV422_8"}) {
    for (const auto& [width, height] : {std::pair{2, 1}, {2, 2}, {34, 9}, {130, 65}}) {
      const RawFormat format = *RawFormatFromName(name);
      std::vector<uint8_t> content(RawBytes(format, width, height));
      for (size_t i = 0; i < content.size(); ++i) {
        state = state * 1664525 + 1013904223;
        content[i] = static_cast<uint8_t>(i / 7 + (state >> 29));
      }
      const RawFrame frame = FrameOf(format, width, height, content);
      const auto packed = EncodeFrame(frame, 1);
      ASSERT_TRUE(packed.ok());
      const auto back = DecodeFrameBytes(**packed, format, width, content.size());
      ASSERT_TRUE(back.ok()) << name << " " << width << " " << back.status();
      EXPECT_EQ(std::vector<uint8_t>((*back)->data(), (*back)->data() + (*back)->size()), content) << name;
    }
  }
}

TEST(FrameCodec, MakesSmoothImagesSmallAndFindsForeignBytes) {
  std::vector<uint8_t> content(200 * 100);
  for (size_t i = 0; i < content.size(); ++i) content[i] = static_cast<uint8_t>(i % 200 / 2 + (i % 2) * 90);
  const auto packed = EncodeFrame(FrameOf(RawFormat::kBayerRg8, 200, 100, content), 1);
  ASSERT_TRUE(packed.ok());
  EXPECT_LT((*packed)->size(), content.size() / 4);
  EXPECT_EQ(DecodeFrameBytes(**packed, RawFormat::kBayerRg8, 200, content.size() + 1).status().code(),
            absl::StatusCode::kDataLoss);
  (*packed)->data()[(*packed)->size() / 2] ^= 0x55;
  (*packed)->Shrink((*packed)->size() - 1);
  EXPECT_EQ(DecodeFrameBytes(**packed, RawFormat::kBayerRg8, 200, content.size()).status().code(),
            absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace weft
