// The service Server: who answers, and how busy it is.
#pragma once

#include "services/daemon/drain.h"
#include "services/daemon/job_queue.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {

// Thread safety: gRPC calls from many threads.
class ServerService final : public v1::Server::Service {
 public:
  // `info` holds what does not change: version, workers, folders. Queue and drain must outlive the service.
  ServerService(JobQueue& queue, weft::Drain& drain, v1::ServerInfo info);

  grpc::Status GetServerInfo(grpc::ServerContext* context, const v1::GetServerInfoRequest* request,
                             v1::ServerInfo* info) override;
  grpc::Status Drain(grpc::ServerContext* context, const v1::DrainRequest* request,
                     v1::DrainProgress* progress) override;

 private:
  JobQueue& queue_;
  weft::Drain& drain_;
  const v1::ServerInfo info_;
};

}  // namespace weft
