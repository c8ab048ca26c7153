#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "base/host_clock.h"
#include "capture/take/recorded_take.h"
#include "services/formats/files/json_file.h"
#include "services/server/daemon/studio/take_folder.h"
#include "services/server/daemon/studio/take_store.h"
#include "services/server/rpc/error_detail.h"
#include "services/studio/recorder/recorder_files.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/daemon/captured_log.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class TakeStoreTrashTest : public ::testing::Test {
 protected:
  static TakeStoreOptions OptionsIn(const TempFolder& temp) {
    TakeStoreOptions options;
    options.takes_folder = temp / "takes";
    options.trash_folder = temp / "trash";
    options.looks_folder = temp / "looks";
    options.is_read = [](const std::string& folder) { return folder.find("read") != std::string::npos; };
    return options;
  }
  // A take that has ended.
  void Put(const std::string& id) {
    const RecorderFiles files(temp_ / ("takes/" + id));
    PatternFrames frames({"left"}, 64, 48);
    fs::create_directories(temp_ / ("takes/" + id));
    RecordPattern(files.take, frames);
    v1::RecorderState state;
    state.set_phase(v1::RECORDER_PHASE_ENDED);
    state.set_updated_unix_ns(1'000);
    ASSERT_TRUE(WriteJsonFile(files.request, v1::RecorderRequest()).ok());
    ASSERT_TRUE(WriteJsonFile(files.state, state).ok());
  }

  const TempFolder temp_;
  const CapturedLog log_;
  TakeStore store_{OptionsIn(temp_)};
};

