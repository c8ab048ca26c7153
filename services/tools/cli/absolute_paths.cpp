#include "services/tools/cli/absolute_paths.h"

#include <filesystem>
#include <vector>

#include "services/tools/cli/upload_inputs.h"

namespace weft {

std::string AbsolutePath(const std::string& path) {
  return std::filesystem::absolute(path).lexically_normal().string();
}

v1::RegistrationSpec WithAbsolutePaths(v1::RegistrationSpec spec) {
  std::vector<std::string*> inputs = {spec.mutable_dump(), spec.mutable_rig(), spec.mutable_board(),
                                      spec.mutable_garment()};
  if (spec.has_driving()) inputs.push_back(spec.mutable_driving()->mutable_avatar());
  for (std::string* path : inputs) {
    if (!path->empty() && !IsOfDaemon(*path)) *path = AbsolutePath(*path);
  }
  spec.set_out(AbsolutePath(spec.out()));
  v1::RegistrationOptions& options = *spec.mutable_options();
  for (std::string* path : {options.mutable_scans(), options.mutable_starts()}) {
    if (!path->empty()) *path = AbsolutePath(*path);
  }
  return spec;
}

}  // namespace weft
