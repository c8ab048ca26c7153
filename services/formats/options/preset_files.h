// Files of config/ that are part of the program.
#pragma once

namespace weft {

extern const char kPaperFile[];  // config/paper.txtpb

}  // namespace weft
