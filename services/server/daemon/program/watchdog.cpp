#include "services/server/daemon/program/watchdog.h"

#include <grpcpp/grpcpp.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <spdlog/spdlog.h>

#include <condition_variable>
#include <memory>
#include <utility>

#include "base/mutex.h"
#include "capture/file/plain_text.h"
#include "services/server/daemon/door/listen_address.h"
#include "services/server/rpc/grpc_status.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {
namespace {

// The connection goes to ourselves, so nobody needs to vouch for the certificate.
std::shared_ptr<grpc::ChannelCredentials> DoorCredentials(const std::string& address) {
  const absl::StatusOr<ListenAddress> parsed = ParseListenAddress(address);
  if (parsed.ok() && parsed->kind != ListenKind::kNetwork) return grpc::InsecureChannelCredentials();
  grpc::experimental::TlsChannelCredentialsOptions options;
  options.set_verify_server_certs(false);
  options.set_check_call_host(false);
  options.set_certificate_verifier(std::make_shared<grpc::experimental::NoOpCertificateVerifier>());
  return grpc::experimental::TlsCredentials(options);
}

}  // namespace

absl::StatusOr<v1::ServerInfo> AskFrontDoor(const std::string& address, std::chrono::milliseconds patience,
                                            const std::stop_token& stop) {
  grpc::ChannelArguments settings;
  settings.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // else gRPC takes a connection that it has
  settings.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const auto stub =
      v1::Server::NewStub(grpc::CreateCustomChannel(address, DoorCredentials(address), settings));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + patience);
  context.set_wait_for_ready(true);
  const std::stop_callback cancel(stop, [&context] { context.TryCancel(); });
  v1::ServerInfo info;
  const grpc::Status status = stub->GetServerInfo(&context, {}, &info);
  // Whoever refuses has heard; programs of the daemon's user may have spent what that user may ask for.
  const bool is_refused = status.error_code() == grpc::StatusCode::UNAUTHENTICATED ||
                          status.error_code() == grpc::StatusCode::PERMISSION_DENIED ||
                          status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED;
  if (status.ok() || is_refused) return info;
  return FromGrpcStatus(status);
}

Watchdog::Watchdog(std::string address, std::chrono::milliseconds period,
                   std::function<void(const v1::ServerInfo& info)> answered)
    : address_(std::move(address)),
      period_(period),
      answered_(std::move(answered)),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

void Watchdog::Run(const std::stop_token& stop) const {
  Mutex mutex;
  std::condition_variable_any asked;
  MutexLock lock(mutex);
  bool was_answered = true;
  while (!stop.stop_requested()) {
    const auto next = std::chrono::steady_clock::now() + period_;
    const absl::StatusOr<v1::ServerInfo> info = AskFrontDoor(address_, period_, stop);
    if (info.ok()) {
      answered_(*info);
      if (!was_answered) spdlog::info("watchdog: the daemon answers its own calls again");
    } else if (was_answered && !stop.stop_requested()) {
      spdlog::error("watchdog: the daemon's own call over {} was not answered: {}", address_,
                    EscapedText(std::string(info.status().message())));
    }
    was_answered = info.ok();
    asked.wait_until(lock, stop, next, [] { return false; });
  }
}

}  // namespace weft
