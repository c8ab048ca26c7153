#include "services/server/daemon/studio/camera_service.h"

#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/rpc/error_detail.h"
#include "services/studio/recording/camera_list.h"
#include "services/studio/recording/session_file.h"
#include "services/studio/recording/take_look.h"
#include "weft/v1/cameras.grpc.pb.h"

namespace weft {
namespace {

constexpr int kMostWidth_px = 4096;

absl::Status BadLook(const std::string& field, const std::string& problem, const std::string& remedy) {
  return FieldError(absl::StatusCode::kInvalidArgument, {field, problem, remedy});
}

absl::Status CheckLookRequest(const v1::LookAtCamerasRequest& request) {
  const int named = static_cast<int>(request.has_cameras()) + static_cast<int>(!request.lease().empty()) +
                    static_cast<int>(!request.take_id().empty());
  if (named != 1) {
    return BadLook("cameras", absl::StrCat(named, " of cameras, lease and take_id are given"),
                   "give one of them");
  }
  if (!request.frame().empty() && request.take_id().empty())
    return BadLook("frame", "is given without a take", "leave it out, or give take_id");
  if (request.width_px() >= 0 && request.width_px() <= kMostWidth_px) return absl::OkStatus();
  return BadLook("width_px", absl::StrCat(request.width_px(), " is out of range"),
                 absl::StrCat("give 1 to ", kMostWidth_px, ", or 0"));
}

class CameraService final : public v1::Cameras::Service {
 public:
  CameraService(TakeStore& takes, SessionRegistry& sessions) : takes_(takes), sessions_(sessions) {}

  grpc::Status ListCameras(CallContext*, const v1::ListCamerasRequest*, v1::CameraList* list) override {
    return Answer("ListCameras", [&] {
      *list = weft::ListCameras();
      std::map<std::string, std::string> users = sessions_.UsersOfDevices();
      for (const auto& [device, user] : takes_.UsersOfDevices()) {
        std::string& all = users[device];
        all = all.empty() ? user : absl::StrCat(user, ", ", all);
      }
      for (v1::ListedCamera& camera : *list->mutable_cameras()) {
        // A session may name it in any of these ways.
        for (const std::string& name : {camera.device(), camera.serial(), camera.bus(), camera.model()}) {
          const auto user = name.empty() ? users.end() : users.find(name);
          if (user != users.end()) camera.set_used_by(user->second);
        }
      }
      return absl::OkStatus();
    });
  }

  grpc::Status LookAtCameras(CallContext*, const v1::LookAtCamerasRequest* request,
                             grpc::ServerWriter<v1::CameraLook>* writer) override {
    return Answer("LookAtCameras", [&]() -> absl::Status {
      WEFT_ASSIGN_OR_RETURN(const std::vector<v1::CameraLook> looks, Look(*request));
      for (const v1::CameraLook& look : looks) {
        if (!writer->Write(look)) return absl::CancelledError("the client went away");
      }
      return absl::OkStatus();
    });
  }

 private:
  absl::StatusOr<std::vector<v1::CameraLook>> Look(const v1::LookAtCamerasRequest& request) {
    WEFT_RETURN_IF_ERROR(CheckLookRequest(request));
    TakeLookOptions options;
    if (request.width_px() > 0) options.width_px = request.width_px();
    if (!request.take_id().empty()) {
      options.camera_id = request.camera_id();
      options.frame = request.frame();
      WEFT_ASSIGN_OR_RETURN(const v1::RecordedTake take, takes_.Get(request.take_id()));
      return LookAtTake(take.folder(), options);
    }
    WEFT_ASSIGN_OR_RETURN(const v1::Session session, SessionOf(request));
    absl::StatusOr<std::vector<v1::CameraLook>> looks;
    WEFT_RETURN_IF_ERROR(
        takes_.FilmBriefly(session, [&](const std::string& take) { looks = LookAtTake(take, options); }));
    return looks;
  }

  // What of the request is to be opened.
  absl::StatusOr<v1::Session> SessionOf(const v1::LookAtCamerasRequest& request) {
    v1::Session cameras = request.cameras();
    std::string session_id;
    if (!request.lease().empty()) {
      WEFT_ASSIGN_OR_RETURN(v1::CaptureSession session, sessions_.Renew(request.lease()));
      cameras = session.cameras();
      session_id = session.id();
    }
    if (!request.camera_id().empty()) {
      v1::Session all = cameras;
      cameras.clear_cameras();
      for (const v1::SessionCamera& camera : all.cameras()) {
        if (camera.id() == request.camera_id()) *cameras.add_cameras() = camera;
      }
      if (cameras.cameras().empty()) {
        return BadLook("camera_id", absl::StrCat("no camera \"", request.camera_id(), "\""),
                       "give the id of a camera");
      }
      cameras.mutable_cameras(0)->set_unsynchronized(false);  // alone it has nothing to be compared with
    }
    WEFT_RETURN_IF_ERROR(CheckSession(cameras, "cameras"));
    WEFT_RETURN_IF_ERROR(sessions_.CheckCamerasAreFree("cameras.cameras", cameras, session_id));
    return cameras;
  }

  TakeStore& takes_;
  SessionRegistry& sessions_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeCameraService(TakeStore& takes, SessionRegistry& sessions) {
  return std::make_unique<CameraService>(takes, sessions);
}

}  // namespace weft
