#include "services/tools/cli/input_options.h"

#include "services/ground/process/command_option.h"

namespace weft {

void AddFramesOption(CLI::App& command, std::string& frames, const std::string& about,
                     const std::string& old_name) {
  AddOption(
      command, "--frames RANGE", frames,
      about + ": a frame by its name, 0003, or a range A:B, B not included; either side may be left out");
  if (!old_name.empty()) command.add_option(old_name, frames)->group("")->excludes("--frames");
}

void AddMosaicOption(CLI::App& command, std::string& mosaic) {
  AddOption(command, "--mosaic ORDER", mosaic,
            "Grey images are a Bayer mosaic of this order: bayer_rg8, bayer_gr8, bayer_gb8 or bayer_bg8");
}

}  // namespace weft
