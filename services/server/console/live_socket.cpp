#include "services/server/console/live_socket.h"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "services/server/console/json_messages.h"
#include "services/server/console/request_target.h"
#include "services/server/rpc/service_files.h"

namespace weft {
namespace {

namespace asio = boost::asio;

constexpr std::chrono::hours kStreamPatience{24};  // with a stream

// All of it runs in the strand of the connection.
struct Live : std::enable_shared_from_this<Live> {
  Live(std::unique_ptr<PageSocket> its_socket, const asio::any_io_executor& executor, DaemonCalls& its_calls)
      : socket(std::move(its_socket)), turn(executor), beat(executor), calls(its_calls) {}

  std::unique_ptr<PageSocket> socket;
  asio::steady_timer turn;  // whoever waits to write
  asio::steady_timer beat;
  DaemonCalls& calls;
  bool writing = false, gone = false;
  std::map<uint32_t, std::shared_ptr<DaemonCalls::Call>> streams;

  asio::awaitable<bool> Write(std::string text);
  asio::awaitable<void> Stream(uint32_t id, const google::protobuf::MethodDescriptor& method,
                               std::shared_ptr<DaemonCalls::Call> call);
  asio::awaitable<void> Beat(BrowserSessions& sessions, std::string session_id,
                             std::chrono::milliseconds every);
  asio::awaitable<void> Order(std::string text, const CallFor& caller, size_t most);
  asio::awaitable<void> End(uint32_t id, const absl::Status& status);
};

// One message at a time. Those that wait are as many as streams.
asio::awaitable<bool> Live::Write(std::string text) {
  boost::system::error_code ignored;
  while (writing && !gone) {
    turn.expires_at(asio::steady_timer::time_point::max());
    co_await turn.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }
  if (gone) co_return false;
  writing = true;
  const bool written = co_await socket->Write(std::move(text));
  writing = false;
  if (!written) gone = true;
  turn.cancel();
  co_return written;
}

asio::awaitable<void> Live::End(uint32_t id, const absl::Status& status) {
  co_await Write(absl::StrCat(id, " end\n", JsonOfStatus(status)));
}

asio::awaitable<void> Live::Stream(uint32_t id, const google::protobuf::MethodDescriptor& method,
                                   std::shared_ptr<DaemonCalls::Call> call) {
  const auto self = shared_from_this();
  std::string message;
  while (!gone && co_await call->Read(message)) {
    const absl::StatusOr<std::string> json = JsonOfAnswer(*method.output_type(), message);
    if (!json.ok()) break;
    std::string text = absl::StrCat(id, " message\n", *json);
    const bool written = co_await Write(std::move(text));
    if (!written) break;
  }
  const absl::Status status = co_await call->Finish();
  // The page may have given the number to another one meanwhile.
  const auto known = streams.find(id);
  if (known == streams.end() || known->second != call) co_return;
  streams.erase(known);
  co_await End(id, status);
}

asio::awaitable<void> Live::Beat(BrowserSessions& sessions, std::string session_id,
                                 std::chrono::milliseconds every) {
  const auto self = shared_from_this();
  boost::system::error_code error;
  while (!gone) {
    std::string text = absl::StrCat("0 alive\n", HostTime_ns());
    const bool written = co_await Write(std::move(text));
    if (!written) break;
    beat.expires_after(every);
    co_await beat.async_wait(asio::redirect_error(asio::use_awaitable, error));
    const absl::StatusOr<BrowserSession> session = sessions.Find(session_id);
    if (gone || session.ok()) continue;
    co_await End(0, session.status());
    for (auto& [id, call] : streams) call->Cancel();
    co_await socket->Close();
  }
}

asio::awaitable<void> Live::Order(std::string text, const CallFor& caller, size_t most) {
  const absl::StatusOr<SocketOrder> order = ParseSocketOrder(text);
  if (!order.ok()) {
    co_await End(0, order.status());
    co_return;
  }
  const auto known = streams.find(order->id);
  if (order->method.empty()) {
    if (known == streams.end()) co_return;
    known->second->Cancel();
    streams.erase(known);
    co_return;
  }
  const google::protobuf::MethodDescriptor* method = FindMethod(order->method);
  absl::Status status;
  if (order->id == 0 || known != streams.end()) {
    status = absl::InvalidArgumentError("the number is taken; give each stream its own");
  } else if (method == nullptr) {
    status = absl::UnimplementedError("there is no such method");
  } else if (streams.size() >= most) {
    status = absl::ResourceExhaustedError(absl::StrCat(most, " streams run already; end one before"));
  }
  if (!status.ok()) {
    co_await End(order->id, status);
    co_return;
  }
  const absl::StatusOr<std::string> request = RequestOfJson(*method->input_type(), order->json);
  const absl::StatusOr<std::shared_ptr<DaemonCalls::Call>> call =
      calls.Begin(caller, PathOf(*method), request, kStreamPatience);
  if (!call.ok()) {
    co_await End(order->id, call.status());
    co_return;
  }
  streams[order->id] = *call;
  asio::co_spawn(turn.get_executor(), Stream(order->id, *method, *call), asio::detached);
}

}  // namespace

asio::awaitable<void> ServeSocket(std::unique_ptr<PageSocket> socket, std::string session_id, CallFor caller,
                                  BrowserSessions& sessions, DaemonCalls& calls, LiveSocketOptions options) {
  const auto executor = co_await asio::this_coro::executor;
  const auto live = std::make_shared<Live>(std::move(socket), executor, calls);
  asio::co_spawn(executor, live->Beat(sessions, std::move(session_id), options.beat), asio::detached);
  while (!live->gone) {
    std::optional<std::string> text = co_await live->socket->Read();
    if (!text) break;
    co_await live->Order(*std::move(text), caller, options.streams);
  }
  live->gone = true;
  live->turn.cancel();
  live->beat.cancel();
  for (auto& [id, call] : live->streams) call->Cancel();
  live->streams.clear();
}

}  // namespace weft
