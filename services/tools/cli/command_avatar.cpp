// weft avatar: what a garment was captured doing, so that a few cameras suffice to follow it.
#include <memory>
#include <string>

#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/work/animation/avatar_text.h"
#include "services/work/animation/pixel_avatar_file.h"

namespace weft {
namespace {

void AddShowCommand(CLI::App& avatar, CommandLine& line) {
  CLI::App* command = AddCommand(avatar, "show",
                                 "Tell what an avatar was trained on, how large it is, and how well it "
                                 "explains frames that it did not learn from. Checks its files on the way.",
                                 "  weft avatar show shirt.avatar");
  struct ShowOptions {
    std::string path;
    bool json = false;
  };
  auto options = std::make_shared<ShowOptions>();
  AddRequired(*command, "avatar DIR", options->path, "The avatar's folder");
  command->add_flag("--json", options->json, "Print JSON (weft.v1.Avatar)");
  command->callback([options, &line] {
    line.confined = {.readable = {options->path}};
    line.run = [options]() -> absl::Status {
      WEFT_ASSIGN_OR_RETURN(const v1::Avatar about, ReadAnyAvatar(options->path));
      return PrintMessage(about, options->json, AvatarText(options->path, about));
    };
  });
}

}  // namespace

void AddAvatarCommand(CLI::App& app, CommandLine& line) {
  CLI::App* avatar = AddGroup(
      app, "avatar",
      "Garments that were captured before: learn what they do, and follow them with two or three cameras.",
      "  weft avatar train walk/result jog/result --out shirt.avatar\n"
      "  weft avatar drive DUMP --avatar shirt.avatar --rig rig.json --board board.json --template shirt "
      "--out result\n"
      "  weft evaluate shirt-drive --avatar shirt.avatar");
  AddAvatarTrainCommand(*avatar, line);
  AddAvatarDriveCommand(*avatar, line);
  AddShowCommand(*avatar, line);
}

}  // namespace weft
