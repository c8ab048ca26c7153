#include "capture/take/take_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

ChunkHeader ChunkOfPicture() {
  ChunkHeader header;
  header.take = 0x0123456789abcdef;
  header.sequence = 7;
  header.set = 42;
  header.device_time_ns = -5;
  header.host_time_ns = 1'700'000'000'000'000'000;
  header.device_frame_id = 99;
  header.width_px = 64;
  header.height_px = 48;
  header.frame_bytes = header.payload_bytes = 64 * 48;
  header.checksum = 0xfedcba9876543210;
  return header;
}

Block BlockOf(const auto& record) {
  Block block;
  WriteBlock(record, block.data());
  return block;
}

std::string ChunkFault(const ChunkHeader& header) {
  return std::string(ReadChunkHeader(BlockOf(header).data()).status().message());
}

TEST(TakeFormat, AChunksHeaderComesBack) {
  const ChunkHeader written = ChunkOfPicture();
  const auto read = ReadChunkHeader(BlockOf(written).data());
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->take, written.take);
  EXPECT_EQ(read->sequence, 7u);
  EXPECT_EQ(read->set, 42u);
  EXPECT_EQ(read->device_time_ns, -5);
  EXPECT_EQ(read->host_time_ns, written.host_time_ns);
  EXPECT_EQ(read->device_frame_id, 99u);
  EXPECT_EQ(read->width_px, 64);
  EXPECT_EQ(read->height_px, 48);
  EXPECT_EQ(read->checksum, written.checksum);
  EXPECT_EQ(written.size_in_stream(), kBlockBytes + PaddedBytes(64 * 48));
}

TEST(TakeFormat, NoFlippedBitOfABlockIsTakenForContent) {
  const Block whole = BlockOf(ChunkOfPicture());
  for (size_t i = 0; i < whole.size(); ++i) {
    Block damaged = whole;
    damaged[i] ^= 1;
    EXPECT_EQ(ReadChunkHeader(damaged.data()).status().code(), absl::StatusCode::kInvalidArgument) << i;
  }
}

TEST(TakeFormat, ChunksWhoseSizesDoNotFitAreRefused) {
  EXPECT_EQ(ChunkFault(ChunkOfPicture()), "");
  ChunkHeader header = ChunkOfPicture();
  header.payload_bytes += 1;
  EXPECT_THAT(ChunkFault(header), HasSubstr("impossible payload size"));
  header.codec = PayloadCodec::kPlanesZstd;  // which may be larger than the frame
  EXPECT_EQ(ChunkFault(header), "");
  header.frame_bytes -= 1;
  EXPECT_THAT(ChunkFault(header), HasSubstr("impossible frame size"));
  header = ChunkOfPicture();
  header.width_px = 0;
  EXPECT_THAT(ChunkFault(header), HasSubstr("impossible image size"));
  header = ChunkOfPicture();
  header.codec = PayloadCodec::kMissing;
  EXPECT_THAT(ChunkFault(header), HasSubstr("impossible size"));
  header = ChunkOfPicture();
  header.codec = static_cast<PayloadCodec>(3);
  EXPECT_THAT(ChunkFault(header), HasSubstr("impossible codec"));
  header = ChunkOfPicture();
  header.format = static_cast<RawFormat>(1);
  EXPECT_THAT(ChunkFault(header), HasSubstr("impossible pixel format"));
}

TEST(TakeFormat, AMissingFrameKeepsItsReasonUpToALimit) {
  ChunkHeader header;
  header.codec = PayloadCodec::kMissing;
  header.reason = "3 packets lost";
  EXPECT_EQ(ReadChunkHeader(BlockOf(header).data())->reason, "3 packets lost");
  header.reason = std::string(kMaxReasonBytes, 'a') + "b";
  EXPECT_EQ(ReadChunkHeader(BlockOf(header).data())->reason, std::string(kMaxReasonBytes, 'a'));
}

TEST(TakeFormat, AStreamsHeaderIsFollowedByItsDescription) {
  StreamHeader header;
  header.take = 17;
  header.camera_id = "c01";
  header.description = std::string(kBlockBytes + 1, 'd');
  const std::string bytes = HeaderBytes(header);
  EXPECT_EQ(bytes.size(), 3 * kBlockBytes);
  EXPECT_EQ(bytes.size(), header.size_in_stream());
  EXPECT_EQ(bytes.substr(kBlockBytes, kBlockBytes + 1), header.description);
  EXPECT_EQ(bytes.find_first_not_of('\0', 2 * kBlockBytes + 1), std::string::npos);
  const auto read = ReadStreamHeader(reinterpret_cast<const uint8_t*>(bytes.data()));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->header.take, 17u);
  EXPECT_EQ(read->header.camera_id, "c01");
  EXPECT_EQ(read->description_bytes, kBlockBytes + 1);
}

