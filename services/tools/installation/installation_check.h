// What an administrator should know of an installation before its users do.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "weft/v1/daemon_config.pb.h"
#include "weft/v1/doctor.pb.h"

namespace weft {

struct InstallationOptions {
  std::string program_folder;  // where weft, weftd, weft-worker and weft-recorder are
  std::string config_file;     // of weftd; empty: none is looked at
  std::string server;          // empty: the first address of the configuration
};

// The folder of this program.
std::string OwnProgramFolder();

// A file of `weftd --config`, with all values checked by weftd itself. Errors of RunProgram.
absl::StatusOr<v1::DaemonConfig> ReadDaemonConfig(const std::string& program_folder,
                                                  const std::string& config_file);

// The address at which a daemon of this configuration is asked; empty: there is none.
std::string FirstAddressOf(const v1::DaemonConfig& config);

// Adds findings on programs and their versions, ffmpeg, kernel, descriptors, the daemon, its state folder,
// its certificates and tokens. What cannot be looked at, because the user may not, is left out or a warning.
void ExamineInstallation(const InstallationOptions& options, v1::DoctorReport& report);

}  // namespace weft
