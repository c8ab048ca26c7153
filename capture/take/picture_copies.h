// Names that programs give to copies, and to pictures in folders of their own name.
#pragma once

#include <string>
#include <string_view>

namespace weft {

// The name without ending of which this one is a copy, as browsers and desktops name them: "c01" of "c01
// (1)", "c01(1)", "c01 - Copy", "c01 - Copy (2)", "c01 copy 2", "Copy of c01" and "c01 - Kopie". Empty: of
// none.
std::string OriginalOfCopy(std::string_view name);

// "0007" of "c01_0007" and "0007-c01" in the folder "c01"; empty where a name does not repeat it.
std::string NameWithoutFolder(std::string_view name, std::string_view folder);

}  // namespace weft
