#include "capture/image/aligned_buffer.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(BufferPool, HandsBuffersOutAgain) {
  BufferPool pool(5000, 1);
  auto first = pool.Take();
  EXPECT_EQ(reinterpret_cast<uintptr_t>(first->data()) % kBlockBytes, 0u);
  EXPECT_EQ(first->data()[8191], 0);  // padding
  const uint8_t* where = first->data();
  first.reset();
  EXPECT_EQ(pool.Take()->data(), where);
}

}  // namespace
}  // namespace weft
