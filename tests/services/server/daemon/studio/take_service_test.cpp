// Takes of a daemon, seen by many. This process stands in for the recorder: it holds the lock and writes the
// state.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <thread>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "capture/take/take_writer.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/unique_fd.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/studio/recorder/recorder_process.h"
#include "services/tools/client/session_client.h"
#include "services/tools/client/take_client.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
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

  grpc::StatusCode Describe(const std::string& id, const std::string& slate, const std::string& notes) {
    v1::DescribeTakeRequest request;
    request.set_take_id(id);
    request.set_slate(slate);
    request.set_notes(notes);
    grpc::ClientContext context;
    v1::RecordedTake take;
    return v1::Takes::NewStub(client_->channel())->DescribeTake(&context, request, &take).error_code();
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

TEST_F(TakeServiceTest, WatchersAreToldOfTheLedgerOnceAndOfLiveRegistration) {
  options_.load_inputs = [](const v1::RegistrationSpec&) { return LoadedInputs{{"0000"}, {}, {}}; };
  const auto writer = TakeWriter::Create(files_.take, {"cam1"}, {});
  ASSERT_TRUE(writer.ok()) << writer.status();
  const auto record = [&writer](uint64_t number) {
    RawFrameSet set;
    set.number = number;
    set.missing = {{"cam1", "no light"}};
    ASSERT_TRUE((*writer)->Append(0, set).ok());
    ASSERT_TRUE((*writer)->Commit(number, EntriesOfRecorded(set, HostTime_ns())).ok());
  };
  StartDaemon();
  record(0);
  v1::SubmitJobRequest request = MakeRequest({});
  request.mutable_spec()->set_dump(files_.take);
  request.mutable_spec()->set_live_every(1);
  const auto job = client_->Submit(request);
  ASSERT_TRUE(job.ok()) << job.status();
  std::vector<std::string> told;
  bool recorded = false;
  TakeClient client(*client_);
  const auto take = client.Watch(id_, [&](const v1::RecordedTake& now) {
    for (const v1::TakeEvent& event : now.events())
      told.push_back(absl::StrCat(event.event(), " ", event.first_set(), "-", event.last_set(), " ",
                                  event.camera(), " ", event.cause()));
    if (now.live().latency_s() == 0 || std::exchange(recorded, true)) return;
    EXPECT_EQ(now.live_job_id(), job->id());
    record(1);
    ASSERT_TRUE((*writer)->Close(1, {}, {}).ok());
    Show(v1::RECORDER_PHASE_ENDED, 2);
    lock_.Close();
  });
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_THAT(told, ElementsAre("missing 0-0 cam1 no light", "missing 1-1 cam1 no light", HasSubstr("end")));
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

TEST_F(TakeServiceTest, OfARecorderThatDiesAreClosedThoughNobodyAsks) {
  StartDaemon();
  lock_.Close();
  v1::RecorderState state;
  do {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ASSERT_TRUE(ReadJsonFile(files_.state, state).ok());
  } while (state.phase() == v1::RECORDER_PHASE_RECORDING);
  EXPECT_EQ(state.phase(), v1::RECORDER_PHASE_RECOVERED);
  EXPECT_THAT(state.message(), HasSubstr("before it recorded anything"));
}

// No file may grow, as on a full disk.
TEST_F(TakeServiceTest, OfARecorderThatDiedIsShownThoughTheDiskIsFull) {
  lock_.Close();
  rlimit before = {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit full = {0, before.rlim_max};
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  const absl::StatusOr<RecorderView> view = RecoverIfDead(folder_of_take_);
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);
  ASSERT_TRUE(view.ok()) << view.status();
  EXPECT_FALSE(view->lives);
  EXPECT_EQ(view->state.phase(), v1::RECORDER_PHASE_RECOVERED);
  // With room the next look writes it down.
  v1::RecorderState state;
  ASSERT_TRUE(ReadJsonFile(files_.state, state).ok());
  EXPECT_EQ(state.phase(), v1::RECORDER_PHASE_RECORDING);
  ASSERT_TRUE(RecoverIfDead(folder_of_take_).ok());
  ASSERT_TRUE(ReadJsonFile(files_.state, state).ok());
  EXPECT_EQ(state.phase(), v1::RECORDER_PHASE_RECOVERED);
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

TEST_F(TakeServiceTest, ASlateAndNotesAreKeptBesideTheTake) {
  StartDaemon();
  TakeClient client(*client_);
  ASSERT_TRUE(client.Pin(id_, true).ok());
  EXPECT_EQ(Describe(id_, "12A take 3", "wind\nfrom the left"), grpc::StatusCode::OK)
      << "while it is recorded";
  daemon_.reset();
  StartDaemon();
  v1::TakeKeeping keeping = TakeClient(*client_).List(0)->takes(0).keeping();
  EXPECT_EQ(keeping.slate(), "12A take 3");
  EXPECT_EQ(keeping.notes(), "wind\nfrom the left");
  EXPECT_TRUE(keeping.pinned());
}

TEST_F(TakeServiceTest, DescriptionsThatCannotBeShownAreRefused) {
  StartDaemon();
  EXPECT_EQ(Describe(id_, std::string(300, 'x'), ""), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Describe(id_, "", std::string(5000, 'x')), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Describe("20260101-000000-11111111", "1", ""), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(TakeClient(*client_).List(0)->takes(0).keeping().slate(), "");
}

TEST_F(TakeServiceTest, AreFoundByWhatIsSaidOfThem) {
  StartDaemon();
  TakeClient client(*client_);
  v1::DescribeTakeRequest request;
  request.set_take_id(id_);
  request.set_slate("12A take 3");
  request.set_name("slow walk");
  ASSERT_TRUE(client.Describe(request).ok());
  request.clear_name();  // stays
  request.set_notes("left sleeve\nis wet");
  const absl::StatusOr<v1::RecordedTake> take = client.Describe(request);
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_EQ(take->keeping().name(), "slow walk");
  EXPECT_EQ(client.List(0, false, "WALK 12a wet")->takes_size(), 1);
  EXPECT_EQ(client.List(0, false, id_)->takes_size(), 1);
  EXPECT_EQ(client.List(0, false, "walk 13")->takes_size(), 0);
  request.set_name("two\nlines");
  EXPECT_EQ(client.Describe(request).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(client.List(0, false, "a\nb").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(TakeServiceTest, GoToTheTrashAndComeBackUnlessTheyAreInUse) {
  StartDaemon();
  TakeClient client(*client_);
  const auto refused = [&](const std::string& why) {
    const absl::Status status = client.Delete(id_).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(status.message()), HasSubstr(why));
  };
  refused("is being recorded");
  Show(v1::RECORDER_PHASE_ENDED, 9);
  lock_.Close();
  ASSERT_TRUE(client.Pin(id_, true).ok());
  refused("is pinned");
  EXPECT_TRUE(client.List(0)->takes(0).keeping().pinned());
  ASSERT_TRUE(client.Pin(id_, false).ok());
  ASSERT_TRUE(client.Delete(id_).ok());
  EXPECT_EQ(client.List(0)->takes_size(), 0);
  ASSERT_EQ(client.List(0, true)->takes_size(), 1);
  EXPECT_EQ(client.List(0, true)->takes(0).state().sets_recorded(), 9);
  EXPECT_THAT(std::string(client.Stop(id_).status().message()), HasSubstr("is in the trash"));
  v1::StartTakeRequest again;
  again.set_idempotency_key(id_);
  EXPECT_EQ(client.Start(again).status().code(), absl::StatusCode::kAlreadyExists);

  ASSERT_TRUE(client.Restore(id_).ok());
  ASSERT_TRUE(client.Restore(id_).ok()) << "may be repeated";
  EXPECT_EQ(client.List(0, true)->takes_size(), 0);
  ASSERT_EQ(client.List(0)->takes_size(), 1);
  EXPECT_EQ(client.List(0)->takes(0).keeping().deleted_unix_ns(), 0);
  EXPECT_EQ(client.EmptyTrash(id_).status().code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(client.Delete(id_).ok());
  // What a removal was at when its daemon was killed.
  const std::string half = absl::StrCat(options_.state_folder, "/trash/.removed-", id_);
  std::filesystem::create_directories(half + "/take");
  ASSERT_EQ(client.List(0, true)->takes_size(), 1);
  const absl::StatusOr<v1::EmptyTrashResponse> emptied = client.EmptyTrash("");
  ASSERT_TRUE(emptied.ok()) << emptied.status();
  EXPECT_EQ(emptied->takes(), 1);
  EXPECT_GT(emptied->bytes(), 0);
  EXPECT_EQ(client.Restore(id_).status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(std::filesystem::is_empty(options_.state_folder + "/trash"));
  for (const char* id : {"../results", "a/b", "."}) {
    EXPECT_EQ(client.Restore(id).status().code(), absl::StatusCode::kInvalidArgument) << id;
    EXPECT_EQ(client.EmptyTrash(id).status().code(), absl::StatusCode::kInvalidArgument) << id;
  }
}

TEST_F(TakeServiceTest, AJobThatReadsATakeKeepsIt) {
  Show(v1::RECORDER_PHASE_ENDED, 9);
  lock_.Close();
  StartDaemon();
  WriteBytes(files_.take, "hang\n");
  TakeClient client(*client_);
  v1::SubmitJobRequest request = MakeRequest({});
  request.mutable_spec()->set_dump(files_.take);
  const absl::StatusOr<v1::Job> job = client_->Submit(request);
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_THAT(std::string(client.Delete(id_).status().message()), HasSubstr("is read by a job"));
  ASSERT_TRUE(client_->Cancel(job->id()).ok());
  EXPECT_TRUE(client.Delete(id_).ok());
}

TEST_F(TakeServiceTest, CamerasOfASessionAreFilmedWithItsLeaseAlone) {
  StartDaemon();
  SessionClient sessions(*client_);
  v1::OpenSessionRequest open;
  v1::SessionCamera& camera = *open.mutable_cameras()->add_cameras();
  camera.set_id("left");
  camera.mutable_gige()->set_device("127.0.0.2");
  open.set_owner("anna");
  open.set_idempotency_key("session-of-anna");
  EXPECT_THAT(std::string(sessions.Open(open).status().message()), HasSubstr("films take " + id_));
  Show(v1::RECORDER_PHASE_ENDED, 9);
  lock_.Close();
  const absl::StatusOr<v1::CaptureSession> session = sessions.Open(open);
  ASSERT_TRUE(session.ok()) << session.status();

  TakeClient client(*client_);
  v1::StartTakeRequest start;
  *start.mutable_recording()->mutable_session() = open.cameras();
  const absl::Status foreign = client.Start(start).status();
  EXPECT_EQ(foreign.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(foreign.message()), HasSubstr("belongs to session session-of-anna of anna"));
  start.set_lease(session->lease());
  EXPECT_EQ(client.Start(start).status().code(), absl::StatusCode::kInvalidArgument)
      << "cameras beside a lease";
  start.mutable_recording()->clear_session();
  start.set_lease(session->lease() + "0");
  EXPECT_EQ(client.Start(start).status().code(), absl::StatusCode::kPermissionDenied);
  start.set_lease(session->lease());
  // As far as the recorder's program, which these tests lack.
  EXPECT_THAT(std::string(client.Start(start).status().message()), HasSubstr("no such program"));
  start.mutable_recording()->set_rig("/etc/passwd");
  EXPECT_EQ(client.Start(start).status().code(), absl::StatusCode::kInvalidArgument)
      << "what the session says";

  ASSERT_TRUE(sessions.Close(session->lease()).ok());
  EXPECT_EQ(sessions.List(10)->sessions(0).state(), v1::CAPTURE_SESSION_STATE_CLOSED);
  open.set_idempotency_key("session-of-anna-2");
  open.set_rig("/etc/passwd");
  EXPECT_EQ(sessions.Open(open).status().code(), absl::StatusCode::kPermissionDenied);
}

}  // namespace
}  // namespace weft
