#include "capture/take/picture_copies.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(PictureCopies, AreKnownByTheNamesThatProgramsGive) {
  for (const char* name : {"c01 (1)", "c01(12)", "c01 - Copy", "c01 - Copy (2)", "c01 copy", "c01 copy 2",
                           "c01_copy", "Copy of c01", "c01 - Kopie"})
    EXPECT_EQ(OriginalOfCopy(name), "c01") << name;
  for (const char* name : {"c01", "c01 1", "(1)", "c (a)", "copy", "photocopy", "c01 ()", ""})
    EXPECT_EQ(OriginalOfCopy(name), "") << name;
}

}  // namespace
}  // namespace weft
