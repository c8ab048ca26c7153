#include "capture/take/stream_writer.h"

#include <gtest/gtest.h>
#include <sys/statvfs.h>

#include <cstdint>
#include <limits>

#include "capture/take/take_writer.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

uint64_t FreeBytesOf(const std::string& folder) {
  struct statvfs info {};
  EXPECT_EQ(statvfs(folder.c_str(), &info), 0);
  return static_cast<uint64_t>(info.f_bavail) * info.f_frsize;
}

TEST(StreamWriter, ReservesNothingBelowTheMark) {
  const TempFolder folder;
  StreamWriterOptions options;
  options.keep_free_bytes = std::numeric_limits<uint64_t>::max() / 2;
  const auto writer = StreamWriter::Create(folder.path(), {1, "c01", ""}, options);
  ASSERT_TRUE(writer.ok()) << writer.status();
  EXPECT_EQ((*writer)->spare_bytes(), 0u);
}

TEST(StreamWriter, ReservesASmallShareOfTheRoomAboveTheMark) {
  const TempFolder folder;
  const uint64_t above_bytes = uint64_t{64} << 20, before_bytes = FreeBytesOf(folder.path());
  if (before_bytes < 4 * above_bytes) GTEST_SKIP() << "this disk is nearly full";
  StreamWriterOptions options;
  options.keep_free_bytes = before_bytes - above_bytes;
  options.streams = 4;
  const auto writer = StreamWriter::Create(folder.path(), {1, "c01", ""}, options);
  ASSERT_TRUE(writer.ok()) << writer.status();
  // An eighth of the room for all four streams; other programs use the disk, too.
  EXPECT_LE((*writer)->spare_bytes(), above_bytes / 16);
}

TEST(TakeWriter, CountsWhatItReservedAsFree) {
  const TempFolder folder;
  TakeWriterOptions options;
  options.stream.preallocate_bytes = uint64_t{32} << 20;
  const uint64_t before_bytes = FreeBytesOf(folder.path());
  const auto take = TakeWriter::Create(folder / "take", {"a", "b", "c", "d"}, options);
  ASSERT_TRUE(take.ok()) << take.status();
  const absl::StatusOr<uint64_t> free_bytes = (*take)->FreeBytes();
  ASSERT_TRUE(free_bytes.ok()) << free_bytes.status();
  // Four times 32 MiB are reserved; other programs may write a little meanwhile.
  EXPECT_NEAR(static_cast<double>(*free_bytes), static_cast<double>(before_bytes), 64.0 * (1 << 20));
}

}  // namespace
}  // namespace weft
