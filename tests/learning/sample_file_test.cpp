#include "learning/sample_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <stdexcept>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft::learning {
namespace {

using testing::HasSubstr;

template <class T>
void Append(T value, std::string* out) {
  out->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

// Two features and one answer of an image of 2 x 3 with three texels, the last beside a panel; two samples.
std::string SmallFile() {
  std::string out = "weftsmp1";
  for (const uint32_t n : {2, 1, 2, 3, 3}) Append(n, &out);
  for (const uint32_t texel : {0, 4, 5}) Append(texel, &out);
  for (const uint8_t kind : {1, 1, 2}) Append(kind, &out);
  for (const uint32_t split : {0, 1}) {
    for (const uint32_t n : {split, 7u, 30u, 3u}) Append(n, &out);
    for (uint16_t half = 0; half < 9; ++half) Append(static_cast<uint16_t>(0x3c00 + half), &out);
  }
  return out;
}

std::string Refusal(const std::string& bytes) {
  const TempFolder folder;
  const std::string path = folder / "samples.bin";
  WriteBytes(path, bytes);
  try {
    const SampleFile file(path);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(SampleFile, ReadsWhatWasWritten) {
  const TempFolder folder;
  WriteBytes(folder / "samples.bin", SmallFile());
  const SampleFile file(folder / "samples.bin");
  EXPECT_EQ(file.features(), 2);
  EXPECT_EQ(file.answers(), 1);
  EXPECT_EQ(file.height(), 2);
  EXPECT_EQ(file.width(), 3);
  EXPECT_EQ(file.texels(), (std::vector<int64_t>{0, 4, 5}));
  EXPECT_EQ(file.is_panel(), (std::vector<float>{1, 1, 0}));
  ASSERT_EQ(file.size(), 2);
  EXPECT_EQ(file.split(0), Split::kTrain);
  EXPECT_EQ(file.split(1), Split::kValidate);
  EXPECT_EQ(file.cameras(1), 3);
  EXPECT_EQ(static_cast<const uint16_t*>(file.FeaturesOf(1))[1], 0x3c01);
  EXPECT_EQ(static_cast<const uint16_t*>(file.AnswersOf(1))[0], 0x3c06);
}

TEST(SampleFile, RefusesBrokenFilesByName) {
  const std::string good = SmallFile();
  EXPECT_THAT(Refusal("weftsmp2" + good.substr(8)), HasSubstr("samples.bin: is no file of samples"));
  EXPECT_THAT(Refusal(good.substr(0, good.size() - 1)), HasSubstr("ends within a sample"));
  EXPECT_THAT(Refusal(good.substr(0, 35)), HasSubstr("ends within its head"));
  std::string outside = good;
  outside[28 + 8] = 6;  // the last texel
  EXPECT_THAT(Refusal(outside), HasSubstr("outside its image"));
  std::string unknown = good;
  unknown[28 + 3 * 5] = 2;  // the split of the first sample
  EXPECT_THAT(Refusal(unknown), HasSubstr("unknown split"));
  std::string huge = good;
  huge[8 + 4 * 2 + 3] = 0x7f;  // the height
  EXPECT_THAT(Refusal(huge), HasSubstr("makes no sense"));
  EXPECT_THROW(SampleFile("/nowhere/samples.bin"), std::runtime_error);
}

}  // namespace
}  // namespace weft::learning
