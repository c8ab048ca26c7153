// Takes by the real recorder, whose cameras replay a small take.
#include "services/server/daemon/studio/take_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>

#include "capture/take/recorded_take.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/server/daemon/studio/take_folder.h"
#include "services/server/rpc/error_detail.h"
#include "services/studio/recorder/recorder_files.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/daemon/captured_log.h"
#include "tests/services/server/daemon/wait_until.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class TakeStoreTest : public ::testing::Test {
 protected:
  TakeStoreTest() {
    PatternFrames frames({"left", "right"}, 64, 48);
    RecordPattern(temp_ / "replayed", frames);
    options_.takes_folder = temp_ / "takes";
    options_.trash_folder = temp_ / "trash";
    options_.looks_folder = temp_ / "looks";
    options_.recorder_program = WEFT_RECORDER;
    options_.resolve_take = [this](const std::string& field,
                                   const std::string& take) -> absl::StatusOr<std::string> {
      if (take == "take:gone") return absl::NotFoundError(field + ": no such take");
      return take == "take:replayed" ? temp_ / "replayed" : take;
    };
    options_.on_end = [this](const v1::RecordedTake& take) -> absl::Status {
      ++told_;
      return is_full_ ? absl::ResourceExhaustedError("no room for " + take.id()) : absl::OkStatus();
    };
    Restart();
  }
  ~TakeStoreTest() override {
    store_->Stop();
    for (const std::string& id : TakesIn(options_.takes_folder)) store_->Stop(id).IgnoreError();
    WaitUntil([this] { return Living().empty(); });
  }

  void Restart() {
    if (store_) store_->Stop();
    store_ = std::make_unique<TakeStore>(options_);
  }

  // Two cameras that replay the take, `speed` times as fast as it was recorded.
  static v1::Session Cameras(double speed = 1, const std::string& take = "take:replayed") {
    v1::Session session;
    session.set_fps(30);
    for (const char* id : {"left", "right"}) {
      v1::SessionCamera& camera = *session.add_cameras();
      camera.set_id(id);
      camera.mutable_replay()->set_take(take);
      camera.mutable_replay()->set_speed(speed);
    }
    return session;
  }
  static v1::StartTakeRequest Request(const std::string& key, double speed = 1) {
    v1::StartTakeRequest request;
    request.set_idempotency_key(key);
    v1::RecorderRequest& recording = *request.mutable_recording();
    *recording.mutable_session() = Cameras(speed);
    recording.set_no_disk_test(true);
    recording.set_started_by("user anna");
    recording.set_capture_session("monday");
    return request;
  }

  std::vector<std::string> Living() {
    std::vector<std::string> living;
    const v1::ListTakesResponse list = store_->List({}, 100);
    for (const v1::RecordedTake& take : list.takes())
      if (take.recorder_lives()) living.push_back(take.id());
    return living;
  }
  v1::RecordedTake WaitForTake(const std::string& id) {
    absl::StatusOr<v1::RecordedTake> take;
    EXPECT_TRUE(WaitUntil([&] {
      take = store_->Get(id);
      return !take.ok() || !take->recorder_lives();
    }));
    EXPECT_TRUE(take.ok()) << take.status();
    return take.ok() ? *take : v1::RecordedTake();
  }
  // A take that the real recorder has recorded.
  std::string Record(const std::string& key) {
    EXPECT_TRUE(store_->Start(Request(key)).ok());
    EXPECT_EQ(WaitForTake(key).state().phase(), v1::RECORDER_PHASE_ENDED);
    return key;
  }

  const TempFolder temp_;
  const CapturedLog log_;
  TakeStoreOptions options_;
  std::atomic<int> told_ = 0;
  std::atomic<bool> is_full_ = false;
  std::unique_ptr<TakeStore> store_;
};

