// A comparison of two results as one self-contained HTML page, and all files of `weft evaluate --against
// --out`.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "services/results/evaluation/compare_jobs.h"
#include "services/results/report/garment_map.h"
#include "services/results/report/overlaid_plot.h"
#include "weft/v1/page.pb.h"

namespace weft {

// The table of measures with significance, what differs in the jobs, maps of the differences on the garment,
// overlaid plots over the frames, cameras, remarks. The same bytes for the same comparison.
// `meshes` are those of ComparisonSequence, with its notes.
std::string MakeComparisonReport(const JobComparison& comparison, const v1::PageSequence* meshes = nullptr,
                                 const std::vector<std::string>& notes = {});

// <folder>/{comparison.json,measures.csv,frames.csv,cameras.csv,vertices.csv,report.html}, a plot per measure
// in <folder>/plots and a map per difference in <folder>/maps, as SVG; the folder is made where it is
// missing. Files of measures that are not there are not written. Errors of WriteFileAtomically.
absl::Status WriteComparison(const std::string& folder, const JobComparison& comparison);

// A plot of both results over the frames.
struct ComparisonPlot {
  std::string name;  // of its file, without ending
  PlotText text;
  std::vector<PlotSeries> series;
};
// One per measure, and the distance of the meshes. A measure with one value for all frames has none.
std::vector<ComparisonPlot> ComparisonPlots(const JobComparison& comparison);
PlotFrames ComparisonFrames(const JobComparison& comparison);

// Differences to be painted on the garment, with the name of their file.
std::vector<std::pair<std::string, GarmentMap>> ComparisonMaps(const JobComparison& comparison);

}  // namespace weft
