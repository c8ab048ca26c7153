#include "services/studio/video/video_packets.h"

#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

VideoPacket OnePacket(const std::string& line) {
  const auto packets = ParsePackets(line);
  EXPECT_TRUE(packets.ok()) << packets.status();
  EXPECT_EQ(packets->size(), 1u) << line;
  return packets->size() == 1 ? packets->front() : VideoPacket();
}

TEST(ParsePacketsTest, ReadsTimesAndFlags) {
  const VideoPacket packet = OnePacket("10,5,K__\n");
  EXPECT_EQ(packet.pts, 10);
  EXPECT_EQ(packet.dts, 5);
  EXPECT_TRUE(packet.is_key);
  EXPECT_FALSE(packet.is_hidden);
  EXPECT_TRUE(packet.is_shown_by_itself);
  EXPECT_TRUE(OnePacket("-3,-7,_D_").is_hidden);
  EXPECT_EQ(OnePacket("-3,-7,_D_").pts, -3);
}

TEST(ParsePacketsTest, OneTimeStandsInForTheOther) {
  const VideoPacket shown = OnePacket("20,N/A,___");
  EXPECT_EQ(shown.dts, 20);
  EXPECT_TRUE(shown.is_shown_by_itself);
  const VideoPacket decoded = OnePacket("N/A,30,___");
  EXPECT_EQ(decoded.pts, 30);
  EXPECT_FALSE(decoded.is_shown_by_itself);
  // The same time twice says no more than that it is decoded.
  EXPECT_FALSE(OnePacket("7,7,K__").is_shown_by_itself);
}

TEST(ParsePacketsTest, LeavesOutWhatHasNoTimeAndKeepsTheOrderOfTheFile) {
  const auto packets = ParsePackets("40,0,K__\nN/A,N/A,___\n\nside data,1\n120,40,___\n80,80,___\n");
  ASSERT_TRUE(packets.ok()) << packets.status();
  ASSERT_EQ(packets->size(), 3u);
  EXPECT_EQ((*packets)[0].pts, 40);
  EXPECT_EQ((*packets)[1].pts, 120);
  EXPECT_EQ((*packets)[2].pts, 80);
  EXPECT_TRUE(ParsePackets("")->empty());
}

// Differences of two times must not overflow.
TEST(ParsePacketsTest, TimesBeyondAnyFilmAreNone) {
  EXPECT_EQ(OnePacket("9223372036854775807,1,___").pts, 1);
  EXPECT_EQ(OnePacket("-9223372036854775808,1,___").pts, 1);
  EXPECT_TRUE(ParsePackets("9223372036854775808,99999999999999999999,___")->empty());
  EXPECT_EQ(OnePacket("2305843009213693951,1,___").pts, INT64_MAX / 4);
  EXPECT_EQ(OnePacket("-2305843009213693951,1,___").pts, -(INT64_MAX / 4));
}

}  // namespace
}  // namespace weft
