#include "services/tools/cli/absolute_paths.h"

#include <filesystem>

#include "services/tools/cli/upload_inputs.h"
#include "services/work/spec/job_input.h"

namespace weft {

std::string AbsolutePath(const std::string& path) {
  return std::filesystem::absolute(path).lexically_normal().string();
}

v1::RegistrationSpec WithAbsolutePaths(v1::RegistrationSpec spec) {
  for (const JobInput& input : InputsOf(spec)) {
    if (!input.path.empty() && !IsOfDaemon(input.path)) SetInput(input, AbsolutePath(input.path), &spec);
  }
  spec.set_out(AbsolutePath(spec.out()));
  return spec;
}

}  // namespace weft
