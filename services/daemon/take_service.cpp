#include "services/daemon/take_service.h"

#include <grpcpp/alarm.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/daemon/answer.h"
#include "services/rpc/error_detail.h"
#include "services/rpc/grpc_status.h"

namespace weft {
namespace {

constexpr int kDefaultTakeLimit = 100;
constexpr int kMaxTakeLimit = 1000;

// Looks at the take between two writes, so a slow client costs neither memory nor a thread.
class TakeWatcher : public grpc::ServerWriteReactor<v1::RecordedTake> {
 public:
  TakeWatcher(TakeKeeper& takes, std::string id) : takes_(takes), id_(std::move(id)) {}

  void Look() {
    // Called by the alarm, too, of which gRPC does not know when it deletes this: the lock must outlive it.
    const std::shared_ptr<std::mutex> mutex = mutex_;
    const std::lock_guard lock(*mutex);
    waiting_ = false;
    if (cancelled_) return End(grpc::Status::CANCELLED);
    absl::StatusOr<v1::RecordedTake> take = takes_.Get(id_);
    if (!take.ok()) return End(ToGrpcStatus(take.status()));
    if (take->SerializeAsString() == written_.SerializeAsString()) return Wait();
    written_ = *std::move(take);
    writing_ = true;
    StartWrite(&written_);
  }

  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(*mutex_);
    writing_ = false;
    if (!ok || cancelled_) return End(grpc::Status::CANCELLED);
    if (!written_.recorder_lives()) return End(grpc::Status::OK);
    Wait();
  }

  void OnCancel() override {
    const std::lock_guard lock(*mutex_);
    cancelled_ = true;
    if (waiting_) alarm_->Cancel();
  }

  void OnDone() override {
    // Whoever ended the stream lets go of the lock first.
    { const std::lock_guard lock(*mutex_); }
    delete this;
  }

 private:
  // The functions below need the lock.
  void Wait() {
    constexpr std::chrono::milliseconds kPeriod{250};
    waiting_ = true;
    // Another one each time: this may be the call of the last one.
    alarm_ = std::make_unique<grpc::Alarm>();
    alarm_->Set(std::chrono::system_clock::now() + kPeriod, [this](bool) { Look(); });
  }

  void End(const grpc::Status& status) {
    if (!std::exchange(finished_, true)) Finish(status);
  }

  TakeKeeper& takes_;
  const std::string id_;
  const std::shared_ptr<std::mutex> mutex_ = std::make_shared<std::mutex>();
  std::unique_ptr<grpc::Alarm> alarm_;
  v1::RecordedTake written_;
  bool writing_ = false, waiting_ = false, cancelled_ = false, finished_ = false;
};

}  // namespace

grpc::Status TakeService::StartTake(grpc::ServerContext*, const v1::StartTakeRequest* request,
                                    v1::RecordedTake* take) {
  return Answer("StartTake", [&] { return Assign(takes_.Start(*request), take); });
}

grpc::Status TakeService::StopTake(grpc::ServerContext*, const v1::StopTakeRequest* request,
                                   v1::RecordedTake* take) {
  return Answer("StopTake", [&] { return Assign(takes_.Stop(request->take_id()), take); });
}

grpc::Status TakeService::GetTake(grpc::ServerContext*, const v1::GetTakeRequest* request,
                                  v1::RecordedTake* take) {
  return Answer("GetTake", [&] { return Assign(takes_.Get(request->take_id()), take); });
}

grpc::Status TakeService::ListTakes(grpc::ServerContext*, const v1::ListTakesRequest* request,
                                    v1::ListTakesResponse* response) {
  return Answer("ListTakes", [&]() -> absl::Status {
    const int limit = request->limit();
    if (limit < 0) {
      return FieldError(absl::StatusCode::kInvalidArgument,
                        {"limit", absl::StrCat(limit, " is negative"), "give 0 for the default"});
    }
    *response =
        takes_.List(static_cast<size_t>(limit == 0 ? kDefaultTakeLimit : std::min(limit, kMaxTakeLimit)));
    return absl::OkStatus();
  });
}

grpc::ServerWriteReactor<v1::RecordedTake>* TakeService::WatchTake(grpc::CallbackServerContext*,
                                                                   const v1::WatchTakeRequest* request) {
  auto* watcher = new TakeWatcher(takes_, request->take_id());
  watcher->Look();
  return watcher;
}

}  // namespace weft
