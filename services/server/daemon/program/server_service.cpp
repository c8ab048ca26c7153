#include "services/server/daemon/program/server_service.h"

#include <filesystem>

#include "base/host_clock.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/daemon/calls/request_check.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {
namespace {

class ServerService final : public v1::Server::Service {
 public:
  ServerService(JobQueue& queue, weft::Drain& drain, v1::ServerInfo info, RetentionRehearser rehearse)
      : queue_(queue), drain_(drain), info_(std::move(info)), rehearse_(std::move(rehearse)) {}

  grpc::Status GetServerInfo(CallContext*, const v1::GetServerInfoRequest*, v1::ServerInfo* info) override {
    return Answer("GetServerInfo", [&] {
      *info = info_;
      const JobQueue::Load load = queue_.CurrentLoad();
      info->set_jobs_queued(load.queued);
      info->set_jobs_running(load.running);
      for (const std::string& warning : queue_.Warnings()) info->add_warnings(EscapedText(warning));
      info->set_unix_ns(HostTime_ns());
      std::error_code error;
      const std::filesystem::space_info disk = std::filesystem::space(info_.state_folder(), error);
      if (!error) {
        info->set_disk_free_bytes(static_cast<int64_t>(disk.available));
        info->set_disk_total_bytes(static_cast<int64_t>(disk.capacity));
      }
      return absl::OkStatus();
    });
  }

  grpc::Status Drain(CallContext*, const v1::DrainRequest* request, v1::DrainProgress* progress) override {
    return Answer("Drain", [&] {
      *progress = drain_.Begin(queue_, *request);
      return absl::OkStatus();
    });
  }

  grpc::Status RehearseRetention(CallContext*, const v1::RehearseRetentionRequest* request,
                                 v1::RetentionRehearsal* rehearsal) override {
    return Answer("RehearseRetention", [&] {
      WEFT_RETURN_IF_ERROR(CheckRehearsal(*request));
      *rehearsal = rehearse_(*request);
      return absl::OkStatus();
    });
  }

 private:
  JobQueue& queue_;
  weft::Drain& drain_;
  const v1::ServerInfo info_;
  const RetentionRehearser rehearse_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeServerService(JobQueue& queue, Drain& drain, v1::ServerInfo info,
                                                 RetentionRehearser rehearse) {
  return std::make_unique<ServerService>(queue, drain, std::move(info), std::move(rehearse));
}

}  // namespace weft
