// The service Server: who answers, and how busy it is.
#pragma once

#include <functional>

#include "services/server/daemon/program/drain.h"
#include "services/server/daemon/work/job_queue.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {

// RetentionKeeper::Rehearse.
using RetentionRehearser = std::function<v1::RetentionRehearsal(const v1::RehearseRetentionRequest&)>;

// Thread safety: gRPC calls from many threads.
class ServerService final : public v1::Server::Service {
 public:
  // `info` holds what does not change: version, workers, folders. Queue and drain must outlive the service.
  ServerService(JobQueue& queue, weft::Drain& drain, v1::ServerInfo info, RetentionRehearser rehearse);

  grpc::Status GetServerInfo(grpc::ServerContext* context, const v1::GetServerInfoRequest* request,
                             v1::ServerInfo* info) override;
  grpc::Status Drain(grpc::ServerContext* context, const v1::DrainRequest* request,
                     v1::DrainProgress* progress) override;
  grpc::Status RehearseRetention(grpc::ServerContext* context, const v1::RehearseRetentionRequest* request,
                                 v1::RetentionRehearsal* rehearsal) override;

 private:
  JobQueue& queue_;
  weft::Drain& drain_;
  const v1::ServerInfo info_;
  const RetentionRehearser rehearse_;
};

}  // namespace weft
