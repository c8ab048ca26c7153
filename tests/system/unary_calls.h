// GetJob without a thread per call. Polls a completion queue of its own: gRPC's callbacks sleep up to 100 ms
// while nothing happens, which would be measured.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "weft/v1/jobs.grpc.pb.h"

namespace weft {

class UnaryCalls {
 public:
  using Answered = std::function<void(const grpc::Status& status)>;

  UnaryCalls() {
    for (int i = 0; i < 2; ++i) threads_.emplace_back([this] { Poll(); });
  }
  ~UnaryCalls() {
    WaitForAll();
    queue_.Shutdown();
  }

  // `answered` is called by another thread, and may send the next.
  void Send(v1::Jobs::Stub& stub, const std::string& job, Answered answered) {
    {
      const std::lock_guard lock(mutex_);
      ++open_;
    }
    auto* call = new Call;
    call->answered = std::move(answered);
    v1::GetJobRequest request;
    request.set_job_id(job);
    call->context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
    call->reader = stub.AsyncGetJob(&call->context, request, &queue_);
    call->reader->Finish(&call->job, &call->status, call);
  }
  void WaitForAll() {
    std::unique_lock lock(mutex_);
    none_open_.wait(lock, [this] { return open_ == 0; });
  }

 private:
  struct Call {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientAsyncResponseReader<v1::Job>> reader;
    v1::Job job;
    grpc::Status status;
    Answered answered;
  };

  void Poll() {
    void* tag = nullptr;
    for (bool ok = false; queue_.Next(&tag, &ok);) {
      const std::unique_ptr<Call> call(static_cast<Call*>(tag));
      call->answered(call->status);
      const std::lock_guard lock(mutex_);
      if (--open_ == 0) none_open_.notify_all();
    }
  }

  grpc::CompletionQueue queue_;
  std::mutex mutex_;
  std::condition_variable none_open_;
  int open_ = 0;
  std::vector<std::jthread> threads_;
};

}  // namespace weft