TEST_F(TakeStoreTest, RecordsATakeAndAnswersARepeatedRequest) {
  const v1::StartTakeRequest request = Request("take-one");
  const absl::StatusOr<v1::RecordedTake> started = store_->Start(request);
  ASSERT_TRUE(started.ok()) << started.status();
  EXPECT_EQ(started->id(), "take-one");
  EXPECT_EQ(started->folder(), temp_ / "takes/take-one/take");
  EXPECT_EQ(started->started_by(), "user anna");
  EXPECT_EQ(started->session_id(), "monday");
  EXPECT_EQ(log_.Count("info take take-one is recorded to " + started->folder()), 1);
  const v1::RecordedTake ended = WaitForTake("take-one");
  EXPECT_EQ(ended.state().phase(), v1::RECORDER_PHASE_ENDED) << ended.state().message();
  EXPECT_GT(ended.state().sets_recorded(), 0u);
  EXPECT_TRUE(RecordedTake::Open(ended.folder()).ok());
  const absl::StatusOr<v1::RecordedTake> again = store_->Start(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->state().sets_recorded(), ended.state().sets_recorded());
  v1::StartTakeRequest other = request;
  other.mutable_recording()->set_seconds(5);
  EXPECT_THAT(std::string(store_->Start(other).status().message()), HasSubstr("take take-one was started"));
  other = request;
  other.mutable_recording()->set_started_by("user ben");
  EXPECT_EQ(store_->Start(other).status().code(), absl::StatusCode::kAlreadyExists);
  other.set_idempotency_key("no key");
  EXPECT_EQ(store_->Start(other).status().code(), absl::StatusCode::kInvalidArgument);
  other.clear_idempotency_key();
  other.mutable_recording()->set_seconds(-1);
  EXPECT_EQ(store_->Start(other).status().message(),
            "seconds: is negative; give 0 to record until it is stopped");
  EXPECT_THAT(TakesIn(options_.takes_folder), ElementsAre("take-one")) << "what did not start is gone";
}

