#include "services/studio/video/damage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

// Two groups, in the order of decoding: 0 3 1 2 6 4 5, 9 7 8 12 10 11. 7 and 8 are overtaken by the key
// frame 9.
DecodedPictures Groups() {
  DecodedPictures pictures;
  for (const int64_t pts : {0, 3, 1, 2, 6, 4, 5, 9, 7, 8, 12, 10, 11}) {
    pictures.packets.push_back({pts, pts, pts % 9 == 0, false});
    pictures.shown_pts.push_back(pts);
  }
  pictures.unreferenced_pts = {1, 2, 4, 5, 7, 8, 10, 11};
  return pictures;
}

std::vector<int64_t> DamagedBy(const DecodedPictures& pictures, std::vector<int64_t> damaged,
                               std::vector<int64_t> doubted = {}) {
  return DamagedPictures(pictures, {std::move(damaged), std::move(doubted), "", ""});
}

void Lose(DecodedPictures& pictures, int64_t pts) {
  std::erase(pictures.shown_pts, pts);
  std::erase(pictures.unreferenced_pts, pts);  // which is known of shown ones alone
}

void Drop(DecodedPictures& pictures, int64_t pts) {
  std::erase_if(pictures.packets, [&](const VideoPacket& packet) { return packet.pts == pts; });
  Lose(pictures, pts);
}

