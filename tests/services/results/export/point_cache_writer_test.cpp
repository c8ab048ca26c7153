// MDD and PC2, byte by byte as their readers take them.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "tests/services/results/export/small_result.h"

namespace weft {
namespace {

// Of 32 bits, the most significant byte first.
uint32_t BigEndianAt(const std::string& bytes, size_t offset) {
  uint32_t value = 0;
  for (size_t i = offset; i < offset + 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes.at(i));
  return value;
}

float BigEndianFloatAt(const std::string& bytes, size_t offset) {
  return std::bit_cast<float>(BigEndianAt(bytes, offset));
}

TEST(PointCacheWriterTest, MddCountsFramesAndPointsThenHasTimesThenPoints) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kMdd, {});
  const auto writer = MakeMddWriter(plan);
  const std::string bytes = Written(*writer, plan, result.folder / "garment.mdd");
  constexpr size_t kTimes = 8, kPoints = kTimes + 3 * 4, kFrame = 4 * 3 * 4;
  ASSERT_EQ(bytes.size(), kPoints + 3 * kFrame);
  EXPECT_EQ(bytes.size(), writer->MaxFileBytes());
  EXPECT_EQ(BigEndianAt(bytes, 0), 3u);
  EXPECT_EQ(BigEndianAt(bytes, 4), 4u);
  EXPECT_EQ(BigEndianFloatAt(bytes, kTimes), 0);
  EXPECT_EQ(BigEndianFloatAt(bytes, kTimes + 4), 0.1F);
  EXPECT_EQ(BigEndianFloatAt(bytes, kTimes + 8), 0.2F);
  // The third vertex of the last frame.
  const size_t vertex = kPoints + 2 * kFrame + 2 * 12;
  EXPECT_EQ(BigEndianFloatAt(bytes, vertex), 100);
  EXPECT_EQ(BigEndianFloatAt(bytes, vertex + 4), 50);
  EXPECT_EQ(BigEndianFloatAt(bytes, vertex + 8), 20);
}

TEST(PointCacheWriterTest, Pc2HasItsHeadOf32BytesThenPointsInTheMachinesOrder) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kPc2, {});
  const auto writer = MakePc2Writer(plan);
  const std::string bytes = Written(*writer, plan, result.folder / "garment.pc2");
  constexpr size_t kHead = 32, kFrame = 4 * 3 * 4;
  ASSERT_EQ(bytes.size(), kHead + 3 * kFrame);
  EXPECT_EQ(bytes.size(), writer->MaxFileBytes());
  EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
  EXPECT_EQ(ValueAt<int32_t>(bytes, 12), 1);  // version
  EXPECT_EQ(ValueAt<int32_t>(bytes, 16), 4);  // points
  EXPECT_EQ(ValueAt<float>(bytes, 20), 0);    // first frame
  EXPECT_EQ(ValueAt<float>(bytes, 24), 1);    // samples a frame
  EXPECT_EQ(ValueAt<int32_t>(bytes, 28), 3);  // samples
  EXPECT_EQ(ValueAt<float>(bytes, kHead + 12), 100);
  EXPECT_EQ(ValueAt<float>(bytes, kHead + kFrame + 8), 10);
}

TEST(PointCacheWriterTest, BothHoldTheSamePoints) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kMdd, {});
  const std::string mdd = Written(*MakeMddWriter(plan), plan, result.folder / "a");
  const std::string pc2 = Written(*MakePc2Writer(plan), plan, result.folder / "b");
  constexpr size_t kMddHead = 8 + 3 * 4, kPc2Head = 32;
  ASSERT_EQ(mdd.size() - kMddHead, pc2.size() - kPc2Head);
  for (size_t i = 0; i + kPc2Head < pc2.size(); i += 4)
    EXPECT_EQ(BigEndianAt(mdd, kMddHead + i), ValueAt<uint32_t>(pc2, kPc2Head + i)) << i;
}

}  // namespace
}  // namespace weft
