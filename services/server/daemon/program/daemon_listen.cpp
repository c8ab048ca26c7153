// Daemon: what stands between its clients and its services.
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/server/access/access_list.h"
#include "services/server/access/call_limits.h"
#include "services/server/daemon/door/call_observer.h"
#include "services/server/daemon/door/server_credentials.h"
#include "services/server/daemon/program/daemon.h"
#include "services/server/daemon/program/daemon_parts.h"
#include "services/server/rpc/message_limit.h"

namespace weft {
namespace {

// Calls at once, more than CallerLimits lets in: 200 clients that all ask in the same moment are answered.
// Watchers and downloads need none.
constexpr int kMaxThreads = 384;
static_assert(kMaxThreads > CallerLimits().all_unary);
constexpr int kPollers = 4;
constexpr int kSpareThreads = 2 * kPollers;

void ConfigureServer(grpc::ServerBuilder& builder) {
  builder.SetMaxReceiveMessageSize(kLargestRequest_bytes);
  // gRPC unpacks a message before it looks at its size: 0.9 MB become 1 GB. So it unpacks none, and CallCheck
  // refuses calls that announce such messages.
  builder.AddChannelArgument(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  // Windows that gRPC lets grow with the bandwidth would hold more than ReceiveGuard allows.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, ReceiveGuard::kWindow_bytes);
  // What is read at once is worked on to its end, though its connection was ended meanwhile.
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, ReceiveGuard::kReadAtOnce_bytes);
  // A thread that polls works on what a connection sends until nothing more comes. The others go on
  // meanwhile.
  builder.SetSyncServerOption(grpc::ServerBuilder::SyncServerOption::MIN_POLLERS, kPollers);
  builder.SetSyncServerOption(grpc::ServerBuilder::SyncServerOption::MAX_POLLERS, 2 * kPollers);
  grpc::ResourceQuota quota("weftd");
  quota.SetMaxThreads(kMaxThreads);
  builder.SetResourceQuota(quota);
  // gRPC 1.51 aborts over some headers that lie beyond its limit (CVE-2023-1428), so there is none:
  // ReceiveGuard ends a connection long before, and CallCheck refuses calls with large headers.
  constexpr int kNoLimit = 1 << 30;
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, kNoLimit);
  // Whoever connects and says nothing is let go.
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 100);
  // Clients whose machine went away are noticed.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 60'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20'000);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 10'000);
}

DaemonLoad LoadOf(Daemon::Parts& parts, const std::string& state_folder, int workers) {
  const JobQueue::Load queue = parts.queue->CurrentLoad();
  DaemonLoad load;
  load.jobs_queued = queue.queued;
  load.jobs_running = queue.running;
  load.watchers = queue.watchers;
  load.frames_done = queue.frames_done;
  load.frames_failed = queue.frames_failed;
  // Older ones are recorded no more.
  constexpr size_t kNewestTakes = 50;
  const v1::ListTakesResponse takes = parts.take_store->List({}, kNewestTakes);
  for (const v1::RecordedTake& take : takes.takes()) {
    if (!take.recorder_lives()) continue;
    ++load.takes_recording;
    load.sets_dropped += take.state().sets_dropped();
    load.frames_missing += take.state().frames_missing();
  }
  load.connections = parts.connections->open();
  load.calls_running = parts.limits->Running(CallKind::kUnary);
  load.streams_running = parts.limits->Running(CallKind::kStream);
  load.uploads_running = parts.limits->Running(CallKind::kUpload);
  load.workers = workers;
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(state_folder, error);
  if (!error) load.state_free_bytes = space.available;
  load.serving = parts.health->serving();
  return load;
}

// Why clients had better go elsewhere, or wait.
std::string TroubleOf(Daemon::Parts& parts) {
  if (std::string trouble = parts.queue->CurrentLoad().trouble; !trouble.empty()) return trouble;
  if (const absl::Status admits = parts.drain->Admit(); !admits.ok()) return std::string(admits.message());
  const int busy = parts.limits->Running(CallKind::kUnary) + parts.limits->Running(CallKind::kUpload);
  if (busy >= kMaxThreads - kSpareThreads) return absl::StrCat(busy, " calls run, and all threads are taken");
  if (parts.connections->open() >= parts.connections->most())
    return absl::StrCat(parts.connections->open(), " clients are connected, the most at once");
  return "";
}

}  // namespace

