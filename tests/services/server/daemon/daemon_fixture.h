// A daemon in this process on a free loopback port, its client, and takes whose frames act.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_join.h"
#include "services/server/daemon/program/daemon.h"
#include "services/tools/client/registration_client.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/daemon/acting_inputs.h"

namespace weft {

class DaemonTest : public ::testing::Test {
 protected:
  DaemonTest() {
    options_.listen = {"127.0.0.1:0"};
    options_.state_folder = folder_ / "state";
    options_.allow_paths = {folder_.path()};
    options_.worker_program = ACTING_WORKER;
    options_.workers = 1;
    options_.threads_per_worker = 1;
    options_.stop_grace = std::chrono::seconds(2);
    options_.load_inputs = LoadActingInputs;
    WriteBytes(folder_ / "rig.json", "{}");
    WriteBytes(folder_ / "board.json", "{}");
    std::filesystem::create_directories(folder_ / "shirt");
  }

  void StartDaemon() {
    absl::StatusOr<std::unique_ptr<Daemon>> daemon = Daemon::Start(options_);
    ASSERT_TRUE(daemon.ok()) << daemon.status();
    daemon_ = *std::move(daemon);
    Connect(daemon_->address());
  }

  void Connect(const std::string& address) {
    absl::StatusOr<std::unique_ptr<RegistrationClient>> client = RegistrationClient::Connect(address);
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
  }

  // A request for these frames, with results in <folder>/<out>.
  v1::SubmitJobRequest MakeRequest(const std::vector<std::string>& frames, const std::string& out = "out") {
    WriteBytes(folder_ / (out + ".take"), absl::StrJoin(frames, "\n"));
    v1::SubmitJobRequest request;
    v1::RegistrationSpec& spec = *request.mutable_spec();
    spec.set_dump(folder_ / (out + ".take"));
    spec.set_rig(folder_ / "rig.json");
    spec.set_board(folder_ / "board.json");
    spec.set_garment(folder_ / "shirt");
    spec.set_out(folder_ / out);
    return request;
  }

  std::string Submit(const std::vector<std::string>& frames, const std::string& out = "out") {
    const absl::StatusOr<v1::Job> job = client_->Submit(MakeRequest(frames, out));
    EXPECT_TRUE(job.ok()) << job.status();
    return job.ok() ? job->id() : "";
  }

  v1::Job WaitForEnd(const std::string& job_id) {
    const absl::StatusOr<v1::Job> job = client_->Watch(job_id, {});
    EXPECT_TRUE(job.ok()) << job.status();
    return job.ok() ? *job : v1::Job();
  }

  // Watches until `reached`, then goes away.
  void WatchUntil(const std::string& job_id, const std::function<bool(const v1::JobUpdate&)>& reached) {
    std::stop_source stop;
    const absl::StatusOr<v1::Job> job = client_->Watch(
        job_id,
        [&](const v1::JobUpdate& update) {
          if (reached(update)) stop.request_stop();
        },
        stop.get_token());
    ASSERT_EQ(job.status().code(), absl::StatusCode::kCancelled) << job.status();
  }
  void WatchUntilRunning(const std::string& job_id) {
    WatchUntil(job_id, [](const v1::JobUpdate& update) { return update.job().frames().running() > 0; });
  }

  std::vector<v1::FrameInfo> Frames(const std::string& job_id) {
    const absl::StatusOr<std::vector<v1::FrameInfo>> frames = client_->Frames(job_id);
    EXPECT_TRUE(frames.ok()) << frames.status();
    return frames.ok() ? *frames : std::vector<v1::FrameInfo>();
  }

  TempFolder folder_;
  DaemonOptions options_;
  std::unique_ptr<Daemon> daemon_;
  std::unique_ptr<RegistrationClient> client_;
};

}  // namespace weft
