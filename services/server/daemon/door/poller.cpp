#include "services/server/daemon/door/poller.h"

#include <chrono>

namespace weft {
namespace {

// A turn that was lost is taken up after so long.
constexpr std::chrono::milliseconds kTurn{1};

}  // namespace

Poller::Poller(grpc::ServerBuilder& builder) : queue_(builder.AddCompletionQueue()) {}

Poller::~Poller() {
  queue_->Shutdown();
  if (thread_.joinable()) thread_.join();
  void* tag = nullptr;
  bool ok = false;
  while (queue_->Next(&tag, &ok)) {
  }
}

void Poller::Begin() {
  thread_ = std::thread([this] { Run(); });
}

void Poller::Run() {
  void* tag = nullptr;
  bool ok = false;
  while (queue_->AsyncNext(&tag, &ok, std::chrono::system_clock::now() + kTurn) !=
         grpc::CompletionQueue::SHUTDOWN) {
  }
}

}  // namespace weft
