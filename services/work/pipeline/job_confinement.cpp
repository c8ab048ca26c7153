#include "services/work/pipeline/job_confinement.h"

#include "services/work/pipeline/frame_files.h"

namespace weft {

Confinement ConfinementOf(const v1::RegistrationSpec& spec, const LinkRules& links) {
  Confinement confinement;
  const v1::RegistrationOptions& options = spec.options();
  for (const std::string* input : {&spec.dump(), &spec.rig(), &spec.board(), &spec.garment(),
                                   &options.scans(), &options.starts(), &spec.driving().avatar()}) {
    if (!input->empty()) confinement.readable.push_back(*input);
  }
  if (!spec.out().empty()) confinement.writable.push_back(spec.out());
  confinement.links = links;
  confinement.may_run_programs = !options.scans().empty() || WantsPcd(options);
  return confinement;
}

}  // namespace weft
