#include "services/server/daemon/program/daemon.h"

#include <sys/stat.h>

#include <filesystem>

#include "tests/services/server/access/certificate_maker.h"
#include "tests/services/server/daemon/captured_log.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class DaemonOptionsTest : public ::testing::Test {
 protected:
  // What is said of these options; empty: nothing.
  static std::string Fault(const std::function<void(DaemonOptions&)>& change) {
    DaemonOptions options;
    options.state_folder = "/state";
    change(options);
    const absl::Status status = options.Validate();
    EXPECT_TRUE(status.ok() || absl::IsInvalidArgument(status)) << status;
    return std::string(status.message());
  }
  const TempFolder folder_;
};

TEST_F(DaemonOptionsTest, AreRefusedByTheirNames) {
  EXPECT_EQ(Fault([](DaemonOptions&) {}), "");
  EXPECT_EQ(Fault([](DaemonOptions& options) { options.state_folder = ""; }),
            "--state: must not be empty; give a folder, here or as `state` in the file of --config");
  for (const int good : {0, 1024}) {
    EXPECT_EQ(Fault([&](DaemonOptions& options) { options.workers = good; }), "");
    EXPECT_EQ(Fault([&](DaemonOptions& options) { options.threads_per_worker = good; }), "");
  }
  for (const int bad : {-1, 1025}) {
    EXPECT_EQ(Fault([&](DaemonOptions& options) { options.workers = bad; }),
              absl::StrCat("--workers: ", bad, ", must be 0 to 1024"));
    EXPECT_EQ(Fault([&](DaemonOptions& options) { options.threads_per_worker = bad; }),
              absl::StrCat("--threads-per-worker: ", bad, ", must be 0 to 1024"));
  }
  EXPECT_THAT(Fault([](DaemonOptions& options) {
                options.listen = {"127.0.0.1:1", "7411"};
              }),
              HasSubstr("--listen: \"7411\" is not HOST:PORT"));
  EXPECT_THAT(Fault([](DaemonOptions& options) { options.notices.program = "relative"; }),
              HasSubstr("--on-end-command"));
}

TEST_F(DaemonOptionsTest, AskForTlsWhereOtherMachinesReachIt) {
  const std::string needs_tls =
      "0.0.0.0:1 can be reached from other machines, which needs TLS; give --tls-cert and --tls-key, or "
      "listen "
      "on 127.0.0.1";
  CertificateMaker maker(folder_.path(), "studio");
  const CertificateFiles files = maker.Sign("weftd");
  const TlsFiles tls[] = {{}, {files.certificate, "", "", ""}, {"", files.key, "", ""}};
  for (const TlsFiles& some : tls) {
    EXPECT_EQ(Fault([&](DaemonOptions& options) { options.tls = some, options.listen = {"0.0.0.0:1"}; }),
              "--listen: " + needs_tls);
    EXPECT_EQ(
        Fault([&](DaemonOptions& options) { options.tls = some, options.metrics_listen = "0.0.0.0:1"; }),
        "--metrics: " + needs_tls);
    EXPECT_EQ(
        Fault([&](DaemonOptions& options) {
          options.tls = some, options.listen = {"127.0.0.1:1", "unix:/s"}, options.metrics_listen = "[::1]:1";
        }),
        "");
  }
  EXPECT_EQ(Fault([&](DaemonOptions& options) {
              options.tls = {files.certificate, files.key, "", ""}, options.listen = {"0.0.0.0:1"};
            }),
            "");
  DaemonOptions missing;
  missing.state_folder = "/state";
  missing.listen = {"0.0.0.0:1"};
  missing.tls = {files.certificate, folder_ / "none", "", ""};
  EXPECT_FALSE(missing.Validate().ok());
}

TEST_F(DaemonOptionsTest, WorkersOfAClusterHaveNoUserOfTheirOwn) {
  fs::create_directories(folder_ / "cluster");
  DaemonOptions options;
  options.state_folder = folder_ / "state";
  options.worker_program = "/bin/true";
  options.slurm.folder = folder_ / "cluster";
  ASSERT_TRUE(options.Validate().ok()) << options.Validate();
  options.slurm.frames_per_task = 0;
  EXPECT_FALSE(options.Validate().ok());
  options.slurm.frames_per_task = 16;
  options.worker_user = "nobody";
  EXPECT_EQ(options.Validate().message(),
            "--worker-user: tasks on a cluster run as the daemon's user; leave it out beside --slurm-folder");
  options.slurm.folder = "";
  options.worker_user = "no-such-user-here";
  EXPECT_FALSE(options.Validate().ok());
}

class DaemonStartTest : public DaemonTest {};

TEST_F(DaemonStartTest, TakesItsStateFolderForItself) {
  fs::create_directories(folder_ / "real");
  fs::permissions(folder_ / "real", fs::perms::all);
  fs::create_directory_symlink(folder_ / "real", folder_ / "state");
  WriteBytes(folder_ / "real/tasks/old.1/task.json", "of a daemon that was killed");
  options_.workers = 3;
  options_.threads_per_worker = 2;
  StartDaemon();
  struct stat info = {};
  ASSERT_EQ(stat((folder_ / "real").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0700u);
  EXPECT_FALSE(fs::exists(folder_ / "real/tasks/old.1"));
  const v1::ServerInfo& info_of = client_->info();
  EXPECT_EQ(info_of.state_folder(), fs::canonical(folder_ / "real").string());
  ASSERT_EQ(info_of.allowed_paths_size(), 1);
  EXPECT_EQ(info_of.allowed_paths(0), fs::canonical(folder_.path()).string());
  EXPECT_EQ(info_of.workers(), 3);
  EXPECT_EQ(info_of.threads_per_worker(), 2);
  EXPECT_EQ(daemon_->workers(), 3);
  EXPECT_EQ(daemon_->threads_per_worker(), 2);
  EXPECT_EQ(info_of.jobs_queued() + info_of.jobs_running(), 0);
  const fs::space_info disk = fs::space(folder_ / "real");
  EXPECT_EQ(info_of.disk_total_bytes(), static_cast<int64_t>(disk.capacity));
  EXPECT_GT(info_of.disk_free_bytes(), 0);
  EXPECT_LT(info_of.disk_free_bytes(), info_of.disk_total_bytes());
  EXPECT_EQ(daemon_->metrics_address(), "");
  EXPECT_EQ(daemon_->console_address(), "");
}

TEST_F(DaemonStartTest, TellsOfJobsThatItsListLacked) {
  WriteBytes(folder_ / "state/results/lost/job.json", "{\"id\": \"lost\", \"state\": \"JOB_STATE_DONE\"}");
  const CapturedLog log;
  StartDaemon();
  EXPECT_EQ(log.Count("warning the list of jobs lacked jobs whose results are in "), 1);
  ASSERT_EQ(client_->info().warnings_size(), 1);
  EXPECT_THAT(client_->info().warnings(0), HasSubstr("restored from their job.json: lost"));
  EXPECT_EQ(client_->Get("lost")->state(), v1::JOB_STATE_DONE);
  daemon_.reset();
}

TEST_F(DaemonStartTest, CountsJobsThatRunAndWait) {
  StartDaemon();
  WatchUntilRunning(Submit({"hang"}, "one"));
  Submit({"a"}, "two");
  Submit({"a"}, "three");
  Connect(daemon_->address());
  EXPECT_EQ(client_->info().jobs_running(), 1);
  EXPECT_EQ(client_->info().jobs_queued(), 2);
}

}  // namespace
}  // namespace weft
