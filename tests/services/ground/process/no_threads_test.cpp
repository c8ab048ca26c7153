// What tells that a machine has no further threads, and what does not.
#include "services/ground/process/no_threads.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <system_error>

#include "base/error_reason.h"

namespace weft {
namespace {

TEST(NoThreadsTest, ExceptionsOfThreads) {
  const std::system_error lack(std::make_error_code(std::errc::resource_unavailable_try_again));
  EXPECT_TRUE(IsLackOfThreads(lack));
  EXPECT_FALSE(IsLackOfThreads(std::system_error(std::make_error_code(std::errc::no_space_on_device))));
  EXPECT_FALSE(IsLackOfThreads(std::runtime_error(lack.what())));
}

TEST(NoThreadsTest, ErrorSaysWhatMendsIt) {
  EXPECT_EQ(NoFurtherThreads().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(
      NoFurtherThreads().message(),
      "this machine makes no further threads or processes now (Resource temporarily unavailable); where "
      "that lasts, raise TasksMax= of the service, or `ulimit -u`");
  EXPECT_EQ(ReasonOf(NoFurtherThreads()), ErrorReason::kNoFreeThread);
}

TEST(NoThreadsTest, LastWords) {
  EXPECT_TRUE(IsLackOfThreads(std::string(NoFurtherThreads().message())));
  for (const char* words : {"/usr/lib/weft-pcl: cannot be started (Resource temporarily unavailable)",
                            "libgomp: Thread creation failed: Resource temporarily unavailable",
                            "OpenBLAS blas_thread_init: pthread_create failed for thread 1 of 2: Resource "
                            "temporarily unavailable",
                            "terminate called after throwing an instance of 'std::system_error' |   what():  "
                            "Resource temporarily unavailable",
                            "sh: 1: Cannot fork: Resource temporarily unavailable"})
    EXPECT_TRUE(IsLackOfThreads(words)) << words;
  // A read that would block, and other ends.
  for (const char* words :
       {"[mov] error reading header: Resource temporarily unavailable", "thread 3 crashed", ""})
    EXPECT_FALSE(IsLackOfThreads(words)) << words;
}

}  // namespace
}  // namespace weft
