#include "capture/gige_camera.h"

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

TEST(GigeCameraOptions, NameTheCameraAndTheFault) {
  GigeCameraOptions options;
  EXPECT_FALSE(options.Validate().ok());
  options.id = "left";
  options.device = "192.168.1.11";
  options.features = {"Width=512", "UserSetSelector=Default=1"};
  EXPECT_TRUE(options.Validate().ok());
  options.features.emplace_back("=3");
  EXPECT_EQ(options.Validate().message(), "camera left: feature \"=3\" is not of the form Name=value");
}

}  // namespace
}  // namespace weft
