// WatchJob: news without polling, watchers that leave, a daemon that stops.
#include <atomic>
#include <thread>

#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST_F(DaemonTest, AJobThatHasEndedIsToldOnceWithAllItsFrames) {
  StartDaemon();
  const std::string id = Submit({"a", "b"});
  WaitForEnd(id);
  int updates = 0;
  v1::JobUpdate last;
  ASSERT_TRUE(client_
                  ->Watch(id,
                          [&](const v1::JobUpdate& update) {
                            ++updates;
                            last = update;
                          })
                  .ok());
  EXPECT_EQ(updates, 1);
  EXPECT_EQ(last.job().state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(last.frames_size(), 2);
}

TEST_F(DaemonTest, EveryWatcherSeesTheEnd) {
  StartDaemon();
  const std::string id = Submit({"a", "slow", "b"});
  std::atomic<int> saw_end = 0;
  std::vector<std::thread> watchers;
  for (int i = 0; i < 8; ++i) {
    watchers.emplace_back([&] {
      const auto job = client_->Watch(id, {});
      if (job.ok() && job->state() == v1::JOB_STATE_DONE) ++saw_end;
    });
  }
  for (std::thread& watcher : watchers) watcher.join();
  EXPECT_EQ(saw_end, 8);
}

TEST_F(DaemonTest, WatchersThatLeaveMakeRoomForOthers) {
  StartDaemon();
  const std::string id = Submit({"hang"});
  // More than may watch at the same time.
  for (int i = 0; i < 300; ++i) {
    WatchUntil(id, [](const v1::JobUpdate&) { return true; });
  }
  ASSERT_TRUE(client_->Cancel(id).ok());
  EXPECT_EQ(WaitForEnd(id).state(), v1::JOB_STATE_CANCELLED);
}

TEST_F(DaemonTest, SendsLongJobsInPieces) {
  std::vector<std::string> names;
  for (int i = 0; i < 2500; ++i) names.push_back("f" + std::to_string(i));
  StartDaemon();
  const std::string hanging = Submit({"hang"}, "one");
  const std::string id = Submit(names, "two");
  ASSERT_TRUE(client_->Cancel(id).ok());
  int updates = 0;
  size_t frames = 0;
  std::stop_source stop;
  const auto job = client_->Watch(
      id,
      [&](const v1::JobUpdate& update) {
        frames += static_cast<size_t>(update.frames_size());
        if (++updates > 10) stop.request_stop();
      },
      stop.get_token());
  ASSERT_TRUE(job.ok()) << "the same again and again: " << job.status();
  EXPECT_EQ(frames, names.size());
  EXPECT_EQ(updates, 3);
}

TEST_F(DaemonTest, StoppingEndsWatchersAndSaysThatTheJobGoesOn) {
  StartDaemon();
  const std::string id = Submit({"hang"});
  std::thread stopper;
  const auto job = client_->Watch(id, [&](const v1::JobUpdate& update) {
    if (update.job().frames().running() == 1 && !stopper.joinable()) {
      stopper = std::thread([this] { daemon_->Stop(); });
    }
  });
  stopper.join();
  EXPECT_EQ(job.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(job.status().message()), HasSubstr("shutting down"));
  EXPECT_THAT(std::string(job.status().message()), HasSubstr("continues when it is started again"));
}

}  // namespace
}  // namespace weft