TEST_F(TakeStoreTest, StartsNothingThatItMayNot) {
  v1::StartTakeRequest request = Request("take-one");
  request.mutable_recording()->mutable_session()->mutable_cameras(1)->mutable_replay()->set_take("take:gone");
  EXPECT_EQ(store_->Start(request).status().message(),
            "recording.session.cameras.right.replay.take: no such take");
  options_.admit = [] { return absl::UnavailableError("it drains"); };
  Restart();
  EXPECT_EQ(store_->Start(Request("take-one")).status().message(), "it drains");
  options_.admit = [] { return absl::OkStatus(); };
  options_.recorder_program = temp_ / "none";
  Restart();
  EXPECT_EQ(store_->Start(Request("take-one")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(TakesIn(options_.takes_folder), IsEmpty());
  EXPECT_EQ(store_->Get("take-one").status().message(),
            "no take \"take-one\"; `weft take list` shows the takes");
}

TEST_F(TakeStoreTest, ATakeThatIsReplayedStaysUntilItsReplayIsStopped) {
  Record("take-one");
  v1::StartTakeRequest request = Request("take-two", 0.01);
  *request.mutable_recording()->mutable_session() = Cameras(0.01, temp_ / "takes/take-one/take");
  ASSERT_TRUE(store_->Start(request).ok());
  EXPECT_THAT(Living(), ElementsAre("take-two"));
  EXPECT_THAT(std::string(store_->Delete("take-one", "a test").status().message()),
              HasSubstr("take take-one is read by a job, an operation or a take that replays it"));
  const std::vector<Holding> held = store_->Holdings();
  ASSERT_THAT(held, SizeIs(2));
  EXPECT_TRUE(held[0].kept) << "it is recorded";
  EXPECT_TRUE(held[1].kept) << "it is replayed";
  const absl::StatusOr<v1::RecordedTake> stopped = store_->Stop("take-two");
  ASSERT_TRUE(stopped.ok()) << stopped.status();
  EXPECT_EQ(WaitForTake("take-two").state().phase(), v1::RECORDER_PHASE_ENDED);
  EXPECT_FALSE(store_->Holdings()[0].kept);
  EXPECT_TRUE(store_->Delete("take-one", "a test").ok());
}

TEST_F(TakeStoreTest, TellsOfAnEndOnceItCouldBeTold) {
  is_full_ = true;
  store_->Begin();
  Record("take-one");
  v1::DescribeTakeRequest describe;
  describe.set_take_id("take-one");
  describe.set_slate("12A");
  ASSERT_TRUE(store_->Describe(describe).ok());
  ASSERT_TRUE(WaitUntil([this] { return told_ >= 2; }));
  EXPECT_EQ(log_.Count("warning take take-one: its end is told later: no room for take-one"), 1);
  EXPECT_FALSE(fs::exists(EndToldFile(temp_ / "takes/take-one")));
  is_full_ = false;
  ASSERT_TRUE(WaitUntil([this] { return fs::exists(EndToldFile(temp_ / "takes/take-one")); }));
  const int told = told_;
  Restart();
  // A neighbour that cannot be read is told of, too.
  WriteBytes(temp_ / "takes/take-two/request.json", "{");
  store_->Begin();
  ASSERT_TRUE(WaitUntil([this] { return log_.Count("take-two/request.json") == 1; }));
  EXPECT_EQ(told_, told);
  EXPECT_EQ(ReadTakeFile(temp_ / "takes/take-one/take")->slate(), "12A");
}

TEST_F(TakeStoreTest, FilmsForAMomentAndKeepsNothing) {
  std::string looked_at;
  size_t sets = 0;
  const absl::Status status = store_->FilmBriefly(Cameras(), [&](const std::string& take) {
    looked_at = take;
    const auto opened = RecordedTake::Open(take);
    ASSERT_TRUE(opened.ok()) << opened.status();
    sets = (*opened)->sets().size();
    v1::RecorderRequest request;
    EXPECT_TRUE(ReadJsonFile(fs::path(take).parent_path() / "request.json", request).ok());
    EXPECT_EQ(request.seconds(), 1);
    EXPECT_TRUE(request.no_disk_test());
  });
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_GT(sets, 0u);
  EXPECT_THAT(looked_at, HasSubstr(options_.looks_folder));
  EXPECT_TRUE(fs::is_empty(options_.looks_folder));
  const auto use = [](const std::string&) { ADD_FAILURE() << "there is no take"; };
  EXPECT_EQ(store_->FilmBriefly(Cameras(1, "take:gone"), use).message(),
            "cameras.cameras.left.replay.take: no such take");
  const absl::Status nothing = store_->FilmBriefly(Cameras(1, temp_ / "nothing"), use);
  EXPECT_EQ(nothing.code(), absl::StatusCode::kNotFound) << nothing;
  EXPECT_THAT(std::string(nothing.message()), HasSubstr("camera left: "));
  EXPECT_TRUE(fs::is_empty(options_.looks_folder));
}

// Three frames of slow cameras.
TEST_F(TakeStoreTest, FilmsSlowCamerasForThreeFrames) {
  v1::Session slow = Cameras();
  slow.set_fps(2.5);
  const absl::Status status = store_->FilmBriefly(slow, [](const std::string& take) {
    v1::RecorderRequest request;
    EXPECT_TRUE(ReadJsonFile(fs::path(take).parent_path() / "request.json", request).ok());
    EXPECT_EQ(request.seconds(), 1.2);
  });
  EXPECT_TRUE(status.ok()) << status;
}

TEST_F(TakeStoreTest, RemovesMomentsThatAKilledDaemonLeft) {
  WriteBytes(temp_ / "looks/20260101-000000-00000000/request.json", "{}");
  WriteBytes(temp_ / "looks/20260101-000000-00000001/request.json", "{");
  store_->Begin();
  EXPECT_TRUE(WaitUntil([this] { return fs::is_empty(options_.looks_folder); }));
}

TEST_F(TakeStoreTest, ListsInPagesFromTheTrashToo) {
  for (const char* id : {"take-1", "take-2", "take-3"}) {
    v1::RecorderState state;
    state.set_phase(v1::RECORDER_PHASE_ENDED);
    const RecorderFiles files(options_.takes_folder + "/" + id);
    ASSERT_TRUE(CreateFolders(options_.takes_folder + "/" + id).ok());
    ASSERT_TRUE(WriteJsonFile(files.request, v1::RecorderRequest()).ok());
    ASSERT_TRUE(WriteJsonFile(files.state, state).ok());
  }
  const auto list = [this](v1::ListTakesRequest request, size_t limit) {
    const v1::ListTakesResponse response = store_->List(request, limit);
    std::vector<std::string> ids;
    for (const v1::RecordedTake& take : response.takes()) ids.push_back(take.id());
    ids.push_back("then " + response.next_page_token());
    return ids;
  };
  v1::ListTakesRequest request;
  EXPECT_THAT(list(request, 2), ElementsAre("take-3", "take-2", "then take-2"));
  request.set_page_token("take-2");
  EXPECT_THAT(list(request, 2), ElementsAre("take-1", "then "));
  request.clear_page_token();
  request.set_words("TAKE-1");
  EXPECT_THAT(list(request, 2), ElementsAre("take-1", "then "));
  ASSERT_TRUE(store_->Delete("take-2", "a test").ok());
  request.clear_words();
  EXPECT_THAT(list(request, 3), ElementsAre("take-3", "take-1", "then "));
  request.set_trash(true);
  EXPECT_THAT(list(request, 3), ElementsAre("take-2", "then "));
  const v1::RecordedTake deleted = store_->List(request, 3).takes(0);
  EXPECT_EQ(deleted.folder(), options_.trash_folder + "/take-2/take");
  EXPECT_EQ(deleted.keeping().deleted_because(), "a test");
  WriteBytes(options_.trash_folder + "/take-2/request.json", "{");
  EXPECT_THAT(store_->List(request, 3).warnings(), ElementsAre(HasSubstr("take-2/request.json")));
}

}  // namespace
}  // namespace weft
