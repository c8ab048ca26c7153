#include "services/studio/video/damage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

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

// As the two fields of a picture have.
TEST(DamagedPictures, PacketsOfOneTimeAreOnePicture) {
  DecodedPictures pictures;
  for (const int64_t pts : {0, 0, 1, 1, 2, 2}) pictures.packets.push_back({pts, pts, pts == 0, false});
  pictures.shown_pts = {0, 1, 2};
  EXPECT_THAT(DamagedBy(pictures, {1}), ElementsAre(1, 2));
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

// Times of which less than nine tenths are those of packets say nothing of which packet is shown.
TEST(DamagedPictures, TimesThatMatchNoPacketsTellNothing) {
  DecodedPictures pictures;
  for (int64_t pts = 0; pts < 20; ++pts) {
    pictures.packets.push_back({pts, pts, true, false});
    pictures.shown_pts.push_back(pts < 2 ? 100 + pts : pts);
  }
  EXPECT_TRUE(LacksPictures(pictures));
  EXPECT_THAT(DamagedBy(pictures, {}), ElementsAre(0, 1));
  pictures.shown_pts[2] = 102;
  EXPECT_FALSE(LacksPictures(pictures));
  EXPECT_THAT(DamagedBy(pictures, {}), IsEmpty());
}

TEST(DamagedPictures, AHoleIsLongerThanOneAndAHalfPeriods) {
  for (const auto& [late, is_hole] : {std::pair{5, false}, std::pair{6, true}}) {
    DecodedPictures pictures;
    for (const int64_t pts : {0, 10, 20, 30, 40 + late, 50 + late, 60 + late}) {
      pictures.packets.push_back({pts, pts, pts == 0, false});
      pictures.shown_pts.push_back(pts);
    }
    const int64_t last = 60 + late;
    const std::vector<int64_t> lost{40 + late, 50 + late, last};
    EXPECT_EQ(DamagedBy(pictures, {}, {last}), is_hole ? lost : std::vector<int64_t>{}) << late;
  }
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

// What each line alone makes of the packet before it.
TEST(ParseDecoderLog, WeighsEveryLineByWhoSaysItAndHowGraveItIs) {
  enum Kind { kNone, kDamaged, kDoubted, kCutOff };
  for (const auto& [line, kind] : std::vector<std::pair<std::string, Kind>>{
           {"[h264 @ 0x1] [error] no frame", kDamaged},
           {"[h264 @ 0x1] [fatal] no frame", kDamaged},
           {"[h264 @ 0x1] [panic] no frame", kDamaged},
           {"[h264 @ 0x1] [warning] no frame", kNone},
           {"[hevc @ 0x1] [error] no frame", kNone},
           {"[h264 @ 0x1] [error] reference count exceeds max", kDoubted},
           {"[h264 @ 0x1] [error] co located POCs unavailable", kDoubted},
           {"[h264 @ 0x1] [error] VUI overread", kNone},
           {"[error] Error while decoding stream #0:0", kDamaged},
           {"[warning] Error while decoding stream #0:0", kNone},
           {"[mov,mp4 @ 0x1] [error] stream 0, offset 0x30: partial file", kCutOff},
           {"[mov,mp4 @ 0x1] [warning] stream 0, offset 0x30: partial file", kNone},
           {"[mov,mp4 @ 0x1] [error] no edit list", kNone},
           {"[matroska @ 0x1] [error] File ended prematurely", kNone},
           {"[h264 @ 0x1 error no frame", kNone},
           {"[h264 @ 0x1] no frame", kNone},
           {"[h264 @ 0x1] [error no frame", kNone},
           {"no frame", kNone}}) {
    const DecoderLog told = ParseDecoderLog(PacketLog(7) + line + "\n", "h264", "mov,mp4");
    EXPECT_EQ(told.damaged_pts.size(), kind == kDamaged ? 1u : 0u) << line;
    EXPECT_EQ(told.doubted_pts.size(), kind == kDoubted ? 1u : 0u) << line;
    EXPECT_EQ(told.complaint.empty(), kind != kDamaged) << line;
    EXPECT_EQ(told.cut.empty(), kind != kCutOff) << line;
    EXPECT_EQ(IsWorthALook(line, "h264", "mov,mp4"), kind != kNone) << line;
    // Before the first packet there is nothing that it could be of.
    const DecoderLog before = ParseDecoderLog(line + "\n" + PacketLog(7), "h264", "mov,mp4");
    EXPECT_THAT(before.damaged_pts, IsEmpty()) << line;
    EXPECT_EQ(before.complaint + before.cut, "") << line;
  }
}

TEST(ParseDecoderLog, KeepsTheFirstComplaintOfEachKind) {
  const DecoderLog told =
      ParseDecoderLog(PacketLog(7) +
                          "[h264 @ 0x1] [error] first\n[h264 @ 0x1] [error] second\n"
                          "[mov @ 0x1] [error] Read error one\n[mov @ 0x1] [error] Read error two\n",
                      "h264", "mov");
  EXPECT_EQ(told.complaint, "first");
  EXPECT_EQ(told.cut, "Read error one");
  // Without words of the decoder the pictures that it marks are damaged all the same.
  const DecoderLog marked = ParseDecoderLog(
      PacketLog(7) + "[warning] a.mp4: corrupt decoded frame in stream 0\n" + FrameLog(5) + FrameLog(6),
      "h264", "mov");
  EXPECT_THAT(marked.damaged_pts, ElementsAre(5));
  EXPECT_EQ(marked.complaint, "a picture is not whole");
}

TEST(ParseDecoderLog, KnowsAPacketByWhenItIsDecodedWhereItDoesNotSayMore) {
  const std::string complaint = "[h264 @ 0x1] [error] no frame\n";
  const auto damaged = [&](const std::string& packet) {
    return ParseDecoderLog("[info] " + packet + "\n" + complaint, "h264", "mov").damaged_pts;
  };
  EXPECT_THAT(damaged("demuxer+ffmpeg -> ist_index:1 type:video pkt_pts:NOPTS pkt_dts:31 x"),
              ElementsAre(31));
  EXPECT_THAT(damaged("demuxer+ffmpeg -> ist_index:1 type:video pkt_pts:29 pkt_dts:31 x"), ElementsAre(29));
  EXPECT_THAT(damaged("demuxer+ffmpeg -> ist_index:1 type:video pkt_pts:NOPTS pkt_dts:NOPTS x"), IsEmpty());
  EXPECT_THAT(damaged("demuxer+ffmpeg -> ist_index:1 type:audio pkt_pts:29 pkt_dts:31 x"), IsEmpty());
  EXPECT_THAT(damaged("muxer <- type:video pkt_pts:29 pkt_dts:31 x"), IsEmpty());
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
