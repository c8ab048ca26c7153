#include "alignment/template_build/build_template.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/mesh_graph.h"
#include "alignment/template_build/cell_grid.h"
#include "alignment/template_build/chart_packing.h"
#include "alignment/template_build/corner_vertices.h"
#include "alignment/template_build/mesh_topology.h"
#include "alignment/template_build/seam_rows.h"
#include "alignment/template_build/template_checks.h"
#include "alignment/template_build/zipper.h"
#include "base/median.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr int kTextureGapCells = 4;  // between the panels in the texture

// Borders look like a seam up to so many times its greatest gap, along so many points.
constexpr double kNearSeamFactor = 3;
constexpr int kNearSeamPoints = 15;

constexpr double kPitchDoubt = 0.05;   // share by which board and clouds may differ without a word
constexpr double kPitchRefusal = 0.3;  // and beyond which they do not belong together

// Builds one template; each step adds to `built_`.
class Builder {
 public:
  Builder(const Board& board, const TemplateSources& sources, const TemplateBuildOptions& options,
          const std::function<void(double)>& on_progress)
      : board_(board), sources_(sources), options_(options), on_progress_(on_progress) {}

  absl::StatusOr<BuiltTemplate> Run() {
    Report(0);
    absl::Status status = ReadClouds();
    if (status.ok()) status = FindSheet();
    if (status.ok()) status = LiftPanels();
    if (status.ok()) status = Sew();
    if (status.ok()) status = CloseHoles();
    if (status.ok()) status = LayToRest();
    if (!status.ok()) return status;
    Report(1);
    return std::move(built_);
  }

 private:
  void Report(double share) const {
    if (on_progress_) on_progress_(share);
  }
  std::string CloudName(size_t i) const {
    return i < sources_.cloud_names.size() ? sources_.cloud_names[i] : absl::StrCat("cloud ", i + 1);
  }

  absl::Status ReadClouds() {
    if (sources_.clouds.empty()) {
      return absl::InvalidArgumentError("a template is built from clouds, give at least one");
    }
    std::vector<double> pitches_mm;
    for (size_t i = 0; i < sources_.clouds.size(); ++i) {
      absl::StatusOr<CellGrid> grid = GridFromCloud(sources_.clouds[i], board_.rows, board_.cols);
      if (!grid.ok()) {
        return absl::Status(grid.status().code(), absl::StrCat(CloudName(i), ": ", grid.status().message()));
      }
      pitches_mm.push_back(MeasuredPitchMm(*grid));
      grids_.push_back(*std::move(grid));
    }
    built_.measured_pitch_mm = Median(std::move(pitches_mm));
    if (!(built_.measured_pitch_mm > 0)) {
      return absl::FailedPreconditionError("the clouds show no two cells side by side");
    }
    built_.parts.cell_mm = board_.cell_mm > 0 ? board_.cell_mm : built_.measured_pitch_mm;
    const double off = built_.measured_pitch_mm / built_.parts.cell_mm - 1;
    const std::string pitches =
        absl::StrCat("cells are ", std::round(100 * built_.measured_pitch_mm) / 100,
                     " mm apart in the clouds and ", board_.cell_mm, " mm on the board");
    if (std::abs(off) > kPitchRefusal) {
      return absl::InvalidArgumentError(
          absl::StrCat(pitches, "; do they belong together, and is the rig's scale right?"));
    }
    if (std::abs(off) > kPitchDoubt) {
      built_.warnings.push_back(absl::StrCat(pitches, ": was the cloth printed at this scale?"));
    }
    for (CellGrid& grid : grids_) {
      built_.contradicting_points += ForgetContradictions(built_.parts.cell_mm, &grid);
    }
    return absl::OkStatus();
  }

  absl::Status FindSheet() {
    WEFT_ASSIGN_OR_RETURN(
        const BoardPanels panels,
        sources_.panel_labels.empty()
            ? FindPanels(grids_, built_.parts.cell_mm, options_.panels)
            : PanelsFromLabels(sources_.panel_labels, grids_, built_.parts.cell_mm, options_.panels));
    built_.filled_cells = panels.filled_cells;
    built_.speck_cells = panels.speck_cells;
    WEFT_ASSIGN_OR_RETURN(PanelSheet sheet,
                          MakePanelSheet(panels, built_.parts.cell_mm, options_.panels.min_panel_cells));
    built_.sheet = std::move(sheet);
    built_.parts.panels = DescribePanels(built_.sheet);
    return absl::OkStatus();
  }

