// Which files a registration uses.
#pragma once

#include "services/ground/confinement/confinement.h"
#include "weft/v1/job.pb.h"

namespace weft {

// Reads the inputs of `spec`, whose paths are absolute and without links, and writes below spec.out. Programs
// may be run where scans or clouds need PCL's.
Confinement ConfinementOf(const v1::RegistrationSpec& spec, const LinkRules& links);

}  // namespace weft
