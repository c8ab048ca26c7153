#include "services/results/report/paper_table.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

// Halimi et al. 2022, Table 1.
TEST(PaperTable, HasTheFourMethodsOfThePaper) {
  google::protobuf::RepeatedPtrField<v1::PaperMethod> table;
  AddPaperTable(table);
  ASSERT_EQ(table.size(), 4);
  EXPECT_EQ(table[0].drift_mm_s(), 1.5);
  EXPECT_EQ(table[0].geodesic_distortion_mm(), 9.27);
  EXPECT_EQ(table[3].drift_mm_s(), 64.6);
}

}  // namespace
}  // namespace weft
