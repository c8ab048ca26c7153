#include "capture/take/recorded_take.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/match.h"
#include "capture/take/open_dump.h"
#include "capture/take/recover_take.h"
#include "capture/take/take_files.h"
#include "capture/take/take_writer.h"
#include "tests/capture/pattern_frames.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kWidth_px = 100;  // a payload of two blocks
constexpr int kHeight_px = 61;

PatternFrames ThreeFilmed() { return {{"cam1", "cam2", "cam10"}, kWidth_px, kHeight_px}; }

// A frame set in which the second camera has none.
RawFrameSet WithoutCam2(PatternFrames& cameras, uint64_t number) {
  RawFrameSet set = cameras.Set(number);
  set.frames.erase(set.frames.begin() + 1);
  set.missing.push_back({"cam2", "3 packets lost"});
  return set;
}

// Records the sets 3 to 3 + count; set 5 lacks cam2. Flushes after every second set.
void Record(const std::string& folder, uint64_t count, bool close, bool compress = false, uint64_t take = 77,
            const std::vector<std::string>& descriptions = {}) {
  PatternFrames cameras = ThreeFilmed();
  TakeWriterOptions options;
  options.take = take;
  options.descriptions = descriptions;
  options.stream.compress = compress;
  options.stream.preallocate_bytes = 1 << 20;
  const auto writer = TakeWriter::Create(folder, cameras.camera_ids(), options);
  ASSERT_TRUE(writer.ok()) << writer.status();
  std::vector<LedgerEntry> entries;
  for (uint64_t number = 3; number < 3 + count; ++number) {
    const RawFrameSet set = number == 5 ? WithoutCam2(cameras, number) : cameras.Set(number);
    for (size_t camera = 0; camera < 3; ++camera) ASSERT_TRUE((*writer)->Append(camera, set).ok());
    for (const LedgerEntry& entry : EntriesOfRecorded(set, 1)) entries.push_back(entry);
    if (number % 2 == 0) {
      ASSERT_TRUE((*writer)->Commit(number, entries).ok());
      entries.clear();
    }
  }
  if (close) {
    ASSERT_TRUE((*writer)->Commit(2 + count, entries).ok());
    ASSERT_TRUE((*writer)->Close(2 + count, {}, {}).ok());
  }
}

void ExpectExact(const std::string& folder, uint64_t sets) {
  const PatternFrames cameras = ThreeFilmed();
  const auto take = RecordedTake::Open(folder);
  ASSERT_TRUE(take.ok()) << take.status();
  ASSERT_EQ((*take)->sets().size(), sets);
  for (size_t i = 0; i < sets; ++i) {
    const uint64_t number = 3 + i;
    EXPECT_EQ((*take)->sets()[i], number);
    for (size_t camera = 0; camera < 3; ++camera) {
      const size_t at = camera == 0 ? 0 : camera == 1 ? 1 : 2;  // cam10 after cam2: numbers by value
      const auto frame = (*take)->ReadRaw(i, at);
      if (number == 5 && camera == 1) {
        EXPECT_EQ(frame.status(), absl::NotFoundError("3 packets lost"));
      } else {
        ASSERT_TRUE(frame.ok()) << frame.status();
        EXPECT_TRUE(cameras.IsExact(*frame, camera, number)) << number;
      }
    }
  }
}

std::vector<std::string> Problems(const std::string& folder) {
  const auto check = VerifyTake(folder);
  if (!check.ok()) return {std::string(check.status().message())};
  return check->problems;
}

void Damage(const std::string& file, uint64_t offset_bytes) {
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  stream.seekg(static_cast<std::streamoff>(offset_bytes));
  const char byte = static_cast<char>(stream.get() ^ 1);
  stream.seekp(static_cast<std::streamoff>(offset_bytes));
  stream.put(byte);
}

TEST(RecordedTake, GivesBackEveryByteAndNumber) {
  for (const bool compress : {false, true}) {
    const TempFolder temp;
    Record(temp / "take", 7, /*close=*/true, compress);
    ExpectExact(temp / "take", 7);
    const auto check = VerifyTake(temp / "take");
    ASSERT_TRUE(check.ok());
    EXPECT_THAT(check->problems, IsEmpty());
    EXPECT_EQ(check->sets, 7u);
    EXPECT_EQ(check->frames, 20u);
    EXPECT_EQ(check->missing, 1u);
  }
}

