#include "services/server/daemon/door/connection_handover.h"

#include <chrono>
#include <utility>

#include "services/ground/process/thread_priority.h"

namespace weft {
namespace {

constexpr int kThreads = 4;  // as many connections hold up others until they are ended
constexpr std::chrono::milliseconds kPause{kThreads};  // a connection a millisecond

}  // namespace

void ConnectionHandover::Begin() {
  for (int i = 0; i < kThreads; ++i) {
    threads_.emplace_back([this](const std::stop_token& stop) { Run(stop); });
  }
}

void ConnectionHandover::HandOver(Acceptor& acceptor, int listener_fd, UniqueFd connection) {
  const MutexLock lock(mutex_);
  waiting_.push_back({&acceptor, listener_fd, std::move(connection)});
  changed_.notify_one();
}

void ConnectionHandover::Stop() {
  for (std::jthread& thread : threads_) thread.request_stop();
  threads_.clear();
  const MutexLock lock(mutex_);
  waiting_.clear();
}

void ConnectionHandover::Run(const std::stop_token& stop) {
  YieldToOthers(kNicenessOfNewConnections);
  MutexLock lock(mutex_);
  while (changed_.wait(lock, stop, [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return !waiting_.empty();
  }) && !stop.stop_requested()) {
    Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
    parameters.listener_fd = next.listener_fd;
    parameters.fd = next.connection.Release();
    next.acceptor->HandleNewConnection(&parameters);
    std::this_thread::sleep_for(kPause);
    lock.lock();
  }
}

}  // namespace weft
