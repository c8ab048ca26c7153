#include "services/access/method_roles.h"

#include <map>

#include "absl/strings/match.h"
#include "services/rpc/service_files.h"

namespace weft {

v1::Role RoleOfMethod(const std::string& path) {
  static const std::map<std::string, v1::Role> roles = [] {
    std::map<std::string, v1::Role> of_path;
    for (const google::protobuf::MethodDescriptor* method : ServiceMethods()) {
      const bool says_role = method->options().HasExtension(v1::role);
      of_path[PathOf(*method)] = says_role ? method->options().GetExtension(v1::role) : v1::ROLE_ADMIN;
    }
    return of_path;
  }();
  if (absl::StartsWith(path, "/grpc.health.v1.Health/")) return v1::ROLE_UNSPECIFIED;
  const auto known = roles.find(path);
  if (known != roles.end()) return known->second;
  return absl::StartsWith(path, "/weft.") ? v1::ROLE_ADMIN : v1::ROLE_VIEWER;
}

}  // namespace weft
