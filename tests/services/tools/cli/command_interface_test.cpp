// The commands against tests/data/cli: scripts rely on names, values and defaults.
#include "tests/services/tools/cli/command_interface.h"

#include <gtest/gtest.h>

#include <string>

#include "services/tools/cli/command_line.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

// A file each, NAME.txt.
const std::pair<std::string, void (*)(CLI::App&, CommandLine&)> kCommands[] = {
    {"access", AddAccessCommand},     {"align", AddAlignCommand},
    {"avatar", AddAvatarCommand},     {"body", AddBodyCommand},
    {"camera", AddCameraCommand},     {"daemon", AddDaemonCommand},
    {"dataset", AddDatasetCommand},   {"decode", AddDecodeCommand},
    {"doctor", AddDoctorCommand},     {"evaluate", AddEvaluateCommand},
    {"export", AddExportCommand},     {"garment", AddGarmentCommand},
    {"job", AddJobCommand},           {"library", AddLibraryCommand},
    {"motion", AddMotionCommand},     {"operation", AddOperationCommand},
    {"options", AddOptionsCommand},   {"pattern", AddPatternCommand},
    {"register", AddRegisterCommand}, {"rig", AddRigCommand},
    {"session", AddSessionCommand},   {"simulate", AddSimulateCommand},
    {"split", AddSplitCommand},       {"support", AddSupportCommand},
    {"take", AddTakeCommand},         {"template", AddTemplateCommand},
};

// A change that is meant is made in the file, too. New options may come; what is there stays.
TEST(CommandInterface, IsAsScriptsKnowIt) {
  for (const auto& [name, add] : kCommands) {
    CLI::App app("Weft", "weft");
    CommandLine line;
    add(app, line);
    std::string text;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
      text += InterfaceOf(*command, command->get_name());
    EXPECT_EQ(text, ReadBytes(absl::StrCat(WEFT_SOURCE_DIR "/tests/data/cli/", name, ".txt"))) << name;
  }
}

}  // namespace
}  // namespace weft
