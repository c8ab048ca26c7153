#include "services/server/console/daemon_calls.h"

#include <grpcpp/create_channel_posix.h>
#include <grpcpp/support/channel_arguments.h>

#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "services/server/rpc/grpc_status.h"

namespace weft {
namespace {

namespace asio = boost::asio;

constexpr size_t kMostChannels = 100;
constexpr int kLargestAnswer_bytes = 16 << 20;

using Done = std::function<void(bool ok)>;

std::string TextOf(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string text;
  if (!buffer.Valid() || !buffer.Dump(&slices).ok()) return text;
  for (const grpc::Slice& slice : slices)
    text.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return text;
}

}  // namespace

DaemonCalls::DaemonCalls(Connect connect)
    : connect_(std::move(connect)), running_(std::make_shared<Running>()), thread_([this] { Run(); }) {}

DaemonCalls::~DaemonCalls() {
  {
    const MutexLock lock(running_->mutex);
    for (Call* call : running_->calls) call->Cancel();
  }
  queue_.Shutdown();
  thread_.join();
}

void DaemonCalls::Run() {
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
    const std::unique_ptr<Done> done(static_cast<Done*>(tag));
    (*done)(ok);
  }
}

absl::StatusOr<std::shared_ptr<DaemonCalls::Channel>> DaemonCalls::ChannelOf(const CallFor& caller) {
  const MutexLock lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const auto known = channels_.find(caller.session);
  if (known != channels_.end() && !known->second->broke) {
    known->second->used = now;
    return known->second;
  }
  if (known != channels_.end()) channels_.erase(known);
  if (channels_.size() >= kMostChannels) {
    auto oldest = channels_.begin();
    for (auto one = channels_.begin(); one != channels_.end(); ++one) {
      if (one->second->used < oldest->second->used) oldest = one;
    }
    channels_.erase(oldest);  // calls that run keep it
  }
  WEFT_ASSIGN_OR_RETURN(UniqueFd connection, connect_(caller.peer));
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kLargestAnswer_bytes);
  auto channel = std::make_shared<Channel>();
  channel->channel = grpc::CreateCustomInsecureChannelFromFd("weftd", connection.Release(), arguments);
  channel->used = now;
  channels_[caller.session] = channel;
  return channel;
}

absl::StatusOr<std::shared_ptr<DaemonCalls::Call>> DaemonCalls::Begin(
    const CallFor& caller, const std::string& path, const absl::StatusOr<std::string>& request,
    std::chrono::milliseconds patience) {
  if (!request.ok()) return request.status();
  WEFT_ASSIGN_OR_RETURN(std::shared_ptr<Channel> channel, ChannelOf(caller));
  std::shared_ptr<Call> call(new Call(running_, std::move(channel)));
  call->context_.AddMetadata("weft-token-sha256", caller.token_sha256);
  call->context_.set_deadline(std::chrono::system_clock::now() + patience);
  const grpc::Slice slice(*request);
  call->request_ = grpc::ByteBuffer(&slice, 1);
  call->stream_ = call->stub_.PrepareCall(&call->context_, path, &queue_);
  return call;
}

DaemonCalls::Call::Call(std::shared_ptr<Running> running, std::shared_ptr<Channel> channel)
    : running_(std::move(running)), channel_(std::move(channel)), stub_(channel_->channel) {
  const MutexLock lock(running_->mutex);
  running_->calls.insert(this);
}

DaemonCalls::Call::~Call() {
  const MutexLock lock(running_->mutex);
  running_->calls.erase(this);
}

asio::awaitable<bool> DaemonCalls::Call::Await(std::function<void(void* tag)> begin) {
  // The operation keeps the call, since whoever awaits it may be gone before it ends.
  return asio::async_initiate<const asio::use_awaitable_t<>, void(bool)>(
      [begin = std::move(begin), self = shared_from_this()](auto handler) {
        auto shared = std::make_shared<decltype(handler)>(std::move(handler));
        begin(new Done([shared, self](bool ok) {
          const auto executor = asio::get_associated_executor(*shared);
          asio::post(executor, [shared, ok]() mutable { std::move (*shared)(ok); });
        }));
      },
      asio::use_awaitable);
}

asio::awaitable<bool> DaemonCalls::Call::Read(std::string& message) {
  if (!std::exchange(began_, true)) {
    ended_ = !co_await Await([this](void* tag) { stream_->StartCall(tag); });
    const auto last = grpc::WriteOptions().set_last_message();
    if (!ended_) ended_ = !co_await Await([this, last](void* tag) { stream_->Write(request_, last, tag); });
  }
  answer_.Clear();
  if (!ended_) ended_ = !co_await Await([this](void* tag) { stream_->Read(&answer_, tag); });
  if (!ended_) message = TextOf(answer_);
  co_return !ended_;
}

asio::awaitable<absl::Status> DaemonCalls::Call::Finish() {
  if (!began_) co_return absl::CancelledError("the call did not begin");
  if (!ended_) context_.TryCancel();
  co_await Await([this](void* tag) { stream_->Finish(&status_, tag); });
  // The daemon says the same while it drains, where another connection does no harm.
  if (status_.error_code() == grpc::StatusCode::UNAVAILABLE) channel_->broke = true;
  co_return FromGrpcStatus(status_);
}

}  // namespace weft
