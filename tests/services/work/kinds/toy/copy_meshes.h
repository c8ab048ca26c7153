// A kind of work for tests: it copies the meshes of a result, one after another.
#pragma once

#include <memory>

#include "services/work/kinds/unit_kind.h"

namespace weft {

// Its versions are an argument, so that a test can raise them.
std::unique_ptr<UnitKind> MakeCopyMeshes(int version = 1);

}  // namespace weft
