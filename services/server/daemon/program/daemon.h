// weftd, assembled: catalogue, workers, queue and gRPC server.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/server/access/call_limits.h"
#include "services/server/access/certificates.h"
#include "services/server/daemon/work/operation_command.h"
#include "services/server/daemon/work/prepare_job.h"
#include "services/server/library/uploads.h"
#include "services/server/notice/end_notices.h"
#include "services/server/retention/retention_plan.h"
#include "services/work/items/check_item.h"
#include "services/work/job/job_folder.h"
#include "services/work/kinds/work_kind.h"
#include "services/work/slurm/slurm_options.h"

namespace weft {

class PathPolicy;
struct OperationQueueOptions;
struct TakeStoreOptions;

struct DaemonOptions {
  // "unix:PATH" or HOST:PORT; port 0 takes a free one. Empty: weftd.sock in the state folder.
  std::vector<std::string> listen;
  TlsFiles tls;                            // for addresses that other machines reach
  std::string metrics_listen;              // HOST:PORT for Prometheus; empty: none
  std::string console_listen;              // HOST:PORT for browsers; empty: none
  std::vector<std::string> console_hosts;  // names under which browsers may ask, besides this machine's
  std::string console_files;               // the built pages; empty: none
  std::string state_folder;                // made where it is missing
  std::vector<std::string> allow_paths;    // folders that clients may name
  int workers = 0;                         // processes; 0 chooses by the number of cores
  int threads_per_worker = 0;              // 0 chooses by the number of cores
  int64_t worker_memory_mib = 0;           // of a worker; 0 shares the machine's, negative: any
  std::string worker_program;              // weft-worker
  std::string worker_user;                 // of workers, where root runs the daemon; empty: its own
  SlurmOptions slurm;                      // with a folder: tasks run on a cluster
  std::string recorder_program;            // weft-recorder
  std::string command_program;             // weft, for operations
  v1::RetentionRules retention = DefaultRules();  // what is removed, and when
  NoticeOptions notices;                          // of ends of takes and jobs
  CallerLimits caller_limits;
  std::string address_file;          // gets the addresses once the daemon listens; empty for none
  std::function<void()> on_drained;  // Server.Drain has come to its end: stop the daemon
  std::chrono::milliseconds stop_grace{5000};
  std::chrono::milliseconds silence_limit{std::chrono::minutes(15)};

  // Files of clients are read by processes of `worker_program`, instead of by the functions below, which
  // nothing confines.
  bool reads_in_processes = false;

  // Reads the inputs of a job, computes its verdict once it has ended, and writes its report.
  InputsLoader load_inputs = ListInputs;
  JobEndings endings;
  // Of what clients upload to the library.
  ItemCheck check_item = CheckItemContent;
  // JobQueueOptions.find_incomplete; results are not evaluated without it.
  FindIncomplete find_incomplete;

  // InvalidArgument names the option.
  absl::Status Validate() const;
};

// Listens from Start to Stop, which the destructor calls. Thread safety: Stop may be called by any thread.
class Daemon {
 public:
  // InvalidArgument: options. FailedPrecondition: another daemon uses the state folder, or the port is taken.
  // Otherwise errors of Catalogue::Open, LocalExecutor::Create and SlurmExecutor::Create.
  static absl::StatusOr<std::unique_ptr<Daemon>> Start(DaemonOptions options);
  ~Daemon();

  // The first one that it listens on, with the port that was chosen.
  const std::string& address() const { return addresses_.front(); }
  const std::vector<std::string>& addresses() const { return addresses_; }
  // Where Prometheus asks; empty: nowhere.
  const std::string& metrics_address() const { return metrics_address_; }
  // Where browsers ask; empty: nowhere.
  const std::string& console_address() const { return console_address_; }
  int workers() const { return workers_; }
  int threads_per_worker() const { return threads_per_worker_; }

  // From now on.
  void SetRetention(const v1::RetentionRules& rules);
  void SetNotices(const NoticeOptions& notices);

  // Stops the workers and ends all calls. The next daemon on the state folder goes on.
  void Stop();

  struct Parts;

 private:
  Daemon();
  // What an input that a request names is on this machine.
  static ResolveInput InputsOf(const DaemonOptions& options, const PathPolicy& policy, const Parts& parts);
  static TakeStoreOptions TakeKeepingOf(const DaemonOptions& options, const PathPolicy& policy,
                                        const Parts& parts);
  static OperationQueueOptions OperationsOf(const DaemonOptions& options, const PathPolicy& policy,
                                            const Parts& parts);
  void BeginRetention(const DaemonOptions& options);
  absl::Status KnowCallers(const DaemonOptions& options);
  absl::Status ServeMetrics(const DaemonOptions& options);
  absl::Status ServeConsole(const DaemonOptions& options);
  absl::Status Listen(const DaemonOptions& options);

  std::vector<std::string> addresses_;
  std::string metrics_address_, console_address_;
  int workers_ = 0;
  int threads_per_worker_ = 0;
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft
