// Options that mean the same in every command that reads images.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace weft {

// --frames NAME or A:B, as FindFrameRange (capture/take/frame_range.h) reads it; `about` is what is done with
// them. `old_name`, e.g. "--frame", is still read and not shown in the help; empty for none.
void AddFramesOption(CLI::App& command, std::string& frames, const std::string& about,
                     const std::string& old_name = "");

// --mosaic ORDER, as MosaicFromName (capture/image/mosaic.h) reads it.
void AddMosaicOption(CLI::App& command, std::string& mosaic);

}  // namespace weft
