#include "capture/camera/frame_count.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(BlockIdUnwrapper, CountsOnWhereIdsOf16BitsBeginAnew) {
  BlockIdUnwrapper unwrapper;
  uint64_t expected = 60000;
  for (uint64_t n = 0; n < 200'000; ++n, ++expected)
    ASSERT_EQ(unwrapper.Unwrap((expected - 1) % 65535 + 1), expected);
}

TEST(BlockIdUnwrapper, KeepsTheDistanceOverMissingBlocks) {
  BlockIdUnwrapper unwrapper;
  EXPECT_EQ(unwrapper.Unwrap(65530), 65530u);
  EXPECT_EQ(unwrapper.Unwrap(4), 65539u);  // 65535 is followed by 1
  EXPECT_EQ(unwrapper.Unwrap(32004), 97539u);
}

TEST(BlockIdUnwrapper, TakesIdsOf64BitsAsTheyAre) {
  BlockIdUnwrapper unwrapper;
  for (uint64_t id : {65534ull, 65535ull, 65536ull, 65537ull, 5'000'000'000ull})
    EXPECT_EQ(unwrapper.Unwrap(id), id);
}

TEST(BlockIdUnwrapper, BeginsAnewAfterReset) {
  BlockIdUnwrapper unwrapper;
  unwrapper.Unwrap(60000);
  unwrapper.Reset();
  EXPECT_EQ(unwrapper.Unwrap(1), 1u);
}

TEST(SequenceUnwrapper, CountsOnWhere32BitsBeginAnew) {
  SequenceUnwrapper unwrapper;
  EXPECT_EQ(unwrapper.Unwrap(0xfffffffe), 0xfffffffeu);
  EXPECT_EQ(unwrapper.Unwrap(1), 0x100000001u);
  EXPECT_EQ(unwrapper.Unwrap(2), 0x100000002u);
  unwrapper.Reset();
  EXPECT_EQ(unwrapper.Unwrap(7), 7u);
}

}  // namespace
}  // namespace weft