  // Lifts the clouds that show most; the first that shows all panels becomes the reference.
  absl::Status LiftPanels() {
    std::vector<int> order(grids_.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return grids_[a].SeenCells() > grids_[b].SeenCells(); });
    order.resize(std::min<size_t>(order.size(), options_.max_clouds));
    const PanelLifter lifter(built_.sheet);
    int reference = -1;
    std::vector<bool> ever_placed(built_.sheet.panels, false);
    for (size_t i = 0; i < order.size(); ++i) {
      Report(0.1 + 0.4 * static_cast<double>(i) / order.size());
      absl::StatusOr<LiftedPanels> lifted = lifter.Lift(grids_[order[i]], built_.parts.cell_mm);
      if (absl::IsFailedPrecondition(lifted.status())) continue;
      if (!lifted.ok()) return lifted.status();
      for (int p = 0; p < built_.sheet.panels; ++p) {
        if (lifted->panel_placed[p]) ever_placed[p] = true;
      }
      const bool complete = std::find(lifted->panel_placed.begin(), lifted->panel_placed.end(), false) ==
                            lifted->panel_placed.end();
      if (!complete) continue;
      if (reference < 0) reference = order[i];
      lifts_.push_back(*std::move(lifted));
    }
    if (reference >= 0) {
      built_.reference = reference;
      return absl::OkStatus();
    }
    for (int p = 0; p < built_.sheet.panels; ++p) {
      if (ever_placed[p]) continue;
      return absl::FailedPreconditionError(
          absl::StrCat("no cloud shows enough of ", PanelText(built_.parts.panels, p),
                       " to locate it; add one, or leave it out of --panels"));
    }
    return absl::FailedPreconditionError(
        "no cloud shows all panels together; add one of a pose in which all of them are in sight");
  }

  // Finds seams, closes them, and repeats for parts that were out of reach before, like a zipper. Where no
  // camera sees a seam, the lifted panels may end far apart.
  absl::Status Sew() {
    constexpr int kMostRounds = 5;
    int open_points = 0;
    for (int round = 0;; ++round) {
      Report(0.5 + 0.3 * round / kMostRounds);
      const PanelBorders borders(built_.sheet, lifts_);
      built_.parts.seams = FindSeams(borders, built_.parts.cell_mm, options_.seams);
      Zip();
      const int before = std::exchange(open_points, OpenPoints(borders));
      const bool settled = round > 0 && open_points >= before;
      if (open_points > 0 && !settled && round < kMostRounds) {
        WEFT_RETURN_IF_ERROR(PullTogether());
        continue;
      }
      WEFT_RETURN_IF_ERROR(CheckSewnTogether(built_.sheet, built_.parts.seams));
      WEFT_RETURN_IF_ERROR(AssessNearSeams(borders));
      if (!shown_.empty()) RestoreWidths(shown_, &lifts_[0], &built_.parts.seams);
      faces_ = built_.sheet.flat.faces;
      const std::vector<Face> strips =
          ZipWithRows(borders, built_.parts.cell_mm, &built_.parts.seams, &lifts_[0]);
      faces_.insert(faces_.end(), strips.begin(), strips.end());
      built_.seam_faces = static_cast<int>(strips.size());
      return absl::OkStatus();
    }
  }

  // The panels' faces and a strip for each seam.
  void Zip() {
    faces_ = built_.sheet.flat.faces;
    for (const Seam& seam : built_.parts.seams) AddStrip(seam);
  }

  void AddStrip(const Seam& seam) {
    const std::vector<Face> strip = ZipSeam(seam, lifts_[0].position_mm);
    faces_.insert(faces_.end(), strip.begin(), strip.end());
  }

  // Border points that no seam has.
  int OpenPoints(const PanelBorders& borders) const {
    int sewn = 0;
    for (const Seam& seam : built_.parts.seams) {
      sewn += static_cast<int>(seam.side_a.size() + seam.side_b.size()) - 2;
    }
    return borders.size() - sewn;
  }

  RestShapeProblem RestProblem() const {
    std::vector<double> gaps_mm = {built_.parts.cell_mm};
    for (const Seam& seam : built_.parts.seams) gaps_mm.push_back(seam.gap_mm);
    constexpr double kSlack = 1.5;
    return {faces_,
            static_cast<int>(built_.sheet.flat.faces.size()),
            built_.sheet.flat.vertices_mm,
            lifts_[0].position_mm,
            {},
            kSlack * Median(std::move(gaps_mm)),
            lifts_[0].seen,
            {}};
  }

  // The reference with its seams at their proper width; the other clouds have said what they can.
  absl::Status PullTogether() {
    // Cloth that was seen away from the borders is where it should be.
    constexpr int kRings = 8;
    std::vector<bool> loose(lifts_[0].seen.size());
    for (size_t v = 0; v < loose.size(); ++v) loose[v] = !lifts_[0].seen[v];
    for (const std::vector<int>& loop : built_.sheet.loops) {
      for (const int v : loop) loose[v] = true;
    }
    const std::vector<int> rings = RingDistance(BuildMeshGraph(built_.sheet.flat), loose);
    WEFT_ASSIGN_OR_RETURN(const Borders borders, FindBorders());
    RestShapeProblem problem = RestProblem();
    // What lies between seams pulls as well.
    for (size_t i = borders.openings; i < borders.all.size(); ++i) {
      const absl::StatusOr<std::vector<Face>> filling =
          FillHole(borders.all[i].loop, lifts_[0].position_mm, problem.faces);
      if (filling.ok()) problem.faces.insert(problem.faces.end(), filling->begin(), filling->end());
    }
    problem.fixed.resize(loose.size());
    for (size_t v = 0; v < loose.size(); ++v) problem.fixed[v] = rings[v] < 0 || rings[v] > kRings;
    WEFT_ASSIGN_OR_RETURN(std::vector<Eigen::Vector3d> pulled_mm, RefineRestShape(problem, kPulledSeams));
    if (shown_.empty()) shown_ = lifts_;
    lifts_.resize(1);
    lifts_[0].position_mm = std::move(pulled_mm);
    return absl::OkStatus();
  }

  // What lies between seams is sewn too; other borders that look like a seam are for the user to judge.
  absl::Status AssessNearSeams(const PanelBorders& borders) {
    SeamOptions near = options_.seams;
    near.min_points = kNearSeamPoints;
    const double max_gap_mm =
        options_.seams.max_gap_mm > 0 ? options_.seams.max_gap_mm : 4 * built_.parts.cell_mm;
    std::vector<Seam> doubtful;
    for (Seam& seam :
         FindNearSeams(borders, built_.parts.seams, built_.parts.cell_mm, kNearSeamFactor, near)) {
      if (!seam.wide) {
        doubtful.push_back(std::move(seam));
        continue;
      }
      built_.warnings.push_back(absl::StrCat("closed without having seen it, since both ends are sewn: ",
                                             SeamText(built_.sheet, seam)));
      built_.parts.seams.push_back(std::move(seam));
    }
    if (options_.allow_open_seams) return absl::OkStatus();
    return CheckNearSeams(built_.sheet, doubtful, max_gap_mm);
  }

  // Borders of the sewn mesh, longest first. The first of them are openings: as many as expected, or those
  // that are too long for a hole.
  struct Borders {
    std::vector<TemplateBorder> all;
    size_t openings = 0;
  };
  absl::StatusOr<Borders> FindBorders() const {
    const std::vector<Eigen::Vector3d>& position_mm = lifts_[0].position_mm;
    const absl::StatusOr<MeshTopology> open = CheckTopology(static_cast<int>(position_mm.size()), faces_);
    if (!open.ok()) {
      return absl::InternalError(absl::StrCat("sewing made no clean surface: ", open.status().message()));
    }
    Borders borders;
    for (const std::vector<int>& loop : open->loops) {
      borders.all.push_back(DescribeBorder(built_.sheet, loop, position_mm));
    }
    const auto longer = [](const TemplateBorder& x, const TemplateBorder& y) {
      return x.length_mm > y.length_mm;
    };
    std::stable_sort(borders.all.begin(), borders.all.end(), longer);
    while (borders.openings < borders.all.size() &&
           (options_.openings >= 0
                ? static_cast<int>(borders.openings) < options_.openings
                : borders.all[borders.openings].length_mm > MaxHoleMm(borders.all[borders.openings]))) {
      ++borders.openings;
    }
    return borders;
  }
  // What was hardly seen is rather a hole.
  double MaxHoleMm(const TemplateBorder& border) const {
    constexpr double kUnseenFactor = 1.5;
    const double most_mm = options_.max_hole_mm > 0 ? options_.max_hole_mm : 60 * built_.parts.cell_mm;
    int seen = 0, cells = 0;
    for (const int v : border.loop) {
      cells += v < static_cast<int>(built_.sheet.cell_of_vertex.size());
      seen += lifts_[0].seen[v];
    }
    return 2 * seen < cells ? kUnseenFactor * most_mm : most_mm;
  }

  absl::Status CloseHoles() {
    WEFT_ASSIGN_OR_RETURN(const Borders borders, FindBorders());
    for (size_t i = 0; i < borders.all.size(); ++i) {
      const TemplateBorder& border = borders.all[i];
      absl::StatusOr<std::vector<Face>> filling;
      const bool closes = i >= borders.openings && border.length_mm <= MaxHoleMm(border);
      if (closes)
        filling = FillWhereSeamsMeet(border.loop, faces_, built_.parts.cell_mm, &lifts_[0], &beside_corners_);
      if (!closes || !filling.ok()) {
        built_.parts.openings.push_back(border);
        if (closes) built_.warnings.push_back(std::string(filling.status().message()));
        continue;
      }
      faces_.insert(faces_.end(), filling->begin(), filling->end());
      built_.closed_holes.push_back(border);
    }
    const absl::StatusOr<MeshTopology> closed =
        CheckTopology(static_cast<int>(lifts_[0].position_mm.size()), faces_);
    if (!closed.ok()) {
      return absl::InternalError(
          absl::StrCat("closing holes made no clean surface: ", closed.status().message()));
    }
    built_.euler = closed->euler;
    built_.genus = closed->genus;
    return CheckOpenings(built_, options_, *closed);
  }

  absl::Status LayToRest() {
    Report(0.8);
    RestShapeProblem problem = RestProblem();
    problem.measured =
        MeasureGaps(built_.parts.seams, lifts_[0].position_mm, shown_.empty() ? lifts_ : shown_);
    absl::StatusOr<std::vector<Eigen::Vector3d>> rest_mm = RefineRestShape(problem, kSmoothedWrinkles);
    if (!rest_mm.ok()) return rest_mm.status();
    Report(0.9);
    problem.start_mm = *std::move(rest_mm);
    rest_mm = RefineRestShape(problem, kPrintedLengths);
    if (!rest_mm.ok()) return rest_mm.status();
    std::vector<VertexNode> nodes = built_.sheet.cell_of_vertex;
    nodes.resize(rest_mm->size());
    GarmentParts& parts = built_.parts;
    PackCharts(built_.sheet, parts.cell_mm, kTextureGapCells, &parts);
    AddSeamTexture(beside_corners_, &parts);
    if (options_.corners) AddCornerVertices(built_.sheet, &problem, &*rest_mm, &nodes, &parts.texture_mm);
    built_.strain = MeasureRestStrain(problem, *rest_mm);
    for (std::vector<TemplateBorder>* borders : {&built_.parts.openings, &built_.closed_holes}) {
      for (TemplateBorder& border : *borders) border.length_mm = LoopLengthMm(border.loop, *rest_mm);
    }
    parts.panel_faces = problem.panel_faces;
    parts.expected_openings = options_.openings;
    parts.board_rows = board_.rows, parts.board_cols = board_.cols;
    WEFT_ASSIGN_OR_RETURN(Template garment,
                          ImportTemplate(options_.id, {*std::move(rest_mm), std::move(problem.faces)},
                                         std::move(nodes), board_));
    built_.garment = std::move(garment);
    return absl::OkStatus();
  }

  const Board& board_;
  const TemplateSources& sources_;
  const TemplateBuildOptions& options_;
  const std::function<void(double)>& on_progress_;
  std::vector<CellGrid> grids_;
  std::vector<LiftedPanels> lifts_;  // the reference first
  std::vector<LiftedPanels>
      shown_;  // as the clouds have them; empty unless the reference was pulled together
  std::vector<int> beside_corners_;  // beside each vertex where seams meet; those are the last ones
  std::vector<Face> faces_;
  BuiltTemplate built_;
};

}  // namespace

absl::Status TemplateBuildOptions::Validate() const {
  if (id.empty()) return absl::InvalidArgumentError("the template's id is empty");
  if (!(max_hole_mm >= 0)) return absl::InvalidArgumentError("max_hole_mm must be 0 or more");
  if (max_clouds < 1) return absl::InvalidArgumentError("max_clouds must be 1 or more");
  absl::Status status = panels.Validate();
  status.Update(seams.Validate());
  return status;
}

absl::StatusOr<BuiltTemplate> BuildTemplate(const Board& board, const TemplateSources& sources,
                                            const TemplateBuildOptions& options,
                                            const std::function<void(double)>& on_progress) {
  absl::Status status = board.Validate();
  status.Update(options.Validate());
  if (!status.ok()) return status;
  return Builder(board, sources, options, on_progress).Run();
}

}  // namespace weft
