#include "services/tools/cli/installation_options.h"

#include <unistd.h>

#include "services/tools/cli/command_line.h"

namespace weft {

void AddInstallationOptions(CLI::App& command, InstallationOptions& options) {
  constexpr char kInstalled[] = "/etc/weft/weftd.txtpb";
  options.program_folder = OwnProgramFolder();
  if (access(kInstalled, R_OK) == 0) options.config_file = kInstalled;
  AddOption(command, "--config FILE", options.config_file,
            "The daemon's file of options, which says where its state and certificates are");
  AddServerOption(command, options.server,
                  "unix:PATH or HOST:PORT of the daemon; that of --config by default");
}

}  // namespace weft
