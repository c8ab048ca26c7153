// A folder with programs that say what a test has them say, in the place of an installation.
#pragma once

#include <sys/stat.h>

#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {

class InstalledPrograms {
 public:
  InstalledPrograms() {
    for (const char* name : {"weft", "weftd", "weft-worker", "weft-recorder", "weft-video"})
      Put(name, std::string(name) + " " WEFT_VERSION);
    WriteBytes(config(), "state: \"/nowhere\"\n");
  }

  std::string path() const { return folder_ / "bin"; }
  std::string config() const { return folder_ / "weftd.txtpb"; }

  // It says this with --version; weftd prints the file of --config as it is, where `exit_status` is 0.
  void Put(const std::string& name, const std::string& version, int exit_status = 0) {
    const std::string file = path() + "/" + name;
    WriteBytes(file,
               "#!/bin/sh\nif [ \"$1 $3\" = \"--config --print-config\" ]; then cat \"$2\"; else echo '" +
                   version + "'; fi\nexit " + std::to_string(exit_status) + "\n");
    chmod(file.c_str(), 0755);
  }

 private:
  const TempFolder folder_;
};

}  // namespace weft
