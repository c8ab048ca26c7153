// The sections of a job's report, each as HTML; empty where there is nothing to tell.
#pragma once

#include <string>
#include <vector>

#include "services/results/report/html_report.h"
#include "services/results/report/job_summary.h"

namespace weft {

class SequenceView;
struct JobReportParts;

std::string HeadSection(const v1::Job& job, const JobSummary& summary);
// The verdict of the job in a page about something else.
std::string JobVerdictSection(const JobReportParts& job);
std::string WarningSection(const v1::Job& job, const std::vector<std::string>& notes);
// Empty without frames.
std::string SequenceSection(const SequenceView& sequence, const std::vector<FramePictures>& pictures,
                            size_t frames_of_job);
std::string PictureSection(const std::vector<FramePictures>& pictures);
std::string PlotSection(const std::vector<v1::FrameReport>& frames);
std::string FrameSection(const std::vector<v1::FrameReport>& frames);
std::string CameraSection(const JobSummary& summary);
// Why cells are missing from the clouds.
std::string CellSection(const std::vector<v1::FrameReport>& frames);
// Of a joint template: each garment by itself.
std::string GarmentSection(const JobSummary& summary);
std::string AlignmentSection(const std::vector<v1::FrameReport>& frames);

// Scans by other methods, and what came of them; empty where no frame has one.
std::string ScanSection(const std::vector<v1::FrameReport>& frames);
std::string OptionSection(const v1::Job& job);
std::string InputSection(const v1::Job& job, const std::vector<v1::FrameReport>& frames);

// What a page runs.
struct PageProgram {
  std::string script;  // holds no "</script"
  std::string data;    // elements that it reads; they stand last, so that all else is shown before
};
// The whole page around `body`. It loads nothing and runs the program alone, whose hash its policy names.
// `title` is not escaped.
std::string Page(const std::string& title, const std::string& body, const PageProgram& program = {});
// <section> with its heading.
std::string Section(const std::string& id, const std::string& heading, const std::string& body);
// A table row of cells that are HTML already; "th" or "td".
std::string TableRow(const std::string& cell_tag, const std::vector<std::string>& cells);
// A table in a box that scrolls when it is long or wide. `numbers_from`: the first column aligned to the
// right.
std::string Table(const std::vector<std::string>& header, const std::string& rows,
                  const std::string& classes);

}  // namespace weft