TEST_F(TakeStoreTrashTest, AdoptsATakeOnce) {
  PatternFrames frames({"left", "right"}, 64, 48);
  RecordPattern(temp_ / "made/take", frames);
  v1::Take counted = *ReadTakeFile(temp_ / "made/take");
  counted.set_sets_recorded(4);
  counted.set_sets_dropped(2);
  counted.set_frames_missing(1);
  ASSERT_TRUE(WriteTakeFile(temp_ / "made/take", counted).ok());
  WriteBytes(temp_ / "made/take.adopted/rest", "of one that was killed");
  ASSERT_TRUE(store_.Adopt(temp_ / "made/take", "trimmed-1", "made by operation trimmed-1").ok());
  const absl::StatusOr<v1::RecordedTake> take = store_.Get("trimmed-1");
  ASSERT_TRUE(take.ok()) << take.status();
  v1::RecorderState state = take->state();
  EXPECT_LE(state.updated_unix_ns(), HostTime_ns());
  EXPECT_GT(state.updated_unix_ns(), HostTime_ns() - 60'000'000'000);
  state.clear_updated_unix_ns();
  EXPECT_EQ(state.ShortDebugString(),
            "phase: RECORDER_PHASE_ENDED message: \"made by operation trimmed-1\" sets_recorded: 4 "
            "sets_dropped: 2 frames_missing: 1 disk_minutes_left: -1");
  EXPECT_EQ((*RecordedTake::Open(take->folder()))->sets().size(), 4u);
  EXPECT_FALSE(fs::exists(temp_ / "made/take"));
  EXPECT_FALSE(fs::exists(temp_ / "takes/trimmed-1/rest"));
  // Again, also from the trash, and though it is not where it was.
  EXPECT_TRUE(store_.Adopt(temp_ / "made/take", "trimmed-1", "").ok());
  ASSERT_TRUE(store_.Delete("trimmed-1", "a test").ok());
  EXPECT_TRUE(store_.Adopt(temp_ / "made/take", "trimmed-1", "").ok());
  EXPECT_EQ(store_.Adopt(temp_ / "made/take", "trimmed-2", "").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(store_.Adopt(temp_ / "made/take", "../2", "").code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(TakeStoreTrashTest, ADescriptionGoesIntoTheTakesOwnFile) {
  Put("a-take");
  v1::DescribeTakeRequest request;
  request.set_take_id("a-take");
  request.set_slate("12A");
  request.set_name("walk");
  request.set_notes("wet");
  ASSERT_TRUE(store_.Describe(request).ok());
  const v1::Take take = *ReadTakeFile(temp_ / "takes/a-take/take");
  EXPECT_EQ(take.slate() + " " + take.name() + " " + take.notes(), "12A walk wet");
  WriteBytes(temp_ / "takes/a-take/take/take.json", "{");
  EXPECT_TRUE(store_.Describe(request).ok()) << "the keeping has it";
  EXPECT_EQ(log_.Count("warning take a-take: "), 1);
}

TEST_F(TakeStoreTrashTest, GoesByTheStepsOfRetention) {
  for (const char* id : {"pinned", "read", "young", "old"}) Put(id);
  ASSERT_TRUE(store_.Pin("pinned", true).ok());
  RetentionStep step;
  step.kind = v1::HOLDING_KIND_TAKE;
  step.id = "old";
  step.to_trash = true;
  step.because = "it is old";
  const int64_t before_ns = HostTime_ns();
  ASSERT_TRUE(store_.Carry(step).ok());
  EXPECT_EQ(log_.Count("info take old is in the trash: it is old"), 1);
  // One of an earlier version, that does not say since when.
  fs::create_directories(temp_ / "trash/half");
  WriteBytes(temp_ / "trash/.removed-gone/take", "left");
  const std::vector<Holding> held = store_.Holdings();
  EXPECT_FALSE(fs::exists(temp_ / "trash/.removed-gone"));
  std::map<std::string, Holding> by_id;
  for (const Holding& one : held) by_id[one.id] = one;
  ASSERT_THAT(by_id, SizeIs(5));
  for (const char* id : {"pinned", "read", "young"}) {
    EXPECT_EQ(by_id[id].kind, v1::HOLDING_KIND_TAKE) << id;
    EXPECT_EQ(by_id[id].since_unix_ns, 1'000) << id;
    EXPECT_GT(by_id[id].bytes, 4u * 64 * 48) << id;
    EXPECT_EQ(by_id[id].kept, std::string(id) != "young") << id;
  }
  for (const char* id : {"half", "old"}) {
    EXPECT_EQ(by_id[id].kind, v1::HOLDING_KIND_TRASH) << id;
    EXPECT_GT(by_id[id].since_unix_ns, before_ns - 1'000'000'000) << id;
    EXPECT_FALSE(by_id[id].kept) << id;
  }
  EXPECT_EQ(by_id["half"].bytes, 0u);
  EXPECT_GT(by_id["old"].bytes, 4u * 64 * 48);
  step.kind = v1::HOLDING_KIND_TRASH;
  step.to_trash = false;
  ASSERT_TRUE(store_.Carry(step).ok());
  EXPECT_EQ(log_.Count("info take old is removed for good"), 1);
  EXPECT_FALSE(fs::exists(temp_ / "trash/old"));
  EXPECT_TRUE(fs::exists(temp_ / "trash/half"));
  EXPECT_EQ(store_.Carry(step).message(), "take_id: no take old in the trash; delete it first");
}

TEST_F(TakeStoreTrashTest, TwoOfOneNameAreNotMixed) {
  Put("a-take");
  ASSERT_TRUE(store_.Delete("a-take", "a test").ok());
  Put("a-take");
  const absl::Status refused = store_.Restore("a-take").status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()),
              HasSubstr("take a-take is there, and another of its name in the trash"));
  const absl::StatusOr<v1::EmptyTrashResponse> emptied = store_.EmptyTrash("a-take");
  ASSERT_TRUE(emptied.ok()) << emptied.status();
  EXPECT_EQ(emptied->takes(), 1);
  EXPECT_GT(emptied->bytes(), 4u * 64 * 48);
  EXPECT_TRUE(fs::is_empty(temp_ / "trash"));
  EXPECT_TRUE(store_.Get("a-take").ok());
}

// What a kill between mark and move leaves: a take that is there and says that it was deleted.
TEST_F(TakeStoreTrashTest, RestoringTakesTheMarkAway) {
  Put("a-take");
  ASSERT_TRUE(store_.Delete("a-take", "a test").ok());
  fs::rename(temp_ / "trash/a-take", temp_ / "takes/a-take");
  EXPECT_GT(store_.Get("a-take")->keeping().deleted_unix_ns(), 0);
  const absl::StatusOr<v1::RecordedTake> restored = store_.Restore("a-take");
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(restored->keeping().ShortDebugString(), ReadKeeping(temp_ / "takes/a-take").ShortDebugString());
  EXPECT_EQ(restored->keeping().deleted_unix_ns(), 0);
  EXPECT_EQ(restored->keeping().deleted_because(), "");
}

}  // namespace
}  // namespace weft
