#include "services/daemon/take_service.h"

#include <grpcpp/alarm.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <utility>

#include "services/daemon/answer.h"
#include "services/daemon/request_check.h"
#include "services/rpc/error_detail.h"
#include "services/rpc/grpc_status.h"

namespace weft {
namespace {

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

absl::StatusOr<v1::RecordedTake> TakeService::Start(const v1::StartTakeRequest& request) {
  v1::StartTakeRequest resolved = request;
  v1::RecorderRequest& recording = *resolved.mutable_recording();
  for (const std::string& ours :
       {recording.capture_session(), recording.rig(), recording.board(), recording.garment()}) {
    if (!ours.empty()) {
      return FieldError(
          absl::StatusCode::kInvalidArgument,
          {"recording", "names a capture session or its inputs", "give the session's lease instead"});
    }
  }
  if (!request.lease().empty()) {
    if (recording.has_session()) {
      return FieldError(absl::StatusCode::kInvalidArgument, {"recording.session", "is given beside a lease",
                                                             "leave it out: the lease's is recorded"});
    }
    const absl::StatusOr<v1::CaptureSession> session = sessions_.Renew(request.lease());
    if (!session.ok()) return session.status();
    *recording.mutable_session() = session->cameras();
    recording.set_capture_session(session->id());
    recording.set_rig(session->rig());
    recording.set_board(session->board());
    recording.set_garment(session->garment());
  }
  if (absl::Status status = sessions_.CheckCamerasAreFree("recording.session.cameras", recording.session(),
                                                          recording.capture_session());
      !status.ok()) {
    return status;
  }
  return takes_.Start(resolved);
}

grpc::Status TakeService::StartTake(grpc::ServerContext*, const v1::StartTakeRequest* request,
                                    v1::RecordedTake* take) {
  return Answer("StartTake", [&] { return Assign(Start(*request), take); });
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
    const absl::StatusOr<int> limit = LimitOf(request->limit());
    if (!limit.ok()) return limit.status();
    *response = takes_.List(static_cast<size_t>(*limit), request->trash());
    return absl::OkStatus();
  });
}

grpc::Status TakeService::PinTake(grpc::ServerContext*, const v1::PinTakeRequest* request,
                                  v1::RecordedTake* take) {
  return Answer("PinTake", [&] { return Assign(takes_.Pin(request->take_id(), request->pinned()), take); });
}

grpc::Status TakeService::DeleteTake(grpc::ServerContext*, const v1::DeleteTakeRequest* request,
                                     v1::RecordedTake* take) {
  return Answer("DeleteTake",
                [&] { return Assign(takes_.Delete(request->take_id(), "a client deleted it"), take); });
}

grpc::Status TakeService::RestoreTake(grpc::ServerContext*, const v1::RestoreTakeRequest* request,
                                      v1::RecordedTake* take) {
  return Answer("RestoreTake", [&] { return Assign(takes_.Restore(request->take_id()), take); });
}

grpc::Status TakeService::EmptyTrash(grpc::ServerContext*, const v1::EmptyTrashRequest* request,
                                     v1::EmptyTrashResponse* response) {
  return Answer("EmptyTrash", [&] { return Assign(takes_.EmptyTrash(request->take_id()), response); });
}

grpc::ServerWriteReactor<v1::RecordedTake>* TakeService::WatchTake(grpc::CallbackServerContext*,
                                                                   const v1::WatchTakeRequest* request) {
  auto* watcher = new TakeWatcher(takes_, request->take_id());
  watcher->Look();
  return watcher;
}

}  // namespace weft
