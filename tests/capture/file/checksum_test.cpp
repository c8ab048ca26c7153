#include "capture/file/checksum.h"

#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

// XXH3 with 64 bits and seed 0, as its authors publish it; takes that were recorded depend on it.
TEST(Checksum, IsThatOfXxh3) {
  EXPECT_EQ(Checksum("", 0), 0x2d06800538d394c2u);
  EXPECT_EQ(Checksum("a", 1), 0xe6c632b61e964e1fu);
  EXPECT_EQ(Checksum("abc", 3), 0x78af5f94892f3950u);
}

}  // namespace
}  // namespace weft
