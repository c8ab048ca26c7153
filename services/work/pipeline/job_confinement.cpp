#include "services/work/pipeline/job_confinement.h"

#include "services/work/pipeline/frame_files.h"
#include "services/work/spec/job_input.h"

namespace weft {

Confinement ConfinementOf(const v1::RegistrationSpec& spec, const LinkRules& links) {
  Confinement confinement;
  const v1::RegistrationOptions& options = spec.options();
  for (const JobInput& input : InputsOf(spec)) {
    if (!input.path.empty()) confinement.readable.push_back(input.path);
  }
  if (!spec.out().empty()) confinement.writable.push_back(spec.out());
  confinement.links = links;
  confinement.may_run_programs = !options.scans().empty() || WantsPcd(options);
  return confinement;
}

}  // namespace weft
