// What a daemon is made of. Only for its own source files.
#pragma once

#include <grpcpp/server.h>

#include <memory>
#include <mutex>
#include <vector>

#include "services/server/console/console.h"
#include "services/server/daemon/door/connections.h"
#include "services/server/daemon/door/poller.h"
#include "services/server/daemon/program/daemon.h"
#include "services/server/daemon/program/drain.h"
#include "services/server/daemon/program/health.h"
#include "services/server/daemon/program/metrics.h"
#include "services/server/daemon/program/metrics_page.h"
#include "services/server/daemon/program/retention_keeper.h"
#include "services/server/daemon/studio/session_registry.h"
#include "services/server/daemon/studio/take_store.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/operation_queue.h"
#include "services/server/library/library.h"
#include "services/server/library/uploads.h"

namespace weft {

// In the order in which they depend on each other.
struct Daemon::Parts {
  std::unique_ptr<AccessControl> access;
  std::unique_ptr<CallLimits> limits;
  std::unique_ptr<AuditLog> audit;
  ReceiveGuard guard;
  std::unique_ptr<RevocationList> revocations;  // null: none is asked
  std::unique_ptr<EndNotices> notices;
  std::unique_ptr<Drain> drain;
  std::unique_ptr<JobQueue> queue;
  std::unique_ptr<Library> library;
  std::unique_ptr<Uploads> uploads;
  std::unique_ptr<SessionRegistry> session_registry;
  std::unique_ptr<TakeStore> take_store;
  std::unique_ptr<OperationQueue> operation_queue;
  std::vector<std::unique_ptr<grpc::Service>> services;
  std::unique_ptr<RetentionKeeper> retention;
  std::unique_ptr<Connections> connections;
  std::unique_ptr<Poller> poller;
  std::unique_ptr<grpc::Server> server;
  std::unique_ptr<HealthWatch> health;
  std::unique_ptr<Metrics> metrics;
  std::unique_ptr<HttpListener> metrics_page;  // null: nobody asked for one
  std::unique_ptr<Console> console;            // null: the same
  std::once_flag stopped;
};

}  // namespace weft
