// The sections about frames: plots over them, and their table.
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"
#include "services/results/report/plot.h"
#include "services/results/report/report_sections.h"

namespace weft {
namespace {

// Longer tables are folded away behind a short one of the frames that need a look.
constexpr size_t kLongTable = 40;
constexpr size_t kMostTroubled = 200;
constexpr size_t kLowest = 5;

std::string StateText(const v1::FrameReport& frame) {
  switch (frame.state()) {
    case v1::FRAME_STATE_DONE:
      return "<span class=\"state good\">&#10003; done</span>";
    case v1::FRAME_STATE_DEGRADED:
      return "<span class=\"state warn\">! degraded</span>";
    case v1::FRAME_STATE_FAILED:
      return frame.temporal().bridged() ? "<span class=\"state bad\">&#10005; bridged</span>"
                                        : "<span class=\"state bad\">&#10005; failed</span>";
    case v1::FRAME_STATE_CANCELLED:
      return "<span class=\"state\">cancelled</span>";
    case v1::FRAME_STATE_RUNNING:
      return "<span class=\"state\">running</span>";
    case v1::FRAME_STATE_WAITING:
      return "<span class=\"state\">waiting</span>";
    default:
      return "<span class=\"state bad\">? not recorded</span>";
  }
}

std::string Bar(double share) {
  const double percent = std::isfinite(share) ? std::clamp(100 * share, 0.0, 100.0) : 0;
  return absl::StrFormat("<i class=\"bar\"><i style=\"width:%.1f%%\"></i></i>", percent);
}

void AddRemark(const std::string& remark, std::string* text) {
  absl::StrAppend(text, text->empty() ? "" : "; ", remark);
}

// What the removal of self-intersections left, and whom it cost a measurement.
void AddUntangling(const v1::FrameReport& frame, std::string* text) {
  const v1::TemporalReport& temporal = frame.temporal();
  const bool again = temporal.refined() || temporal.bridged();
  const int pairs = again ? temporal.self_intersections() : frame.mesh().self_intersections();
  const int demoted = frame.mesh().demoted() + temporal.demoted();
  if (pairs > 0)
    AddRemark(absl::StrCat(Counted(pairs, "pair of faces intersects", "pairs of faces intersect")), text);
  if (demoted > 0)
    AddRemark(absl::StrCat(Counted(demoted, "observed vertex", "observed vertices"),
                           " moved to undo a self-intersection"),
              text);
}

std::string ReasonText(const v1::FrameReport& frame) {
  std::string reason = EscapeHtml(frame.reason());
  AddUntangling(frame, &reason);
  if (frame.set_aside()) {
    AddRemark("given up because its workers ended abnormally; a new job retries it", &reason);
  }
  return reason;
}

std::string FrameRow(const v1::FrameReport& frame) {
  const v1::MeshReport& mesh = frame.mesh();
  const bool registered = IsRegistered(frame.state());
  const int cameras = frame.views_used() + frame.views_missing();
  return TableRow(
      "td",
      {NameHtml(frame.frame()), StateText(frame),
       registered ? FormatPercent(mesh.coverage()) + Bar(mesh.coverage()) : kDash,
       registered ? absl::StrCat(FormatCount(mesh.observed()), " of ", FormatCount(mesh.vertices_with_cell()))
                  : kDash,
       frame.has_cloud() ? FormatCount(frame.cloud().centers()) : kDash,
       registered ? FormatNumber(mesh.median_observed_sigma_mm(), 3) : kDash,
       cameras > 0 ? absl::StrCat(FormatCount(frame.views_used()), " of ", FormatCount(cameras)) : kDash,
       frame.total_ms() > 0 ? FormatDuration(frame.total_ms()) : kDash, ReasonText(frame)});
}

std::string DrivenRow(const v1::FrameReport& frame) {
  const v1::DrivenReport& driven = frame.driven();
  const bool registered = IsRegistered(frame.state()) && frame.has_driven();
  const int cameras = frame.views_used() + frame.views_missing();
  std::string remark = ReasonText(frame);
  if (driven.started_anew()) AddRemark("found without the frame before", &remark);
  return TableRow(
      "td",
      {NameHtml(frame.frame()), StateText(frame),
       registered ? FormatCount(driven.rays() - driven.rejected_rays()) : kDash,
       registered ? FormatCount(driven.rejected_rays()) : kDash,
       registered ? FormatNumber(driven.residual_px(), 2) : kDash,
       registered ? FormatNumber(driven.median_sigma_mm(), 2) : kDash,
       cameras > 0 ? absl::StrCat(FormatCount(frame.views_used()), " of ", FormatCount(cameras)) : kDash,
       frame.total_ms() > 0 ? FormatDuration(frame.total_ms()) : kDash, remark});
}

bool AreDriven(const std::vector<const v1::FrameReport*>& frames) {
  return std::ranges::any_of(frames, [](const v1::FrameReport* f) { return f->has_driven(); });
}

std::string FrameTable(const std::vector<const v1::FrameReport*>& frames) {
  std::string rows;
  if (AreDriven(frames)) {
    for (const v1::FrameReport* frame : frames) rows += DrivenRow(*frame);
    return Table({"Frame", "State", "Rays", "Rays set aside", "Residual, px", "Sigma, mm", "Cameras", "Time",
                  "Remark"},
                 rows, "frames");
  }
  for (const v1::FrameReport* frame : frames) rows += FrameRow(*frame);
  return Table({"Frame", "State", "Coverage", "Observed cells", "Triangulated", "Sigma, mm", "Cameras",
                "Time", "Remark"},
               rows, "frames");
}

// Frames that are not simply done, and those with the lowest coverage; in their order.
std::vector<const v1::FrameReport*> FramesToLookAt(const std::vector<v1::FrameReport>& frames) {
  std::vector<size_t> done, chosen;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].state() == v1::FRAME_STATE_DONE) {
      done.push_back(i);
    } else if (chosen.size() < kMostTroubled) {
      chosen.push_back(i);
    }
  }
  std::ranges::stable_sort(done, [&](size_t a, size_t b) {
    if (frames[a].has_driven() && frames[b].has_driven())
      return frames[a].driven().median_sigma_mm() > frames[b].driven().median_sigma_mm();
    return frames[a].mesh().coverage() < frames[b].mesh().coverage();
  });
  done.resize(std::min(done.size(), kLowest));
  chosen.insert(chosen.end(), done.begin(), done.end());
  std::ranges::sort(chosen);
  std::vector<const v1::FrameReport*> result;
  for (const size_t i : chosen) result.push_back(&frames[i]);
  return result;
}

