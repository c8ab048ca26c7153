#include "services/daemon/take_service.h"

#include "services/daemon/answer.h"
#include "services/daemon/polling_watcher.h"
#include "services/daemon/request_check.h"
#include "services/rpc/error_detail.h"

namespace weft {

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
  auto* watcher = new PollingWatcher<v1::RecordedTake>(
      [this, id = request->take_id()] { return takes_.Get(id); },
      [](const v1::RecordedTake& take) { return !take.recorder_lives(); });
  watcher->Look();
  return watcher;
}

}  // namespace weft
