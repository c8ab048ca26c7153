#include "services/server/daemon/studio/take_service.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/mutex.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "capture/take/take_progress.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/calls/server_stream.h"
#include "services/server/rpc/error_detail.h"
#include "weft/v1/takes.grpc.pb.h"

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

class TakeService final : public v1::Takes::WithCallbackMethod_WatchTake<v1::Takes::Service> {
 public:
  TakeService(TakeStore& takes, SessionRegistry& sessions, JobQueue& jobs, FindCaller caller)
      : takes_(takes), sessions_(sessions), jobs_(jobs), caller_(std::move(caller)) {}

  grpc::Status StartTake(CallContext* context, const v1::StartTakeRequest* request,
                         v1::RecordedTake* take) override {
    return Answer("StartTake", [&] { return Assign(Start(*request, caller_(*context)), take); });
  }

  grpc::Status StopTake(CallContext*, const v1::StopTakeRequest* request, v1::RecordedTake* take) override {
    return Answer("StopTake", [&] { return Assign(takes_.Stop(request->take_id()), take); });
  }

  grpc::Status GetTake(CallContext*, const v1::GetTakeRequest* request, v1::RecordedTake* take) override {
    return Answer("GetTake", [&] { return Assign(Get(request->take_id()), take); });
  }

  grpc::Status ListTakes(CallContext*, const v1::ListTakesRequest* request,
                         v1::ListTakesResponse* response) override {
    return Answer("ListTakes", [&]() -> absl::Status {
      WEFT_ASSIGN_OR_RETURN(const int limit, LimitOf(request->limit()));
      WEFT_RETURN_IF_ERROR(CheckOneLine("words", request->words()));
      WEFT_RETURN_IF_ERROR(CheckPageToken(request->page_token()));
      *response = takes_.List(*request, static_cast<size_t>(limit));
      return absl::OkStatus();
    });
  }

  grpc::ServerWriteReactor<v1::RecordedTake>* WatchTake(grpc::CallbackServerContext* context,
                                                        const v1::WatchTakeRequest* request) override {
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

  grpc::Status PinTake(CallContext*, const v1::PinTakeRequest* request, v1::RecordedTake* take) override {
    return Answer("PinTake", [&] { return Assign(takes_.Pin(request->take_id(), request->pinned()), take); });
  }

  grpc::Status DescribeTake(CallContext*, const v1::DescribeTakeRequest* request,
                            v1::RecordedTake* take) override {
    return Answer("DescribeTake", [&] { return Assign(takes_.Describe(*request), take); });
  }

  grpc::Status DeleteTake(CallContext*, const v1::DeleteTakeRequest* request,
                          v1::RecordedTake* take) override {
    return Answer("DeleteTake",
                  [&] { return Assign(takes_.Delete(request->take_id(), "a client deleted it"), take); });
  }

  grpc::Status RestoreTake(CallContext*, const v1::RestoreTakeRequest* request,
                           v1::RecordedTake* take) override {
    return Answer("RestoreTake", [&] { return Assign(takes_.Restore(request->take_id()), take); });
  }

  grpc::Status EmptyTrash(CallContext*, const v1::EmptyTrashRequest* request,
                          v1::EmptyTrashResponse* response) override {
    return Answer("EmptyTrash", [&] { return Assign(takes_.EmptyTrash(request->take_id()), response); });
  }

 private:
  absl::StatusOr<v1::RecordedTake> Start(const v1::StartTakeRequest& request, const Caller& caller) {
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

  // With the job that registers it live.
  absl::StatusOr<v1::RecordedTake> Get(const std::string& id) {
    WEFT_ASSIGN_OR_RETURN(v1::RecordedTake take, takes_.Get(id));
    if (const std::optional<v1::Job> job = jobs_.FollowerOf(take.folder())) {
      take.set_live_job_id(job->id());
      *take.mutable_live() = job->live();
    }
    return take;
  }

  // The same, at most one period of the watchers old: many of them cost what one does.
  absl::StatusOr<v1::RecordedTake> GetRecent(const std::string& id) {
    static constexpr std::chrono::milliseconds kPeriod{200};
    const MutexLock lock(looking_);
    const auto now = std::chrono::steady_clock::now();
    std::erase_if(looks_, [now](const auto& look) { return now - look.second.at >= kPeriod; });
    if (const auto known = looks_.find(id); known != looks_.end()) return known->second.take;
    absl::StatusOr<v1::RecordedTake> take = Get(id);
    looks_.emplace(id, Look{now, take});
    return take;
  }

  struct Look {
    std::chrono::steady_clock::time_point at;
    absl::StatusOr<v1::RecordedTake> take;
  };
  Mutex looking_;
  std::map<std::string, Look> looks_ ABSL_GUARDED_BY(looking_);  // by take

  TakeStore& takes_;
  SessionRegistry& sessions_;
  JobQueue& jobs_;
  const FindCaller caller_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeTakeService(TakeStore& takes, SessionRegistry& sessions, JobQueue& jobs,
                                               FindCaller caller) {
  return std::make_unique<TakeService>(takes, sessions, jobs, std::move(caller));
}

}  // namespace weft
