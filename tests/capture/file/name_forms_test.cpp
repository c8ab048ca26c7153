#include "capture/file/name_forms.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

// "é", and "e" with U+0301 behind it.
constexpr char kComposed[] = "Kam\xc3\xa9ra", kDecomposed[] = "Kame\xcc\x81ra";

TEST(NameForms, ComposesWhatMacOsDecomposes) {
  EXPECT_EQ(ComposedName(kDecomposed), kComposed);
  EXPECT_EQ(ComposedName(kComposed), kComposed);
  EXPECT_EQ(ComposedName("c00"), "c00");
  EXPECT_EQ(ComposedName(""), "");
  EXPECT_EQ(ComposedName("\xff\xfe"), "\xff\xfe");  // no UTF-8
}

TEST(NameForms, CaseAndCompositionMakeNoDifference) {
  EXPECT_EQ(CaselessName("KAME\xcc\x81RA"), CaselessName(kComposed));
  EXPECT_EQ(CaselessName("C00"), "c00");
  EXPECT_NE(CaselessName("C00"), CaselessName("C01"));
  EXPECT_EQ(CaselessName("\xff\xfe"), "\xff\xfe");
}

TEST(NameForms, ZerosBeforeNumbersMakeNoDifference) {
  EXPECT_EQ(NameWithoutZeros("0000"), "0");
  EXPECT_EQ(NameWithoutZeros("0010"), "10");
  EXPECT_EQ(NameWithoutZeros("c01_r0020"), "c1_r20");
  EXPECT_EQ(NameWithoutZeros("c00"), "c0");
  EXPECT_EQ(NameWithoutZeros("007.0500"), "7.0500");  // a fraction
  EXPECT_EQ(NameWithoutZeros("v.01"), "v.1");
  EXPECT_EQ(NameWithoutZeros(""), "");
}

}  // namespace
}  // namespace weft
