#include "services/evaluation/evaluation_report.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "services/evaluation/evaluation_sections.h"
#include "services/evaluation/evaluation_text.h"
#include "services/files/atomic_file.h"
#include "services/report/report_sections.h"

namespace weft {

std::string MakeEvaluationReport(const JobEvaluation& evaluation) {
  return Page("Weft evaluation", absl::StrCat(EvaluationHead(evaluation), PaperSection(evaluation),
                                              MapSection(evaluation), VisibilitySection(evaluation),
                                              FramePlotSection(evaluation), FrameTableSection(evaluation),
                                              CameraTableSection(evaluation), RemarkSection(evaluation)));
}

absl::Status WriteEvaluation(const std::string& folder, const JobEvaluation& evaluation) {
  const absl::StatusOr<std::string> json = EvaluationJson(evaluation);
  if (!json.ok()) return json.status();
  absl::Status status = CreateFolders(folder);
  const auto write = [&](const char* name, const std::string& text) {
    if (status.ok()) status = WriteFileAtomically((std::filesystem::path(folder) / name).string(), text);
  };
  write("frames.csv", FrameCsv(evaluation));
  write("cameras.csv", CameraCsv(evaluation));
  write("evaluation.json", *json);
  write("report.html", MakeEvaluationReport(evaluation));
  return status;
}

}  // namespace weft
