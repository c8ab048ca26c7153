#include "services/ground/process/descriptor_limit.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace weft {
namespace {

TEST(DescriptorLimit, IsRaisedToTheHardOne) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit low = before;
  low.rlim_cur = 100;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
  EXPECT_EQ(DescriptorLimit(), 100);
  EXPECT_EQ(static_cast<rlim_t>(RaiseDescriptorLimit()), before.rlim_max);
  EXPECT_EQ(static_cast<rlim_t>(DescriptorLimit()), before.rlim_max);
  setrlimit(RLIMIT_NOFILE, &before);
}

}  // namespace
}  // namespace weft
