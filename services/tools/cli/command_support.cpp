// weft support: a file for whoever helps.
#include <cstdio>
#include <memory>

#include "absl/strings/str_join.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/installation_options.h"
#include "services/tools/installation/support_bundle.h"

namespace weft {

void AddSupportCommand(CLI::App& app, CommandLine& line) {
  const auto options = std::make_shared<SupportOptions>();
  CLI::App* support = AddCommand(app, "support",
                                 "Pack versions, options, the doctor's report, the end of the log, lists of "
                                 "jobs and takes, and facts of the machine into one file for whoever helps. "
                                 "Tokens, keys, leases, pictures and results are not in it.",
                                 "  weft support --out weft-support.tar.zst\n"
                                 "  weft support --config weftd.txtpb --out weft-support.tar.gz");
  AddRequired(*support, "--out FILE", options->out, "The file, .tar.zst or .tar.gz");
  AddOption(*support, "--log-lines N", options->journal_lines, "How much of the service's log",
            CLI::Range(0, 1000000));
  AddInstallationOptions(*support, options->installation);
  RunWith(*support, line, options, [](const SupportOptions& asked) -> absl::Status {
    WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> names, WriteSupportBundle(asked));
    std::printf("%s has %s\n", asked.out.c_str(), absl::StrJoin(names, ", ").c_str());
    return absl::OkStatus();
  });
}

}  // namespace weft
