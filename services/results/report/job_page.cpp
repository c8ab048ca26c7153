#include "services/results/report/job_page.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/formats/files/json_file.h"
#include "services/formats/options/option_range.h"
#include "services/formats/options/presets.h"
#include "services/results/report/html_text.h"
#include "services/results/report/job_report.h"
#include "services/results/report/job_summary.h"
#include "services/results/report/job_verdict.h"
#include "services/results/report/page.h"
#include "services/results/report/paper_table.h"
#include "services/results/report/picture_data.h"
#include "weft/v1/take.pb.h"

namespace weft {
namespace {

// The options have a list of their own; who asked for the job, and what it took, is no part of its report.
v1::Job ShownJob(const v1::Job& job, const std::vector<v1::FrameReport>& frames) {
  v1::Job shown = job;
  shown.mutable_spec()->mutable_options()->clear_pipeline();
  shown.mutable_spec()->clear_expected();
  shown.clear_request_hash();
  shown.clear_submitted_by();
  shown.clear_usage();
  shown.clear_items();
  shown.clear_task_logs();
  const bool is_over = job.state() != v1::JOB_STATE_QUEUED && job.state() != v1::JOB_STATE_RUNNING;
  if (!is_over) {
    shown.clear_verdict();
  } else if (job.verdict().grade() == v1::GRADE_UNSPECIFIED) {
    *shown.mutable_verdict() = AssessJob(job, frames);
  }
  return shown;
}

void SetFigures(const JobSummary& summary, v1::JobFigures& figures) {
  figures.set_registered(summary.registered);
  figures.set_coverage(summary.coverage);
  figures.set_lowest_coverage(summary.lowest_coverage);
  figures.set_lowest_coverage_frame(summary.lowest_coverage_frame);
  figures.set_highest_coverage(summary.highest_coverage);
  figures.set_median_cells(summary.median_cells);
  figures.set_driven(summary.is_driven);
  figures.set_median_rays(summary.median_rays);
  figures.set_median_residual_px(summary.median_residual_px);
  figures.set_median_sigma_mm(summary.median_sigma_mm);
  figures.set_median_frame_ms(summary.median_frame_ms);
  figures.set_peak_memory_mib(summary.peak_memory_mib);
  figures.set_wall_ms(summary.wall_ms);
  figures.set_unknown_cameras(static_cast<int>(summary.facts.unknown.size()));
}

// Views are what is large, and are summed up as cameras.
v1::FrameReport ShownFrame(const v1::FrameReport& frame) {
  v1::FrameReport shown;
  shown.set_frame(frame.frame());
  shown.set_state(frame.state());
  shown.set_reason(frame.reason());
  shown.set_set_aside(frame.set_aside());
  shown.set_views_used(frame.views_used());
  shown.set_views_missing(frame.views_missing());
  shown.set_total_ms(frame.total_ms());
  shown.set_threads(frame.threads());
  *shown.mutable_stages() = frame.stages();
  if (frame.has_cloud()) *shown.mutable_cloud() = frame.cloud();
  if (frame.has_mesh()) *shown.mutable_mesh() = frame.mesh();
  if (frame.has_temporal()) *shown.mutable_temporal() = frame.temporal();
  if (frame.has_driven()) *shown.mutable_driven() = frame.driven();
  if (frame.has_driven()) shown.mutable_driven()->clear_memory();
  return shown;
}

void AddOverlaps(const JobSummary& summary, v1::JobPage& page) {
  for (const auto& [pair, frames] : summary.overlaps) {
    v1::PageOverlap& overlap = *page.add_overlaps();
    overlap.set_inner(pair.first);
    overlap.set_outer(pair.second);
    overlap.set_frames(frames);
  }
}

void AddOptions(const v1::Job& job, v1::JobPage& page) {
  const v1::RegistrationOptions& options = job.spec().options();
  page.set_preset(options.preset().empty() ? kDefaultPreset : options.preset());
  const absl::StatusOr<v1::PipelineOptions> preset = PresetOptions(options.preset());
  if (!preset.ok()) return;
  for (const OptionField& option : AllOptions()) {
    const std::string value = OptionValue(options.pipeline(), option);
    if (value.empty() || option.IsGroup()) continue;
    v1::PageOption& added = *page.add_options();
    added.set_path(option.path);
    added.set_value(value);
    added.set_preset(OptionValue(*preset, option));
    added.set_meaning(option.About().text());
  }
}

void AddAlgorithms(const std::vector<v1::FrameReport>& frames, v1::JobPage& page) {
  for (const v1::FrameReport& frame : frames)
    for (const v1::StageKey& key : frame.keys()) {
      if (key.version() == 0) continue;
      const std::string algorithm = absl::StrCat(Words(key.stage()), " ", key.version());
      if (std::ranges::find(page.algorithms(), algorithm) == page.algorithms().end())
        page.add_algorithms(algorithm);
    }
}

// Where the dump is a take and says so.
void AddTake(const v1::Job& job, v1::JobPage& page) {
  v1::Take take;
  if (job.spec().has_work() || !ReadJsonFile(job.spec().dump() + "/take.json", take).ok()) return;
  for (const auto& [name, text] : {std::pair{"Slate", &take.slate()},
                                   {"Take", &take.name()},
                                   {"Notes", &take.notes()},
                                   {"Timecode", &take.timecode()}}) {
    if (text->empty()) continue;
    v1::NamedValue& fact = *page.add_take();
    fact.set_name(name);
    fact.set_value(*text);
  }
}

void SetPictures(const FramePictures& frame, v1::PageFramePictures& data) {
  data.set_frame(frame.frame);
  data.set_why_shown(frame.why_shown);
  AddPictures(frame.by_state, *data.mutable_by_state());
  *data.mutable_state_key() = StateKey({VertexState::kObserved, VertexState::kTwoView,
                                        frame.is_driven ? VertexState::kDriven : VertexState::kInferred});
  AddPictures(frame.by_sigma, *data.mutable_by_sigma());
  *data.mutable_sigma_key() = ScaleKey(frame.sigma_range_mm, "sigma", "mm");
  AddPictures(frame.in_images, *data.mutable_in_images());
}

// Stands for the sequence where it cannot be shown.
void SetStill(const std::vector<FramePictures>& pictures, v1::PageSequence& sequence) {
  const auto shown =
      std::ranges::find_if(pictures, [](const FramePictures& frame) { return !frame.by_state.empty(); });
  if (shown == pictures.end()) return;
  *sequence.mutable_still() = PictureData(shown->by_state[0]);
  sequence.mutable_still()->set_title(absl::StrCat("Frame ", shown->frame, ", colours: state"));
}

}  // namespace

v1::JobPage JobPageOf(JobReportParts parts) {
  const JobSummary summary = Summarize(parts.job, parts.frames);
  v1::JobPage page;
  *page.mutable_job() = ShownJob(parts.job, parts.frames);
  page.set_headline(Headline(parts.job, summary));
  for (std::string& remark : Remarks(parts.job, summary)) page.add_remarks(std::move(remark));
  for (std::string& note : parts.notes) page.add_notes(std::move(note));
  SetFigures(summary, *page.mutable_figures());
  for (const v1::FrameReport& frame : parts.frames) *page.add_frames() = ShownFrame(frame);
  *page.mutable_cameras() = {summary.cameras.begin(), summary.cameras.end()};
  *page.mutable_garments() = {summary.garments.begin(), summary.garments.end()};
  AddOverlaps(summary, page);
  AddOptions(parts.job, page);
  AddAlgorithms(parts.frames, page);
  AddTake(parts.job, page);
  for (const FramePictures& frame : parts.pictures) SetPictures(frame, *page.add_pictures());
  if (parts.sequence.frames_size() > 0) {
    *page.mutable_sequence() = std::move(parts.sequence);
    SetStill(parts.pictures, *page.mutable_sequence());
  }
  AddPaperTable(*page.mutable_paper());
  return page;
}

std::string MakeJobReport(JobReportParts parts) {
  const v1::JobPage page = JobPageOf(std::move(parts));
  return MakePage({.title = page.headline(), .kind = "job", .data = {{"job", &page}}});
}

}  // namespace weft