absl::Status Daemon::ServeMetrics(const DaemonOptions& options) {
  parts_->metrics = std::make_unique<Metrics>(
      [this, folder = options.state_folder] { return LoadOf(*parts_, folder, workers_); },
      static_cast<double>(HostTime_ns()) / 1e9);
  if (options.metrics_listen.empty()) return absl::OkStatus();
  WEFT_ASSIGN_OR_RETURN(const ListenAddress address, ParseListenAddress(options.metrics_listen));
  WEFT_ASSIGN_OR_RETURN(ListeningSocket socket, ListenAt(address));
  metrics_address_ = socket.address;
  WEFT_ASSIGN_OR_RETURN(parts_->metrics_page, ServeMetricsPage(std::move(socket), options.tls,
                                                               {*parts_->metrics, *parts_->access,
                                                                *parts_->audit, options.console_hosts}));
  return absl::OkStatus();
}

absl::Status Daemon::ServeConsole(const DaemonOptions& options) {
  if (options.console_listen.empty()) return absl::OkStatus();
  WEFT_ASSIGN_OR_RETURN(const ListenAddress address, ParseListenAddress(options.console_listen));
  WEFT_ASSIGN_OR_RETURN(ListeningSocket socket, ListenAt(address));
  console_address_ = socket.address;
  ConsoleOptions console;
  console.host_names = options.console_hosts;
  char name[HOST_NAME_MAX + 1] = "";
  if (gethostname(name, sizeof name - 1) == 0) console.host_names.emplace_back(name);
  console.tls = options.tls;
  console.uses_tls = socket.kind == ListenKind::kNetwork;
  console.page_folder = options.console_files;
  console.session_file = absl::StrCat(options.state_folder, "/console.json");
  console.cookie_suffix = console_address_.substr(console_address_.rfind(':') + 1);
  console.version = WEFT_VERSION;
  WEFT_ASSIGN_OR_RETURN(parts_->console,
                        Console::Start(std::move(socket.socket), std::move(console),
                                       {*parts_->access, *parts_->audit, [this](const std::string& browser) {
                                          return parts_->connections->ConnectConsole(browser);
                                        }}));
  return absl::OkStatus();
}

absl::Status Daemon::KnowCallers(const DaemonOptions& options) {
  const auto warn = [](const std::string& message) { spdlog::warn("{}", EscapedText(message)); };
  parts_->access = std::make_unique<AccessControl>(AccessListFile(options.state_folder), warn);
  parts_->limits = std::make_unique<CallLimits>(options.caller_limits);
  WEFT_ASSIGN_OR_RETURN(parts_->audit, AuditLog::Open(AuditLogFile(options.state_folder), warn));
  if (!options.tls.client_revocations.empty())
    parts_->revocations = std::make_unique<RevocationList>(options.tls.client_revocations, warn);
  return absl::OkStatus();
}

absl::Status Daemon::Listen(const DaemonOptions& options) {
  std::vector<std::string> texts = options.listen;
  if (texts.empty()) texts.push_back(absl::StrCat("unix:", options.state_folder, "/weftd.sock"));
  std::vector<ListeningSocket> sockets;
  for (const std::string& text : texts) {
    WEFT_ASSIGN_OR_RETURN(const ListenAddress address, ParseListenAddress(text));
    WEFT_ASSIGN_OR_RETURN(ListeningSocket socket, ListenAt(address));
    addresses_.push_back(socket.address);
    sockets.push_back(std::move(socket));
  }
  if (!options.console_listen.empty()) {
    ListeningSocket console;
    console.kind = ListenKind::kConsole;
    sockets.push_back(std::move(console));
  }
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  ConfigureServer(builder);
  ServerCredentialsMaker credentials(options.tls);
  const CallerSources sources{*parts_->access,
                              *parts_->limits,
                              *parts_->audit,
                              parts_->guard,
                              parts_->revocations.get(),
                              [this](const ObservedCall& call) {
                                if (parts_->metrics) parts_->metrics->Count(call);
                              }};
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> observers;
  observers.push_back(ObserveCalls(sources));
  builder.experimental().SetInterceptorCreators(std::move(observers));
  parts_->connections = std::make_unique<Connections>(
      std::move(sockets), LimitsOfProcess(), sources,
      [&credentials](ListenKind kind) { return credentials.Make(kind); }, builder);
  for (const auto& service : parts_->services) builder.RegisterService(service.get());
  parts_->poller = std::make_unique<Poller>(builder);
  parts_->server = builder.BuildAndStart();
  if (parts_->server == nullptr) return absl::InternalError("gRPC starts no server; its log says why");
  parts_->health = std::make_unique<HealthWatch>(*parts_->server->GetHealthCheckService(),
                                                 [this] { return TroubleOf(*parts_); });
  WEFT_RETURN_IF_ERROR(ServeMetrics(options));
  parts_->poller->Begin();
  WEFT_RETURN_IF_ERROR(parts_->connections->Begin());
  WEFT_RETURN_IF_ERROR(ServeConsole(options));
  if (options.address_file.empty()) return absl::OkStatus();
  return WriteFileAtomically(options.address_file, absl::StrCat(absl::StrJoin(addresses_, "\n"), "\n"));
}

}  // namespace weft
