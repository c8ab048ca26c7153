#include "services/server/rpc/service_files.h"

#include "absl/strings/str_cat.h"
#include "weft/v1/cameras.pb.h"
#include "weft/v1/jobs.pb.h"
#include "weft/v1/library.pb.h"
#include "weft/v1/operations.pb.h"
#include "weft/v1/server.pb.h"
#include "weft/v1/sessions.pb.h"
#include "weft/v1/takes.pb.h"

namespace weft {

std::vector<const google::protobuf::FileDescriptor*> ServiceFiles() {
  return {v1::LookAtCamerasRequest::descriptor()->file(), v1::SubmitJobRequest::descriptor()->file(),
          v1::BeginUploadRequest::descriptor()->file(),   v1::StartOperationRequest::descriptor()->file(),
          v1::GetServerInfoRequest::descriptor()->file(), v1::OpenSessionRequest::descriptor()->file(),
          v1::StartTakeRequest::descriptor()->file()};
}

std::vector<const google::protobuf::MethodDescriptor*> ServiceMethods() {
  std::vector<const google::protobuf::MethodDescriptor*> methods;
  for (const google::protobuf::FileDescriptor* file : ServiceFiles()) {
    for (int i = 0; i < file->service_count(); ++i) {
      for (int k = 0; k < file->service(i)->method_count(); ++k)
        methods.push_back(file->service(i)->method(k));
    }
  }
  return methods;
}

std::string PathOf(const google::protobuf::MethodDescriptor& method) {
  return absl::StrCat("/", method.service()->full_name(), "/", method.name());
}

}  // namespace weft