TEST(RecordedTake, IsADumpInTheOrderOfTheRig) {
  const TempFolder temp;
  Record(temp / "take", 4, true);
  Rig rig;
  for (const char* id : {"cam10", "unknown", "cam2"}) {
    CameraModel camera;
    camera.id = id;
    camera.width_px = kWidth_px;
    camera.height_px = kHeight_px + (camera.id == "cam10");
    rig.cameras.push_back(camera);
  }
  const auto dump = OpenDump(temp / "take", rig);
  ASSERT_TRUE(dump.ok()) << dump.status();
  EXPECT_THAT((*dump)->frame_names(), ElementsAre("0003", "0004", "0005", "0006"));
  EXPECT_THAT((*dump)->warnings(),
              ElementsAre(HasSubstr("camera unknown of the rig has no images"),
                          HasSubstr("is not in the rig: cam1; is it the rig of this take?")));
  const auto set = (*dump)->Read(2);
  ASSERT_TRUE(set.ok());
  EXPECT_TRUE(set->frames.empty());
  ASSERT_EQ(set->missing.size(), 3u);
  EXPECT_THAT(set->missing[0].reason, HasSubstr("image is 100x61, the rig says 100x62"));
  EXPECT_EQ(set->missing[2].reason, "3 packets lost");
  PatternFrames cameras = ThreeFilmed();
  const auto view = (*dump)->ReadView(1, 2);
  ASSERT_TRUE(view.ok());
  EXPECT_EQ(view->format, PixelFormat::kBayerRg8);
  EXPECT_EQ(0, std::memcmp(view->pixels->data(), cameras.Frame(1, 4).bytes->data(), view->pixels->size()));
  EXPECT_NE(*(*dump)->Fingerprint(0), *(*dump)->Fingerprint(1));
  EXPECT_EQ((*dump)->Read(4).status().code(), absl::StatusCode::kOutOfRange);
}