TEST(DamagedPictures, FollowUpToTheNextKeyFrame) {
  EXPECT_THAT(DamagedBy(Groups(), {}), IsEmpty());
  EXPECT_THAT(DamagedBy(Groups(), {6}), ElementsAre(4, 5, 6, 7, 8));
  EXPECT_THAT(DamagedBy(Groups(), {0}), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(DamagedBy(Groups(), {12}), ElementsAre(10, 11, 12));
}

TEST(DamagedPictures, AreAloneWhereNothingFollowsFromThem) {
  EXPECT_THAT(DamagedBy(Groups(), {1}), ElementsAre(1));
  EXPECT_THAT(DamagedBy(Groups(), {7}), ElementsAre(7));
  DecodedPictures all_keys = Groups();
  for (VideoPacket& packet : all_keys.packets) packet.is_key = true;
  EXPECT_THAT(DamagedBy(all_keys, {6}), ElementsAre(6));
}

TEST(DamagedPictures, PicturesThatDoNotComeAreDamaged) {
  DecodedPictures pictures = Groups();
  Lose(pictures, 3);
  EXPECT_THAT(DamagedBy(pictures, {}), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  // Overtaken ones do not spoil what comes after the key frame.
  pictures = Groups();
  Lose(pictures, 7);
  EXPECT_THAT(DamagedBy(pictures, {}), ElementsAre(7, 8));
  // A picture that an edit list hides is not missing; what follows from it is.
  pictures = Groups();
  pictures.packets[1].is_hidden = true;
  Lose(pictures, 3);
  EXPECT_THAT(DamagedBy(pictures, {}), IsEmpty());
  EXPECT_THAT(DamagedBy(pictures, {3}), ElementsAre(1, 2, 4, 5, 6, 7, 8));
}

TEST(DamagedPictures, AFilmThatBeginsBetweenKeyFrames) {
  DecodedPictures pictures = Groups();
  Drop(pictures, 0);
  EXPECT_THAT(DamagedBy(pictures, {}), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
}

TEST(DamagedPictures, APacketThatIsGoneLeavesAHole) {
  DecodedPictures pictures = Groups();
  Drop(pictures, 3);
  EXPECT_THAT(DamagedBy(pictures, {}), IsEmpty());  // nothing missed it
  // 1 and 2 waited for it, and are decoded after its place.
  EXPECT_THAT(DamagedBy(pictures, {}, {6}), ElementsAre(1, 2, 4, 5, 6, 7, 8));
  pictures = Groups();
  Drop(pictures, 6);
  EXPECT_THAT(DamagedBy(pictures, {}, {5}), ElementsAre(4, 5, 7, 8));
  DecodedPictures in_order;
  for (const int64_t pts : {0, 1, 2, 3, 5, 6, 7}) {
    in_order.packets.push_back({pts, pts, pts == 0, false});
    in_order.shown_pts.push_back(pts);
  }
  EXPECT_THAT(DamagedBy(in_order, {}, {6}), ElementsAre(5, 6, 7));
  // Without a hole the same complaint is none of damage.
  EXPECT_THAT(DamagedBy(Groups(), {}, {6}), IsEmpty());
}

TEST(DamagedPictures, FieldsAndPicturesThatAreSkippedAreNotMissing) {
  DecodedPictures fields;
  for (const int64_t pts : {0, 2, 4, 6}) {
    fields.packets.push_back({pts, pts, pts == 0, false});
    fields.packets.push_back({pts + 1, pts + 1, false, false});
    fields.shown_pts.push_back(pts);
  }
  fields.has_fields = true;
  EXPECT_THAT(DamagedBy(fields, {}), IsEmpty());
  EXPECT_FALSE(LacksPictures(fields));
  Lose(fields, 4);
  EXPECT_TRUE(LacksPictures(fields));
  DecodedPictures skips = Groups();
  Lose(skips, 3);
  skips.skips = true;
  EXPECT_THAT(DamagedBy(skips, {}), IsEmpty());
}

std::string PacketLog(int64_t pts) {
  return absl::StrCat("[info] demuxer+ffmpeg -> ist_index:1 type:video pkt_pts:", pts,
                      " pkt_pts_time:1 pkt_dts:", pts - 2, " pkt_dts_time:0.9 duration:1\n");
}

std::string FrameLog(int64_t pts) {
  return absl::StrCat("[info] decoder -> ist_index:1 type:video frame_pts:", pts,
                      " frame_pts_time:1 best_effort_ts:", pts, " best_effort_ts_time:1 keyframe:0\n");
}

TEST(ParseDecoderLog, TellsWhichPacketIsComplainedOf) {
  const std::string log =
      PacketLog(10) + "[h264 @ 0x55d1] [error] error while decoding MB 0 4, bytestream 734\n" + FrameLog(8) +
      PacketLog(11) + "[warning] a.mp4: corrupt decoded frame in stream 0\n" + FrameLog(10) +
      "[warning] a.mp4: corrupt input packet in stream 0\n" + PacketLog(12) +
      "[error] Error while decoding stream #0:0: Invalid data found\n" + PacketLog(13) +
      "[h264 @ 0x55d1] [error] mmco: unref short failure\n";
  const DecoderLog told = ParseDecoderLog(log, "h264", "mov,mp4");
  EXPECT_THAT(told.damaged_pts, UnorderedElementsAre(10, 10, 12, 12));
  EXPECT_THAT(told.doubted_pts, ElementsAre(13));
  EXPECT_EQ(told.complaint, "error while decoding MB 0 4, bytestream 734");
  EXPECT_TRUE(IsWorthALook(log, "h264", "mov,mp4"));
}

TEST(ParseDecoderLog, DamageOfAFirstByteBeganInThePacketBefore) {
  const std::string log = PacketLog(9) + PacketLog(10) + PacketLog(11) +
                          "[h264 @ 0x55d1] [error] Invalid NAL unit size (1515870513 > 875).\n" + FrameLog(9);
  EXPECT_THAT(ParseDecoderLog(log, "h264", "mov,mp4").damaged_pts, UnorderedElementsAre(10, 11));
  // A packet that ends early is another matter.
  const std::string cut = PacketLog(10) + "[warning] a.mp4: corrupt input packet in stream 0\n" +
                          PacketLog(11) + "[h264 @ 0x55d1] [error] Invalid NAL unit size (381 > 35).\n";
  EXPECT_THAT(ParseDecoderLog(cut, "h264", "mov,mp4").damaged_pts, UnorderedElementsAre(11, 11));
}

TEST(ParseDecoderLog, WhatStandsBesideThePicturesIsNoDamage) {
  const std::string log = PacketLog(10) + "[h264 @ 0x55d1] [error] SEI type 5 size 208 truncated at 168\n" +
                          "[aac @ 0x55d2] [error] channel element 0.0 is not allocated\n" +
                          "[h264 @ 0x55d1] [warning] Increasing reorder buffer to 2\n" + FrameLog(10);
  EXPECT_THAT(ParseDecoderLog(log, "h264", "mov,mp4").damaged_pts, IsEmpty());
  EXPECT_EQ(ParseDecoderLog(log, "h264", "mov,mp4").complaint, "");
  EXPECT_FALSE(IsWorthALook(log, "h264", "mov,mp4"));
}

TEST(ParseDecoderLog, AFileThatWasCutIsNoDamagedPicture) {
  const std::string log =
      PacketLog(10) + FrameLog(10) + "[matroska,webm @ 0x1] [error] File ended prematurely\n";
  const DecoderLog told = ParseDecoderLog(log, "h264", "matroska,webm");
  EXPECT_THAT(told.damaged_pts, IsEmpty());
  EXPECT_EQ(told.cut, "File ended prematurely");
}

TEST(ParsePackets, ReadsTimesAndFlags) {
  const auto packets = ParsePackets("0,-1024,K_\n1536,-512,__\nN/A,7,_D\nN/A,N/A,__\n\nnonsense\n");
  ASSERT_TRUE(packets.ok()) << packets.status();
  ASSERT_EQ(packets->size(), 3u);
  EXPECT_TRUE((*packets)[0].is_key);
  EXPECT_EQ((*packets)[0].dts, -1024);
  EXPECT_EQ((*packets)[2].pts, 7);
  EXPECT_TRUE((*packets)[2].is_hidden);
}

}  // namespace
}  // namespace weft
