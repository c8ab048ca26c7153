#include "services/ground/process/program_beside.h"

#include <errno.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace weft {
namespace {

TEST(ProgramBeside, IsInThisProgramsFolderWhateverTheWorkingOneIs) {
  const std::filesystem::path self = ProgramBeside(program_invocation_short_name);
  EXPECT_TRUE(self.is_absolute());
  EXPECT_TRUE(std::filesystem::equivalent(self, "/proc/self/exe"));
  EXPECT_EQ(std::filesystem::path(ProgramBeside("weft-other")).parent_path(), self.parent_path());
}

}  // namespace
}  // namespace weft
