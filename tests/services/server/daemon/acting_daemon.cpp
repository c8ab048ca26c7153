// A real daemon process for tests that kill it: acting_daemon FOLDER WORKER. State, results and the address
// file lie in FOLDER.
#include <unistd.h>

#include <cstdio>

#include "services/server/daemon/program/daemon.h"
#include "tests/services/server/daemon/acting_inputs.h"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::string folder = argv[1];
  weft::DaemonOptions options;
  options.listen = {"127.0.0.1:0"};
  options.state_folder = folder + "/state";
  options.allow_paths = {folder};
  options.address_file = folder + "/address";
  options.worker_program = argv[2];
  options.workers = 1;
  options.load_inputs = weft::LoadActingInputs;
  const auto daemon = weft::Daemon::Start(options);
  if (!daemon.ok()) {
    std::fprintf(stderr, "%s\n", daemon.status().ToString().c_str());
    return 1;
  }
  for (;;) pause();
}
