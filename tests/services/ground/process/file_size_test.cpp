#include "services/ground/process/file_size.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

// 0 where a write beyond a limit of 10 bytes fails with EFBIG.
int WriteBeyondTenBytes(const std::string& path) {
  const rlimit limit = {10, 10};
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT, 0600);
  if (fd < 0 || setrlimit(RLIMIT_FSIZE, &limit) != 0 || write(fd, "0123456789", 10) != 10) return 2;
  return write(fd, "x", 1) < 0 && errno == EFBIG ? 0 : 1;
}

TEST(FileSizeLimit, EndsAProcessUnlessItIsToFail) {
  const TempFolder folder;
  EXPECT_EXIT(
      {
        signal(SIGXFSZ, SIG_DFL);  // whatever started the test may ignore it
        _exit(WriteBeyondTenBytes(folder / "a"));
      },
      ::testing::KilledBySignal(SIGXFSZ), "");
  EXPECT_EXIT(
      {
        FailBeyondFileSize();
        _exit(WriteBeyondTenBytes(folder / "b"));
      },
      ::testing::ExitedWithCode(0), "");
  EXPECT_EQ(ReadBytes(folder / "b"), "0123456789");
}

}  // namespace
}  // namespace weft
