#include "services/ground/process/program_beside.h"

#include <filesystem>
#include <system_error>

namespace weft {

std::string ProgramBeside(const char* name) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "" : (self.parent_path() / name).string();
}

}  // namespace weft
