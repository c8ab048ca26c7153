#include "capture/camera/action_command.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::ElementsAre;

// Byte by byte as GigE Vision 2.0 lays the command out.
TEST(ActionPacket, NamesKeysAndTime) {
  ActionCommand command{0x01020304, 0x05060708, 0x0000000f, {}};
  EXPECT_THAT(ActionPacket(command, 0x1234),
              ElementsAre(0x42, 0, 0x01, 0x00, 0, 12, 0x12, 0x34, 1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0x0f));
  command.device_time_ns = 0x0102030405060708;
  EXPECT_THAT(ActionPacket(command, 1), ElementsAre(0x42, 0x80, 0x01, 0x00, 0, 20, 0, 1, 1, 2, 3, 4, 5, 6, 7,
                                                    8, 0, 0, 0, 0x0f, 1, 2, 3, 4, 5, 6, 7, 8));
}

TEST(ActionSender, RefusesWhatIsNoAddress) {
  absl::StatusOr<ActionSender> sender = ActionSender::Open();
  ASSERT_TRUE(sender.ok());
  EXPECT_EQ(sender->Send({}, "left").message(), "\"left\" is no IPv4 address");
}

}  // namespace
}  // namespace weft
