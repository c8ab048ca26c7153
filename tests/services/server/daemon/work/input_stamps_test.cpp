#include "services/server/daemon/work/input_stamps.h"

#include <gtest/gtest.h>

#include <ctime>
#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

class InputStampsTest : public ::testing::Test {
 protected:
  InputStampsTest() {
    WriteBytes(folder_ / "rig/rig.json", "{}");
    WriteBytes(folder_ / "rig/beside.bin", "facts");
    WriteBytes(folder_ / "dump/0001/a.png", "pixels");
    // Folders get the time of a change; this one is long before it.
    const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(1);
    fs::last_write_time(folder_ / "dump/0001", long_ago);
    spec_.set_rig(folder_ / "rig/rig.json");
    spec_.set_dump(folder_ / "dump");
  }
  // As if a minute had passed since the files were written.
  InputStamps Stamps() const { return InputStamps::Take(spec_, std::time(nullptr) + 60); }

  TempFolder folder_;
  v1::RegistrationSpec spec_;
};

TEST_F(InputStampsTest, HoldWhileNothingChanges) {
  const InputStamps stamps = Stamps();
  EXPECT_TRUE(stamps.conclusive());
  EXPECT_TRUE(stamps.StillHold());
}

TEST_F(InputStampsTest, SayNothingOfWhatWasJustWritten) {
  EXPECT_FALSE(InputStamps::Take(spec_, std::time(nullptr)).conclusive());
}

TEST_F(InputStampsTest, NoticeAFileThatAnotherOneNames) {
  const InputStamps stamps = Stamps();
  WriteBytes(folder_ / "rig/beside.bin", "other facts");
  EXPECT_FALSE(stamps.StillHold());
}

TEST_F(InputStampsTest, NoticeAnImageThatComes) {
  const InputStamps stamps = Stamps();
  WriteBytes(folder_ / "dump/0001/b.png", "pixels");
  EXPECT_FALSE(stamps.StillHold());
}

TEST_F(InputStampsTest, NoticeWhatIsGone) {
  const InputStamps stamps = Stamps();
  fs::remove(folder_ / "rig/rig.json");
  EXPECT_FALSE(stamps.StillHold());
}

TEST_F(InputStampsTest, AreInconclusiveWhereALinkLeadsElsewhere) {
  fs::create_symlink(folder_ / "rig", folder_ / "dump/0002");
  EXPECT_FALSE(Stamps().conclusive());
}

TEST_F(InputStampsTest, AreInconclusiveWhereAnInputIsMissing) {
  spec_.set_board(folder_ / "board.png");
  EXPECT_FALSE(Stamps().conclusive());
}

}  // namespace
}  // namespace weft
