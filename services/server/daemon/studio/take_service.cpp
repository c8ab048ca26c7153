#include "services/server/daemon/studio/take_service.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "capture/take/take_progress.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/calls/server_stream.h"
#include "services/server/rpc/error_detail.h"

namespace weft {
namespace {

// What one client has seen of a take's ledger.
class TakeWatch {
 public:
  void AddEvents(v1::RecordedTake& take) {
    if (!ledger_) ledger_.emplace(take.folder());
    absl::StatusOr<LedgerReader::News> news = ledger_->ReadNew();
    if (!news.ok()) return;  // the recorder has not begun it, or the state says what is wrong
    std::vector<LedgerEntry>& lines = news->entries;
    std::erase_if(lines, [](const LedgerEntry& line) { return line.event == LedgerEvent::kRecorded; });
    size_t first = news->from_start ? std::min(told_, lines.size()) : 0;
    if (told_ == 0 && lines.size() > kMostAtFirst) first = lines.size() - kMostAtFirst;
    told_ = lines.size() + (news->from_start ? 0 : told_);
    for (size_t i = first; i < lines.size(); ++i) {
      const LedgerEntry& line = lines[i];
      v1::TakeEvent& event = *take.add_events();
      event.set_event(NameOf(line.event));
      event.set_first_set(line.first_set);
      event.set_last_set(line.last_set);
      event.set_noticed_unix_ns(line.host_time_ns);
      event.set_camera(EscapedText(line.camera_id));
      event.set_cause(EscapedText(line.cause));
    }
  }

 private:
  static constexpr size_t kMostAtFirst = 100;
  std::optional<LedgerReader> ledger_;
  size_t told_ = 0;
};

}  // namespace

absl::StatusOr<v1::RecordedTake> TakeService::Start(const v1::StartTakeRequest& request,
                                                    const Caller& caller) {
  v1::StartTakeRequest resolved = request;
  v1::RecorderRequest& recording = *resolved.mutable_recording();
  for (const std::string& ours : {recording.capture_session(), recording.rig(), recording.board(),
                                  recording.garment(), recording.started_by()}) {
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
    WEFT_ASSIGN_OR_RETURN(const v1::CaptureSession session, sessions_.Renew(request.lease()));
    *recording.mutable_session() = session.cameras();
    recording.set_capture_session(session.id());
    recording.set_rig(session.rig());
    recording.set_board(session.board());
    recording.set_garment(session.garment());
  }
  WEFT_RETURN_IF_ERROR(sessions_.CheckCamerasAreFree("recording.session.cameras", recording.session(),
                                                     recording.capture_session()));
  recording.set_started_by(caller.name);
  return takes_.Start(resolved);
}

absl::StatusOr<v1::RecordedTake> TakeService::Get(const std::string& id) {
  WEFT_ASSIGN_OR_RETURN(v1::RecordedTake take, takes_.Get(id));
  if (const std::optional<v1::Job> job = jobs_.FollowerOf(take.folder())) {
    take.set_live_job_id(job->id());
    *take.mutable_live() = job->live();
  }
  return take;
}

absl::StatusOr<v1::RecordedTake> TakeService::GetRecent(const std::string& id) {
  static constexpr std::chrono::milliseconds kPeriod{200};
  const MutexLock lock(looking_);
  const auto now = std::chrono::steady_clock::now();
  std::erase_if(looks_, [now](const auto& look) { return now - look.second.at >= kPeriod; });
  if (const auto known = looks_.find(id); known != looks_.end()) return known->second.take;
  absl::StatusOr<v1::RecordedTake> take = Get(id);
  looks_.emplace(id, Look{now, take});
  return take;
}

grpc::Status TakeService::StartTake(grpc::ServerContext* context, const v1::StartTakeRequest* request,
                                    v1::RecordedTake* take) {
  return Answer("StartTake", [&] { return Assign(Start(*request, caller_(*context)), take); });
}

grpc::Status TakeService::StopTake(grpc::ServerContext*, const v1::StopTakeRequest* request,
                                   v1::RecordedTake* take) {
  return Answer("StopTake", [&] { return Assign(takes_.Stop(request->take_id()), take); });
}

grpc::Status TakeService::GetTake(grpc::ServerContext*, const v1::GetTakeRequest* request,
                                  v1::RecordedTake* take) {
  return Answer("GetTake", [&] { return Assign(Get(request->take_id()), take); });
}

grpc::Status TakeService::ListTakes(grpc::ServerContext*, const v1::ListTakesRequest* request,
                                    v1::ListTakesResponse* response) {
  return Answer("ListTakes", [&]() -> absl::Status {
    WEFT_ASSIGN_OR_RETURN(const int limit, LimitOf(request->limit()));
    WEFT_RETURN_IF_ERROR(CheckOneLine("words", request->words()));
    WEFT_RETURN_IF_ERROR(CheckPageToken(request->page_token()));
    *response = takes_.List(*request, static_cast<size_t>(limit));
    return absl::OkStatus();
  });
}

grpc::Status TakeService::PinTake(grpc::ServerContext*, const v1::PinTakeRequest* request,
                                  v1::RecordedTake* take) {
  return Answer("PinTake", [&] { return Assign(takes_.Pin(request->take_id(), request->pinned()), take); });
}

grpc::Status TakeService::DescribeTake(grpc::ServerContext*, const v1::DescribeTakeRequest* request,
                                       v1::RecordedTake* take) {
  return Answer("DescribeTake", [&] { return Assign(takes_.Describe(*request), take); });
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

grpc::ServerWriteReactor<v1::RecordedTake>* TakeService::WatchTake(grpc::CallbackServerContext* context,
                                                                   const v1::WatchTakeRequest* request) {
  const auto watch = std::make_shared<TakeWatch>();
  return WatchByLooking<v1::RecordedTake>(
      context, "WatchTake",
      [this, watch, id = request->take_id()] {
        absl::StatusOr<v1::RecordedTake> take = GetRecent(id);
        if (take.ok()) watch->AddEvents(*take);
        return take;
      },
      [](const v1::RecordedTake& take) { return !take.recorder_lives(); });
}

}  // namespace weft
