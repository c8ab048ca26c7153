#include "services/server/daemon/program/daemon_life.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/ground/process/process_limits.h"
#include "services/ground/process/service_manager.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/server/daemon/program/watchdog.h"

namespace weft {
namespace {

// What a daemon takes over while it runs.
const std::set<std::string>& ReloadableSettings() {
  static const std::set<std::string> names = {
      "log_level",        "keep_takes_days",   "keep_trash_days",   "takes_quota_gib",   "least_free_gib",
      "keep_jobs_days",   "least_trash_hours", "keep_uploads_days", "keep_notices_days", "on_end_command",
      "on_end_timeout_s", "on_end_url",        "on_end_secret",     "on_end_ca"};
  return names;
}

class DaemonLife {
 public:
  DaemonLife(DaemonSetup setup, const std::function<absl::StatusOr<DaemonSetup>()>& read_again)
      : setup_(std::move(setup)), read_again_(read_again) {}

  absl::Status Run() {
    RaiseDescriptorLimit();
    // Before any thread starts.
    const StopOnSignal signals([this] { AskForReload(); });
    setup_.options.on_drained = [this] { AskForStop(); };
    WEFT_ASSIGN_OR_RETURN(daemon_, Daemon::Start(setup_.options));
    spdlog::info("weftd " WEFT_VERSION " listens on {}, {} workers with {} threads each",
                 absl::StrJoin(daemon_->addresses(), ", "), daemon_->workers(),
                 daemon_->threads_per_worker());
    if (const std::string& metrics = daemon_->metrics_address(); !metrics.empty())
      spdlog::info("metrics at {}/metrics", metrics);
    if (const std::string& console = daemon_->console_address(); !console.empty())
      spdlog::info("console at {}", console);
    NotifyReady(Status());
    std::optional<Watchdog> watchdog = Watch();
    while (WaitForWish(signals.token())) Reload();
    spdlog::info("stopping; unfinished jobs go on at the next start");
    NotifyStopping("stopping; unfinished jobs go on at the next start");
    watchdog.reset();
    daemon_->Stop();
    return absl::OkStatus();
  }

 private:
  std::string Status() const {
    return absl::StrCat("listens on ", absl::StrJoin(daemon_->addresses(), ", "));
  }

  // Asks thrice within the service manager's patience, so that one slow answer is no reason to restart.
  std::optional<Watchdog> Watch() const {
    const auto period = std::chrono::duration_cast<std::chrono::milliseconds>(WatchdogPeriod()) / 3;
    if (period.count() == 0) return std::nullopt;
    return std::optional<Watchdog>(std::in_place, daemon_->address(), period,
                                   [status = Status()](const v1::ServerInfo& info) {
                                     NotifyAlive(absl::StrCat(status, "; jobs: ", info.jobs_running(),
                                                              " running, ", info.jobs_queued(), " queued"));
                                   });
  }

  void AskForReload() {
    const MutexLock lock(mutex_);
    wants_reload_ = true;
    changed_.notify_all();
  }

  void AskForStop() {
    const MutexLock lock(mutex_);
    wants_stop_ = true;
    changed_.notify_all();
  }

  // True: to reload; false: to stop.
  bool WaitForWish(const std::stop_token& stop) {
    MutexLock lock(mutex_);
    changed_.wait(lock, stop,
                  [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return wants_reload_ || wants_stop_; });
    return std::exchange(wants_reload_, false) && !wants_stop_ && !stop.stop_requested();
  }

  void Reload() {
    NotifyReloading();
    if (setup_.config_file.empty()) {
      spdlog::warn("SIGHUP: there is nothing to read again, since weftd was started without --config");
    } else if (absl::StatusOr<DaemonSetup> fresh = read_again_(); fresh.ok()) {
      TakeOver(*std::move(fresh));
    } else {
      spdlog::error("{}; the settings stay as they were", std::string(fresh.status().message()));
    }
    NotifyReady(Status());
  }

  void TakeOver(DaemonSetup fresh) {
    std::vector<std::string> changed, waiting;
    for (const auto& [name, value] : fresh.settings) {
      std::string& known = setup_.settings[name];
      if (known == value) continue;
      if (!ReloadableSettings().contains(name)) {
        waiting.push_back(name);
        continue;
      }
      changed.push_back(absl::StrCat(name, " is ", EscapedText(value), ", was ", EscapedText(known)));
      known = value;
    }
    spdlog::set_level(spdlog::level::from_str(fresh.log_level));
    daemon_->SetRetention(fresh.options.retention);
    daemon_->SetNotices(fresh.options.notices);
    spdlog::info("{} is read again: {}", setup_.config_file,
                 changed.empty() ? "nothing that a running daemon takes over" : absl::StrJoin(changed, "; "));
    if (!waiting.empty())
      spdlog::warn("{}: changed, but in force only after a restart: {}", setup_.config_file,
                   absl::StrJoin(waiting, ", "));
  }

  DaemonSetup setup_;
  const std::function<absl::StatusOr<DaemonSetup>()>& read_again_;
  std::unique_ptr<Daemon> daemon_;
  Mutex mutex_;
  std::condition_variable_any changed_;
  bool wants_reload_ ABSL_GUARDED_BY(mutex_) = false;
  bool wants_stop_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace

absl::Status RunDaemon(DaemonSetup setup, const std::function<absl::StatusOr<DaemonSetup>()>& read_again) {
  return DaemonLife(std::move(setup), read_again).Run();
}

}  // namespace weft
