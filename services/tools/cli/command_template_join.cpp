// weft template join: the garments of one take as one template.
#include <cstdio>
#include <string>
#include <vector>

#include "alignment/joint_template.h"
#include "alignment/template_check.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/template_file.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/output_guard.h"
#include "services/tools/cli/template_summary.h"

namespace weft {
namespace {

struct TemplateJoinOptions {
  std::vector<std::string> templates;
  std::string board;
  std::string out;
  std::string id;
  OutputGuard guard;
};

absl::Status JoinTemplateFiles(const TemplateJoinOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const Board board, ReadBoard(options.board));
  std::vector<Template> garments;
  std::vector<GarmentParts> parts;
  for (const std::string& path : options.templates) {
    WEFT_ASSIGN_OR_RETURN(Template garment, ReadTemplate(path));
    WEFT_ASSIGN_OR_RETURN(GarmentParts of_garment, ReadGarmentParts(path));
    garments.push_back(std::move(garment));
    parts.push_back(std::move(of_garment));
  }
  WEFT_ASSIGN_OR_RETURN(
      const JointTemplate joint,
      JoinTemplates(options.id.empty() ? TemplateIdOf(options.out) : options.id, garments, parts, board));
  WEFT_ASSIGN_OR_RETURN(const TemplateSize size,
                        CheckTemplateOnBoard(joint.garment, board, joint.parts.any_scale));
  for (const auto* notes : {&size.off, &size.unchecked})
    for (const std::string& note : *notes) PrintWarning(note);
  WEFT_RETURN_IF_ERROR(MayWriteTemplate(options.out, joint.garment, options.guard));
  WEFT_RETURN_IF_ERROR(WriteTemplateWithParts(options.out, joint.garment, joint.parts, "weft template join"));
  std::printf("%s/template.json: %zu vertices, %zu faces, hash %s\n", options.out.c_str(),
              joint.garment.rest.vertices_mm.size(), joint.garment.rest.faces.size(),
              joint.garment.ContentHash().c_str());
  for (const GarmentSpan& one : joint.garment.garments)
    std::printf("  vertices %d to %d: %s\n", one.first_vertex, one.first_vertex + one.vertices - 1,
                one.id.c_str());
  return absl::OkStatus();
}

}  // namespace

void AddTemplateJoinCommand(CLI::App& garment, CommandLine& line) {
  const auto [command, options] = AddCommand<TemplateJoinOptions>(
      garment, line, JoinTemplateFiles, "join",
      "Make one template of the garments that a take shows together. The boards that they were "
      "sewn from must be parts of the joint board. Meshes of all garments are registered at once, "
      "and do not pass through each other; exports and evaluation show them together and apart.",
      "  weft pattern join skirt_board shirt_board --out outfit_board\n"
      "  weft template join skirt shirt --board outfit_board --out outfit");
  AddRequired(*command, "TEMPLATE", options->templates,
              "Folders of two templates or more, from the innermost garment to the outermost");
  AddRequired(*command, "--board BOARD", options->board, "The joint board of `weft pattern join`");
  AddRequired(*command, "--out DIR", options->out, "Folder to write to");
  options->guard.AddTo(*command);
  AddOption(*command, "--id NAME", options->id, "Name of the template; by default that of the folder");
}

}  // namespace weft
