#include "services/work/animation/driver_memory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace weft {
namespace {

DriverMemory SomeMemory() {
  DriverMemory memory;
  memory.last_ns = 1'764'201'600'123'456'789;  // more digits than a double has
  memory.drive.track.known = 2;
  memory.drive.track.state.root.linear() =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  memory.drive.track.state.root.translation() = Eigen::Vector3d(1.0 / 3, -1e-300, 1e17);
  memory.drive.track.state.z = Eigen::VectorXd::LinSpaced(5, -1, 1 / 7.0);
  memory.drive.track.z_before = Eigen::VectorXd::Constant(5, 0.1);
  memory.drive.track.state.local = Eigen::MatrixXd::Random(3, 2);
  return memory;
}

TEST(DriverMemory, ComesBackBitByBit) {
  const DriverMemory memory = SomeMemory();
  const std::string bytes = EncodeMemory(memory);
  const auto back = DecodeMemory(bytes);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(*back->last_ns, *memory.last_ns);
  EXPECT_EQ(back->drive.track.known, 2);
  EXPECT_EQ(back->drive.track.state.root.matrix(), memory.drive.track.state.root.matrix());
  EXPECT_EQ(back->drive.track.state.z, memory.drive.track.state.z);
  EXPECT_EQ(back->drive.track.z_before, memory.drive.track.z_before);
  EXPECT_EQ(back->drive.track.state.local, memory.drive.track.state.local);
  EXPECT_EQ(EncodeMemory(*back), bytes);
  DriverMemory other = memory;
  other.drive.track.state.z[4] = std::nextafter(other.drive.track.state.z[4], 1);
  EXPECT_NE(MemoryChecksum(EncodeMemory(other)), MemoryChecksum(bytes));
}

TEST(DriverMemory, OfALostGarmentIsItsTimeAlone) {
  DriverMemory memory = SomeMemory();
  memory.drive.track.known = 0;
  const std::string bytes = EncodeMemory(memory);
  EXPECT_EQ(bytes.size(), 16u);
  EXPECT_EQ(*DecodeMemory(bytes)->last_ns, *memory.last_ns);
  EXPECT_EQ(EncodeMemory({}), "");
  EXPECT_FALSE(DecodeMemory("")->last_ns.has_value());
}

TEST(DriverMemory, RefusesOtherBytes) {
  const std::string bytes = EncodeMemory(SomeMemory());
  for (size_t size = 1; size < bytes.size(); ++size)
    EXPECT_FALSE(DecodeMemory(std::string_view(bytes).substr(0, size)).ok()) << size;
  EXPECT_FALSE(DecodeMemory(bytes + "12345678").ok());
  for (const size_t word : {1u, 2u, 3u, 4u}) {
    std::string wrong = bytes;
    for (const int64_t value : {int64_t{-1}, int64_t{1} << 40, INT64_MAX}) {
      std::memcpy(&wrong[8 * word], &value, 8);
      EXPECT_FALSE(DecodeMemory(wrong).ok()) << word << " " << value;
    }
  }
}

}  // namespace
}  // namespace weft
