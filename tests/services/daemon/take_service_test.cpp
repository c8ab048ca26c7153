// Takes of a daemon, seen by many. This process stands in for the recorder: it holds the lock and writes the
// state.
#include <fcntl.h>
#include <sys/file.h>

#include <atomic>
#include <thread>

#include "services/client/take_client.h"
#include "services/files/json_file.h"
#include "services/files/unique_fd.h"
#include "services/recorder/recorder_files.h"
#include "tests/services/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class TakeServiceTest : public DaemonTest {
 protected:
  TakeServiceTest()
      : folder_of_take_(folder_ / "state/takes/20260101-000000-00000000"), files_(folder_of_take_) {
    std::filesystem::create_directories(folder_of_take_);
    v1::RecorderRequest request;
    request.mutable_session()->add_cameras()->mutable_gige()->set_device("127.0.0.2");
    EXPECT_TRUE(WriteJsonFile(files_.request, request).ok());
    Show(v1::RECORDER_PHASE_RECORDING, 1);
    WriteBytes(files_.lock, std::to_string(getpid()));
    lock_ = UniqueFd(open(files_.lock.c_str(), O_RDWR | O_CLOEXEC));
    EXPECT_EQ(flock(lock_.get(), LOCK_EX | LOCK_NB), 0);
  }

  void Show(v1::RecorderPhase phase, uint64_t sets) {
    v1::RecorderState state;
    state.set_phase(phase);
    state.set_sets_recorded(sets);
    ASSERT_TRUE(WriteJsonFile(files_.state, state).ok());
  }

  const std::string id_ = "20260101-000000-00000000";
  const std::string folder_of_take_;
  const RecorderFiles files_;
  UniqueFd lock_;
};

TEST_F(TakeServiceTest, ManyWatchUntilTheTakeEndsOrTheyLeave) {
  StartDaemon();
  constexpr int kWatchers = 30;
  std::atomic<int> begun = 0, ended = 0, left = 0, failed = 0;
  std::stop_source leave;
  std::vector<std::jthread> watchers;
  for (int i = 0; i < kWatchers; ++i) {
    watchers.emplace_back([&, i] {
      // Sanitized gRPC takes seconds for so many.
      const auto connection = RegistrationClient::Connect(daemon_->address(), std::chrono::minutes(1));
      failed += !connection.ok();
      ASSERT_TRUE(connection.ok()) << connection.status();
      TakeClient client(**connection);
      bool first = true;
      const auto take = client.Watch(
          id_, [&](const v1::RecordedTake&) { begun += std::exchange(first, false); },
          i % 2 == 0 ? leave.get_token() : std::stop_token());
      ended += take.ok() && take->state().phase() == v1::RECORDER_PHASE_ENDED &&
               take->state().sets_recorded() == 9;
      left += absl::IsCancelled(take.status());
    });
  }
  while (begun + failed < kWatchers) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  Show(v1::RECORDER_PHASE_RECORDING, 5);
  leave.request_stop();
  Show(v1::RECORDER_PHASE_ENDED, 9);
  lock_.Close();
  watchers.clear();
  EXPECT_EQ(ended + left, kWatchers);
  EXPECT_GE(ended, kWatchers / 2);
}

TEST_F(TakeServiceTest, ADaemonThatStopsEndsWatchersAndNotTheTake) {
  StartDaemon();
  std::atomic<bool> begun = false;
  absl::Status outcome;
  std::jthread watcher([&] {
    TakeClient client(*client_);
    outcome = client.Watch(id_, [&](const v1::RecordedTake&) { begun = true; }).status();
  });
  while (!begun) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  daemon_.reset();
  watcher.join();
  EXPECT_FALSE(outcome.ok());
  v1::RecorderState state;
  ASSERT_TRUE(ReadJsonFile(files_.state, state).ok());
  EXPECT_EQ(state.phase(), v1::RECORDER_PHASE_RECORDING);
}

TEST_F(TakeServiceTest, RefusesCamerasThatFilmAndIdsThatAreNone) {
  StartDaemon();
  TakeClient client(*client_);
  v1::StartTakeRequest request;
  v1::SessionCamera& camera = *request.mutable_recording()->mutable_session()->add_cameras();
  camera.set_id("left");
  camera.mutable_gige()->set_device("127.0.0.2");
  const absl::Status taken = client.Start(request).status();
  EXPECT_EQ(taken.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(taken.message()), HasSubstr("camera 127.0.0.2 films take " + id_));
  for (const char* id : {"", "../results", "a/b", "."}) {
    EXPECT_EQ(client.Stop(id).status().code(), absl::StatusCode::kInvalidArgument) << id;
  }
  EXPECT_EQ(client.Stop("unknown").status().code(), absl::StatusCode::kNotFound);
  request.mutable_recording()->mutable_session()->clear_cameras();
  EXPECT_EQ(client.Start(request).status().code(), absl::StatusCode::kInvalidArgument);

  // A damaged neighbour hides no take.
  std::filesystem::create_directories(folder_ / "state/takes/damaged");
  WriteBytes(folder_ / "state/takes/damaged/request.json", "{");
  const absl::StatusOr<v1::ListTakesResponse> list = client.List(0);
  ASSERT_TRUE(list.ok()) << list.status();
  ASSERT_EQ(list->takes_size(), 1);
  EXPECT_EQ(list->takes(0).id(), id_);
  ASSERT_EQ(list->warnings_size(), 1);
  EXPECT_THAT(list->warnings(0), HasSubstr("damaged"));
}

}  // namespace
}  // namespace weft