std::vector<PlotLayer> StageLayers(const std::vector<v1::FrameReport>& frames) {
  std::vector<PlotLayer> layers;
  for (size_t i = 0; i < frames.size(); ++i) {
    for (const v1::StageTime& stage : frames[i].stages()) {
      auto layer = std::ranges::find_if(layers, [&](const PlotLayer& l) { return l.name == stage.stage(); });
      if (layer == layers.end()) {
        layer = layers.insert(layers.end(), {stage.stage(), std::vector<double>(frames.size(), kNoNumber)});
      }
      double& value = layer->values[i];
      value = std::isfinite(value) ? value + stage.time_ms() : stage.time_ms();
    }
  }
  // Missing counts as no time where the frame has others, so that bars are whole means.
  for (PlotLayer& layer : layers) {
    for (size_t i = 0; i < frames.size(); ++i) {
      if (!std::isfinite(layer.values[i]) && frames[i].stages_size() > 0) layer.values[i] = 0;
    }
  }
  return layers;
}

}  // namespace

std::string PlotSection(const std::vector<v1::FrameReport>& frames) {
  if (frames.empty()) return "";
  PlotFrames axis;
  std::vector<double> coverage, cells, sigma_mm, rays, residual_px;
  bool is_driven = false;
  for (const v1::FrameReport& frame : frames) {
    const bool registered = IsRegistered(frame.state());
    axis.names.push_back(frame.frame());
    axis.without_mesh.push_back(!registered);
    coverage.push_back(registered ? frame.mesh().coverage() : kNoNumber);
    cells.push_back(frame.has_cloud() ? frame.cloud().centers() : kNoNumber);
    const bool has_driven = registered && frame.has_driven();
    is_driven = is_driven || has_driven;
    rays.push_back(has_driven ? frame.driven().rays() - frame.driven().rejected_rays() : kNoNumber);
    residual_px.push_back(has_driven ? frame.driven().residual_px() : kNoNumber);
    sigma_mm.push_back(!registered  ? kNoNumber
                       : has_driven ? frame.driven().median_sigma_mm()
                                    : frame.mesh().median_observed_sigma_mm());
  }
  std::string body = "<div class=\"plots\">\n";
  if (is_driven) {
    body += LinePlot(axis, rays, {.title = "Rays: cells seen by a camera that the mesh follows"});
    body += LinePlot(axis, residual_px, {.title = "Residual, median, px", .unit = "px", .decimals = 2});
    body +=
        LinePlot(axis, sigma_mm, {.title = "Sigma of all vertices, median, mm", .unit = "mm", .decimals = 2});
  } else {
    body += LinePlot(axis, coverage,
                     {.title = "Coverage: observed share of the cells", .unit = "%", .from_zero = false});
    body += LinePlot(axis, cells, {.title = "Triangulated cells"});
    body += LinePlot(axis, sigma_mm,
                     {.title = "Sigma of observed vertices, median, mm", .unit = "mm", .decimals = 3});
  }
  const std::vector<PlotLayer> layers = StageLayers(frames);
  if (!layers.empty()) body += StackedPlot(axis, layers, {.title = "Time per stage"});
  const bool any_lost = std::ranges::find(axis.without_mesh, true) != axis.without_mesh.end();
  const std::string note = any_lost ? "<p>Red triangles mark frames without a mesh.</p>\n" : "";
  return Section("plots", "Over the frames", body + "</div>\n" + note);
}

std::string FrameSection(const std::vector<v1::FrameReport>& frames) {
  if (frames.empty()) return Section("frames", "Frames", "<p>No frame has a report.</p>\n");
  std::vector<const v1::FrameReport*> all;
  for (const v1::FrameReport& frame : frames) all.push_back(&frame);
  if (frames.size() <= kLongTable) return Section("frames", "Frames", FrameTable(all));
  const std::vector<const v1::FrameReport*> troubled = FramesToLookAt(frames);
  const auto not_done = std::ranges::count_if(
      frames, [](const v1::FrameReport& frame) { return frame.state() != v1::FRAME_STATE_DONE; });
  std::string body = absl::StrCat("<p>Frames that are not simply done, and those with the ",
                                  AreDriven(all) ? "largest sigma" : "lowest coverage");
  if (static_cast<size_t>(not_done) > kMostTroubled) {
    absl::StrAppend(&body, " (the first ", kMostTroubled, " of ", FormatCount(not_done), ")");
  }
  absl::StrAppend(&body, ":</p>\n", FrameTable(troubled), "<details><summary>All ",
                  FormatCount(static_cast<int64_t>(frames.size())), " frames</summary>\n", FrameTable(all),
                  "</details>\n");
  return Section("frames", "Frames", body);
}

}  // namespace weft