TEST(TakeFormat, StreamsOfLaterVersionsAreNamedAndEarlierOnesRead) {
  StreamHeader header;
  header.camera_id = "c01";
  header.version = 1;
  const auto first = ReadStreamHeader(BlockOf(header).data());
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->description_bytes, 0u);
  header.version = 3;
  EXPECT_EQ(ReadStreamHeader(BlockOf(header).data()).status().message(),
            "stream header of version 3; this program reads up to version 2");
  header.version = 2;
  header.camera_id = "../c01";
  EXPECT_THAT(std::string(ReadStreamHeader(BlockOf(header).data()).status().message()), HasSubstr("../c01"));
}

TEST(TakeFormat, TheEndSaysHowItWent) {
  const StreamEnd end = {.take = 1,
                         .chunks = 2,
                         .last_set = 3,
                         .ended_host_time_ns = 4,
                         .outcome = TakeOutcome::kStopped,
                         .sets_recorded = 5,
                         .sets_dropped = 6,
                         .frames_missing = 7,
                         .cause = "disk full"};
  const Block block = BlockOf(end);
  EXPECT_EQ(*ReadStreamEnd(block.data()), end);
  EXPECT_TRUE(BeginsLikeEnd(block.data()));
  EXPECT_FALSE(BeginsLikeChunk(block.data()));
  EXPECT_TRUE(BeginsLikeChunk(BlockOf(ChunkOfPicture()).data()));
  EXPECT_EQ(ReadChunkHeader(block.data()).status().message(), "no chunk header");
  StreamEnd odd = end;
  odd.outcome = static_cast<TakeOutcome>(4);
  EXPECT_FALSE(ReadStreamEnd(BlockOf(odd).data()).ok());
}

// Record k of frames that fill two blocks and their header.
IndexRecord RecordAt(uint64_t k) {
  return {.sequence = k,
          .offset_bytes = (1 + 3 * k) * kBlockBytes,
          .set = 10 + k,
          .device_time_ns = 0,
          .host_time_ns = 0,
          .payload_bytes = 2 * kBlockBytes,
          .checksum = k,
          .is_missing = k == 1};
}

std::string IndexOf(const std::vector<IndexRecord>& records) {
  std::string index = IndexHeader(17);
  for (const IndexRecord& record : records) AppendTo(index, record);
  return index;
}

TEST(TakeFormat, AnIndexIsReadUpToWhatACrashLeft) {
  const std::vector<IndexRecord> records = {RecordAt(0), RecordAt(1), RecordAt(2)};
  const std::string whole = IndexOf(records);
  ASSERT_EQ(whole.size(), 4 * kIndexRecordBytes);
  const auto read = ParseIndex(whole);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->take, 17u);
  EXPECT_EQ(read->records, records);
  EXPECT_EQ(read->ignored_bytes, 0u);
  const auto cut = ParseIndex(whole.substr(0, whole.size() - 1));
  EXPECT_EQ(cut->records.size(), 2u);
  EXPECT_EQ(cut->ignored_bytes, kIndexRecordBytes - 1);
  std::string damaged = whole;
  damaged[2 * kIndexRecordBytes + 3] ^= 1;
  EXPECT_EQ(ParseIndex(damaged)->records.size(), 1u);
  EXPECT_EQ(ParseIndex(damaged)->ignored_bytes, 2 * kIndexRecordBytes);
  EXPECT_FALSE(ParseIndex(whole.substr(0, kIndexRecordBytes - 1)).ok());
  EXPECT_FALSE(ParseIndex("").ok());
}

TEST(TakeFormat, RecordsContinueEachOther) {
  const auto kept = [](IndexRecord second) {
    return ParseIndex(IndexOf({RecordAt(0), second}))->records.size();
  };
  EXPECT_EQ(kept(RecordAt(1)), 2u);
  IndexRecord record = RecordAt(1);
  record.set = RecordAt(0).set;
  EXPECT_EQ(kept(record), 1u);
  record = RecordAt(1);
  record.sequence = 0;
  EXPECT_EQ(kept(record), 1u);
  record = RecordAt(1);
  record.offset_bytes -= kBlockBytes;  // within the chunk before
  EXPECT_EQ(kept(record), 1u);
  record = RecordAt(1);
  record.offset_bytes += 1;
  EXPECT_EQ(kept(record), 1u);
}

TEST(TakeFormat, IdsOfCamerasAreNamesOfFiles) {
  for (const char* id : {"c01", "DA1234567-left", "a.b_c", "0"}) EXPECT_TRUE(CheckCameraId(id).ok()) << id;
  EXPECT_TRUE(CheckCameraId(std::string(kMaxCameraIdBytes, 'a')).ok());
  for (const std::string& id : {std::string(), std::string(".hidden"), std::string("a/b"), std::string("a b"),
                                std::string("k\xc3\xa4"), std::string(kMaxCameraIdBytes + 1, 'a')})
    EXPECT_EQ(CheckCameraId(id).code(), absl::StatusCode::kInvalidArgument) << id;
}

}  // namespace
}  // namespace weft
