// What whoever helps an administrator wants to know, in one file.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/tools/installation/installation_check.h"

namespace weft {

struct SupportOptions {
  InstallationOptions installation;
  std::string out;           // .tar.zst or .tar.gz
  int journal_lines = 5000;  // of the service's log
};

// Packs versions, options in force, the doctor's report, the log's end, lists of jobs, takes and operations,
// the catalogue's check and the machine: texts alone, from which secrets were removed. Never access.json,
// leases, keys, pictures or results. Returns the names of the files; what could not be had is a file that
// says why. InvalidArgument: the name of `out`. Errors of WriteFileAtomically besides.
absl::StatusOr<std::vector<std::string>> WriteSupportBundle(const SupportOptions& options);

}  // namespace weft
