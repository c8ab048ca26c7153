#include "services/server/access/methods.h"

#include <map>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "services/server/rpc/service_files.h"

namespace weft {
namespace {

constexpr char kHealth[] = "/grpc.health.v1.Health/";

Method Describe(const google::protobuf::MethodDescriptor& schema) {
  Method method;
  method.name = absl::StrCat(schema.service()->name(), ".", schema.name());
  method.is_ours = true;
  const bool says_role = schema.options().HasExtension(v1::role);
  method.role = says_role ? schema.options().GetExtension(v1::role) : v1::ROLE_ADMIN;
  method.kind = schema.client_streaming()   ? CallKind::kUpload
                : schema.server_streaming() ? CallKind::kStream
                                            : CallKind::kUnary;
  // Parts of what is recorded already: of an upload, which begins and finishes, and of an open session.
  const bool is_part = method.name == "Library.WriteFile" || method.name == "Sessions.RenewSession";
  method.audited = method.role > v1::ROLE_VIEWER && !is_part;
  return method;
}

}  // namespace

Method MethodOf(const std::string& path) {
  static const std::map<std::string, Method> methods = [] {
    std::map<std::string, Method> of_path;
    for (const google::protobuf::MethodDescriptor* schema : ServiceMethods())
      of_path[PathOf(*schema)] = Describe(*schema);
    return of_path;
  }();
  const auto known = methods.find(path);
  if (known != methods.end()) return known->second;
  if (absl::StartsWith(path, kHealth)) {
    const bool watches = path == absl::StrCat(kHealth, "Watch");
    return {path, v1::ROLE_UNSPECIFIED, watches ? CallKind::kStream : CallKind::kUnary};
  }
  return {path, absl::StartsWith(path, "/weft.") ? v1::ROLE_ADMIN : v1::ROLE_VIEWER, CallKind::kStream};
}

}  // namespace weft
