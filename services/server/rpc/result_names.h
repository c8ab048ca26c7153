// The files of a job's results, by kind.
#pragma once

#include <string>

#include "weft/v1/jobs.pb.h"

namespace weft {

// The file's name in a folder of results, e.g. "mesh.ply" or "report.html".
std::string ResultFileName(v1::ResultKind kind);

}  // namespace weft
