// Makes the kind known to the program that it is linked into.
#include "copy_meshes.h"

namespace weft {
namespace {

[[maybe_unused]] const bool kIsAdded = [] {
  AddKind(MakeCopyMeshes());
  return true;
}();

}  // namespace
}  // namespace weft