TEST(RecordedTake, NeverWritesOverATakeOrInStrangePlaces) {
  const TempFolder temp;
  Record(temp / "take", 1, true);
  EXPECT_EQ(TakeWriter::Create(temp / "take", {"cam1"}, {}).status().code(),
            absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(std::string(TakeWriter::Create(temp / "other", {"../cam"}, {}).status().message()),
              HasSubstr("../cam"));
  EXPECT_FALSE(TakeWriter::Create(temp / "other", {"a", "a"}, {}).ok());
}

std::vector<std::string> Warnings(const std::string& folder) {
  const auto check = VerifyTake(folder);
  return check.ok() ? check->warnings : std::vector<std::string>{std::string(check.status().message())};
}

TEST(VerifyTake, WarnsOfPaddingThatIsNotZero) {
  constexpr uint64_t kDescription_bytes = 5000, kPayload_bytes = uint64_t{kWidth_px} * kHeight_px;
  const TempFolder temp;
  const std::string folder = temp / "take", description(kDescription_bytes, 'd');
  Record(folder, 3, true, false, 77, {description, description, description});
  const std::string stream = StreamFile(StreamFolder(folder), "cam1");
  const uint64_t payload = RecordedTake::Open(folder).value()->Record(1, 0)->offset_bytes + kBlockBytes;
  ASSERT_EQ(payload % kBlockBytes, 0u);
  const auto warning = [&](uint64_t at, const char* more = "") {
    return stream + ": byte " + std::to_string(at) + ": padding is not zero" + more + "; no frame is harmed";
  };
  EXPECT_THAT(Warnings(folder), IsEmpty());
  const uint64_t after_description = kBlockBytes + kDescription_bytes;
  for (const uint64_t at : {after_description, 3 * kBlockBytes - 1, payload + kPayload_bytes,
                            payload + kPayload_bytes + 700, payload + 2 * kBlockBytes - 1}) {
    Damage(stream, at);
    EXPECT_THAT(Warnings(folder), ElementsAre(warning(at)));
    EXPECT_THAT(Problems(folder), IsEmpty());
    Damage(stream, at);  // and back
  }
  for (const uint64_t at : {after_description - 1, payload + kPayload_bytes - 1}) {
    Damage(stream, at);
    EXPECT_THAT(Problems(folder), Not(IsEmpty())) << at;
    Damage(stream, at);
  }
  Damage(stream, after_description);
  Damage(stream, payload + kPayload_bytes);
  EXPECT_THAT(Warnings(folder), ElementsAre(warning(after_description, ", and in 1 place after it")));
  // A stream that is written anew, here for a damaged frame, is padded with zeros.
  Damage(stream, payload - 2 * kBlockBytes - kBlockBytes);
  ASSERT_TRUE(RecoverTake(folder).ok());
  EXPECT_THAT(Problems(folder), IsEmpty());
  EXPECT_THAT(Warnings(folder), IsEmpty());
}

TEST(RecoverTake, BringsBackWhatTheIndexDoesNotKnow) {
  const TempFolder temp;
  const std::string folder = temp / "take";
  Record(folder, 6, /*close=*/false);  // 3 to 8, of which 8 was flushed last
  fs::remove(IndexFile(StreamFolder(folder), "cam10"));
  EXPECT_THAT(RecordedTake::Open(folder).value()->warnings(), Contains(HasSubstr("run `weft take recover")));
  const auto recovery = RecoverTake(folder);
  ASSERT_TRUE(recovery.ok()) << recovery.status();
  EXPECT_EQ(recovery->sets, 6u);
  ExpectExact(folder, 6);
  EXPECT_THAT(Problems(folder), IsEmpty());
  // The reserved room is gone, and nothing is left to do.
  EXPECT_LT(fs::file_size(StreamFile(StreamFolder(folder), "cam1")), 100'000u);
  EXPECT_EQ(RecoverTake(folder)->entries_added, 0u);
}

// Number of frames of a camera that are exact; the others are missing with a reason that says that they are
// lost.
size_t CountExact(const std::string& folder, size_t camera) {
  const PatternFrames cameras = ThreeFilmed();
  const auto take = RecordedTake::Open(folder);
  size_t exact = 0;
  for (size_t i = 0; i < (*take)->sets().size(); ++i) {
    const auto frame = (*take)->ReadRaw(i, camera);
    const bool is_exact = frame.ok() && cameras.IsExact(*frame, camera, (*take)->sets()[i]);
    EXPECT_TRUE(is_exact || absl::StrContains(frame.status().message(), "lost")) << frame.status();
    exact += frame.ok();
  }
  return exact;
}

TEST(RecoverTake, LeavesGapsWhereOneStreamIsCutAtAnyPlace) {
  for (const uint64_t cut_bytes : {0, 100, 4095, 4096, 4097, 9000, 20000, 30000, 41000}) {
    const TempFolder temp;
    const std::string folder = temp / "take";
    Record(folder, 6, true);
    const std::string stream = StreamFile(StreamFolder(folder), "cam2");
    fs::resize_file(stream, fs::file_size(stream) - cut_bytes);
    TakeRecoveryOptions dry;
    dry.dry_run = true;
    const auto plan = RecoverTake(folder, dry);
    const auto recovery = RecoverTake(folder);
    ASSERT_TRUE(plan.ok() && recovery.ok()) << recovery.status();
    EXPECT_EQ(plan->changes, recovery->changes);
    EXPECT_EQ(plan->changes.empty(), cut_bytes == 0);
    EXPECT_EQ(recovery->sets, 6u);
    EXPECT_THAT(Problems(folder), IsEmpty()) << cut_bytes;
    EXPECT_EQ(CountExact(folder, 0), 6u);
    EXPECT_EQ(CountExact(folder, 2), 6u);
    EXPECT_EQ(CountExact(folder, 1) + recovery->frames_lost, 5u);  // set 5 never had one
    EXPECT_THAT(RecoverTake(folder)->changes, IsEmpty());
  }
}

TEST(RecoverTake, PutsAGapInThePlaceOfADamagedFrame) {
  const TempFolder temp;
  const std::string folder = temp / "take";
  Record(folder, 6, true);
  const auto intact = RecordedTake::Open(folder);
  const IndexRecord of_set_4 = *(*intact)->Record(1, 0);
  const std::string stream = StreamFile(StreamFolder(folder), "cam1");
  Damage(stream, of_set_4.offset_bytes + kBlockBytes + 10);
  const std::string damaged = ReadBytes(stream);
  EXPECT_EQ((*intact)->ReadRaw(1, 0).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(Problems(folder), Contains(HasSubstr("the frame of set 4 does not fit its checksum")));
  const auto recovery = RecoverTake(folder);
  ASSERT_TRUE(recovery.ok());
  EXPECT_THAT(recovery->damage, Contains(HasSubstr("camera cam1, byte 16384: the frame of set 4")));
  EXPECT_EQ(recovery->frames_lost, 1u);
  EXPECT_EQ(ReadBytes(recovery->kept_aside + "/cam1.stream"), damaged);
  EXPECT_THAT(Problems(folder), IsEmpty());
  const auto take = RecordedTake::Open(folder);
  EXPECT_EQ((*take)->sets().size(), 6u);
  EXPECT_EQ((*take)->ReadSet(1)->missing[0].reason, "lost: damaged in the stream");
  EXPECT_EQ(CountExact(folder, 0), 5u);
  EXPECT_EQ(CountExact(folder, 2), 6u);
}

TEST(RecoverTake, PutsNothingInThePlaceOfASetThatNoCameraHas) {
  const TempFolder temp;
  const std::string folder = temp / "take";
  Record(folder, 3, true);
  for (const char* id : {"cam1", "cam2", "cam10"})
    fs::resize_file(StreamFile(StreamFolder(folder), id), 4096 * 4);
  const auto recovery = RecoverTake(folder);
  ASSERT_TRUE(recovery.ok());
  EXPECT_EQ(recovery->frames_lost, 3u + 2u);  // set 5 lacked one before
  EXPECT_THAT(Problems(folder), IsEmpty());
  EXPECT_EQ(RecordedTake::Open(folder).value()->sets().size(), 3u);
}

TEST(RecoverTake, AccountsForDroppedSetsWhoseLinesAreGone) {
  const TempFolder temp;
  const std::string folder = temp / "take";
  PatternFrames cameras = ThreeFilmed();
  const auto writer = TakeWriter::Create(folder, cameras.camera_ids(), {});
  ASSERT_TRUE(writer.ok());
  std::vector<LedgerEntry> entries;
  for (const uint64_t number : {3, 4, 7, 8}) {
    const RawFrameSet set = cameras.Set(number);
    for (size_t camera = 0; camera < 3; ++camera) ASSERT_TRUE((*writer)->Append(camera, set).ok());
    for (const LedgerEntry& entry : EntriesOfRecorded(set, 1)) entries.push_back(entry);
  }
  entries.push_back({LedgerEvent::kDropped, 5, 6, 0, 1, "", "disk too slow"});
  ASSERT_TRUE((*writer)->Commit(8, entries).ok());
  ASSERT_TRUE((*writer)->Close(8, {}, {}).ok());
  fs::remove(LedgerFile(folder));
  TakeRecoveryOptions options;
  options.sets_dropped = 2;
  const auto recovery = RecoverTake(folder, options);
  ASSERT_TRUE(recovery.ok()) << recovery.status();
  EXPECT_EQ(recovery->dropped, 2u);
  EXPECT_EQ(VerifyTake(folder)->dropped, 2u);
  EXPECT_THAT(Problems(folder), IsEmpty());
}

TEST(RecoverTake, IgnoresChunksOfAnotherTake) {
  const TempFolder temp;
  Record(temp / "old", 6, true, false, 76);
  Record(temp / "new", 3, true);
  // What an unlucky file system may show behind the end of a file.
  const std::string stream = StreamFile(StreamFolder(temp / "new"), "cam1");
  const std::string old = ReadBytes(StreamFile(StreamFolder(temp / "old"), "cam1"));
  const std::string own = ReadBytes(stream);
  WriteBytes(stream, own + old.substr(own.size()));
  ASSERT_TRUE(RecoverTake(temp / "new").ok());
  ExpectExact(temp / "new", 3);
}

TEST(RecoverTake, LeavesATakeAloneThatIsBeingRecorded) {
  const TempFolder temp;
  const auto writer = TakeWriter::Create(temp / "take", {"cam1"}, {});
  ASSERT_TRUE(writer.ok());
  EXPECT_EQ(RecoverTake(temp / "take").status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(RecoverTake(temp / "nothing").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
