// The alignment as config/paper.txtpb has it.
#pragma once

#include "services/formats/options/presets.h"

namespace weft::testing {

inline AlignOptions PaperAlignment() { return ReadOptions(*PresetOptions("paper"))->alignment; }

}  // namespace weft::testing
