#include "alignment/template_build/build_template.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "alignment/template_build/mesh_topology.h"
#include "tests/alignment/template_build/sewn_tubes.h"

namespace weft {
namespace {

using testing::FourPanels;
using ::testing::HasSubstr;
using testing::kPitchMm;
using testing::OnePanel;
using testing::PlainBoard;
using testing::ThreePanels;
using testing::Tube;
using testing::TubeCloud;
using testing::TwoPanels;
using testing::Worn;

absl::StatusOr<BuiltTemplate> Build(const Tube& tube, std::vector<Cloud> clouds, int openings = 2) {
  TemplateBuildOptions options;
  options.openings = openings;
  return BuildTemplate(PlainBoard(tube), {std::move(clouds), {}, {}}, options);
}

size_t Cells(const BuiltTemplate& built) {
  const std::vector<VertexNode>& cells = built.garment.node_of_vertex;
  return static_cast<size_t>(
      std::count_if(cells.begin(), cells.end(), [](const VertexNode& cell) { return cell.row >= 0; }));
}

// A clean tube: one piece, two borders as long as the tube is around, no handle, faces all turned outwards.
void ExpectTube(const Tube& tube, const BuiltTemplate& built) {
  const TriangleMesh& mesh = built.garment.rest;
  const auto topology = CheckTopology(static_cast<int>(mesh.vertices_mm.size()), mesh.faces);
  ASSERT_TRUE(topology.ok()) << topology.status();
  EXPECT_EQ(topology->components, 1);
  EXPECT_EQ(topology->genus, 0);
  ASSERT_EQ(topology->loops.size(), 2u);
  ASSERT_EQ(built.parts.openings.size(), 2u);
  for (const TemplateBorder& opening : built.parts.openings) {
    EXPECT_NEAR(opening.length_mm, tube.around * kPitchMm, 0.12 * tube.around * kPitchMm);
  }
  int inwards = 0;
  for (const auto& [a, b, c] : mesh.faces) {
    const Eigen::Vector3d& corner = mesh.vertices_mm[a];
    const Eigen::Vector3d normal = (mesh.vertices_mm[b] - corner).cross(mesh.vertices_mm[c] - corner);
    inwards += normal.x() * corner.x() + normal.y() * corner.y() <= 0;
  }
  EXPECT_LE(inwards, static_cast<int>(mesh.faces.size() / 500));
}

TEST(BuildTemplate, SewsOnePanelToATube) {
  const Tube tube = OnePanel();
  const auto built = Build(tube, {TubeCloud(tube)});
  ASSERT_TRUE(built.ok()) << built.status();
  ExpectTube(tube, *built);
  EXPECT_EQ(Cells(*built), 60u * 30u);
  ASSERT_EQ(built->parts.seams.size(), 1u);
  EXPECT_NEAR(built->parts.seams[0].length_mm, 29 * kPitchMm, 0.1);
  EXPECT_NEAR(built->parts.seams[0].gap_mm, 2 * kPitchMm, 0.1);
  EXPECT_TRUE(built->closed_holes.empty());
  EXPECT_LT(built->strain.p95, 0.02);
}

TEST(BuildTemplate, SewsPanelsOfDifferentDensity) {
  for (const double turn_deg : {0.0, 45.0, 20.0, 90.0}) {
    SCOPED_TRACE(turn_deg);
    const Tube tube = TwoPanels(turn_deg);
    const auto built = Build(tube, {TubeCloud(tube)});
    ASSERT_TRUE(built.ok()) << built.status();
    ExpectTube(tube, *built);
    EXPECT_EQ(built->parts.panels.size(), 2u);
    EXPECT_EQ(built->parts.seams.size(), 2u);
    EXPECT_LT(built->strain.p95, 0.02);
  }
}

// Rest lengths that are too short pull at the cells beside the seam in every frame.
TEST(BuildTemplate, SeamsOfDifferentWidthAreEachAsWideAtRestAsTheyWere) {
  const Tube tube{46, 90, 82, {{40, 40, 3, 3, 0, 0}, {40, 40, 45, 3, 40.2, 0}}};
  const auto built = Build(tube, {TubeCloud(tube)});
  ASSERT_TRUE(built.ok()) << built.status();
  ASSERT_EQ(built->parts.seams.size(), 2u);
  for (const Seam& seam : built->parts.seams) {
    const double gap_mm = seam.gap_mm;
    const std::vector<Eigen::Vector3d>& rest_mm = built->garment.rest.vertices_mm;
    double sum_mm = 0;
    ASSERT_EQ(seam.side_a.size(), seam.side_b.size());
    for (size_t k = 0; k < seam.side_a.size(); ++k) {
      sum_mm += (rest_mm[seam.side_b[k]] - rest_mm[seam.side_a[k]]).norm();
    }
    EXPECT_NEAR(sum_mm / static_cast<double>(seam.side_a.size()), gap_mm, 0.02 * gap_mm) << gap_mm;
  }
}

TEST(BuildTemplate, ClosesCornersWhereThreeAndFourPanelsMeet) {
  for (const Tube& tube : {ThreePanels(), FourPanels()}) {
    SCOPED_TRACE(tube.panels.size());
    const auto built = Build(tube, {TubeCloud(tube)});
    ASSERT_TRUE(built.ok()) << built.status();
    ExpectTube(tube, *built);
    EXPECT_EQ(built->parts.panels.size(), tube.panels.size());
  }
}

TEST(BuildTemplate, WithstandsNoiseUnseenPatchesAndWrongPoints) {
  const Tube tube = FourPanels();
  std::vector<Cloud> clouds;
  for (const uint64_t seed : {1, 2, 3}) clouds.push_back(Worn(TubeCloud(tube), 0.3, 10, 40, seed));
  const auto built = Build(tube, clouds);
  ASSERT_TRUE(built.ok()) << built.status();
  ExpectTube(tube, *built);
  EXPECT_EQ(built->parts.panels.size(), 4u);
  // Every cell of the garment has its vertex, but for corners that no cloud shows.
  EXPECT_GE(Cells(*built), TubeCloud(tube).points.size() - 15);
  EXPECT_GT(built->contradicting_points, 60);
}

TEST(BuildTemplate, SeparatesPanelsThatAbutOnTheBoard) {
  // Both halves lie side by side on the board; the second is upside down, so other sides are sewn.
  const Tube tube{46, 90, 82, {{40, 40, 3, 3, 0, 0}, {40, 40, 83, 43, 41, 0, 180}}};
  const auto built = Build(tube, {TubeCloud(tube)});
  ASSERT_TRUE(built.ok()) << built.status();
  EXPECT_EQ(built->parts.panels.size(), 2u);
  ExpectTube(tube, *built);
}

TEST(BuildTemplate, TakesPanelsFromLabels) {
  const Tube tube = TwoPanels(0);
  const Board board = PlainBoard(tube);
  TemplateSources sources{{Worn(TubeCloud(tube), 0.2, 10, 0, 5)}, {}, {}};
  sources.panel_labels.assign(static_cast<size_t>(tube.rows) * tube.cols, 0);
  for (const CloudPoint& point : TubeCloud(tube).points) {
    sources.panel_labels[point.node.row * tube.cols + point.node.col] = 7;
  }
  sources.panel_labels[5] = 7;  // a speck
  const auto built = BuildTemplate(board, sources, {});
  ASSERT_TRUE(built.ok()) << built.status();
  ExpectTube(tube, *built);
  EXPECT_EQ(Cells(*built), TubeCloud(tube).points.size());
  EXPECT_EQ(built->speck_cells, 1);
}

TEST(BuildTemplate, SaysWhichSeamIsTooFarApart) {
  const Tube tube = OnePanel(/*gap=*/8);
  const auto built = Build(tube, {TubeCloud(tube)});
  ASSERT_EQ(built.status().code(), absl::StatusCode::kFailedPrecondition);
  const std::string message(built.status().message());
  EXPECT_THAT(message, HasSubstr("between panel 1 (rows 2 to 31, columns"));
  EXPECT_THAT(message, HasSubstr(" mm long, 2"));
  EXPECT_THAT(message, HasSubstr("--max-seam-gap-mm 30"));

  TemplateBuildOptions options;
  options.seams.max_gap_mm = 30;
  options.openings = 2;
  const auto wide = BuildTemplate(PlainBoard(tube), {{TubeCloud(tube)}, {}, {}}, options);
  ASSERT_TRUE(wide.ok()) << wide.status();
  ExpectTube(tube, *wide);

  options = {};
  options.allow_open_seams = true;
  const auto open = BuildTemplate(PlainBoard(tube), {{TubeCloud(tube)}, {}, {}}, options);
  ASSERT_TRUE(open.ok()) << open.status();
  EXPECT_EQ(open->parts.openings.size(), 1u);
}

TEST(BuildTemplate, SaysWhichPanelIsSewnToNothing) {
  Tube tube = TwoPanels(0);
  tube.panels[1].around += 100, tube.panels[1].width = 10, tube.panels[1].down = 80;
  const auto built = Build(tube, {TubeCloud(tube)});
  ASSERT_EQ(built.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(built.status().message()), HasSubstr("panel 2 (rows 20 to 59, columns 80 to 89)"));
}

TEST(BuildTemplate, SaysWhichOpeningsThereAre) {
  const Tube tube = OnePanel();
  for (const int expected : {1, 3}) {
    const auto built = Build(tube, {TubeCloud(tube)}, expected);
    ASSERT_EQ(built.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(built.status().message()), HasSubstr("has 2 openings, expected were"));
    EXPECT_THAT(std::string(built.status().message()), HasSubstr(" mm along panel 1; "));
  }
}

TEST(BuildTemplate, RefusesCloudsOfAnotherBoard) {
  const Tube tube = OnePanel();
  Board board = PlainBoard(tube);
  board.cell_mm = 6;
  const auto scaled = BuildTemplate(board, {{TubeCloud(tube)}, {}, {}}, {});
  EXPECT_THAT(std::string(scaled.status().message()),
              HasSubstr("3 mm apart in the clouds and 6 mm on the board"));
  Tube larger = tube;
  larger.cols += 100, larger.panels[0].x += 100;
  const auto outside =
      BuildTemplate(PlainBoard(tube), {{TubeCloud(larger)}, {"far.ply"}, {}}, TemplateBuildOptions{});
  EXPECT_EQ(outside.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(outside.status().message()),
              HasSubstr("far.ply: cell (2, 105) is not on the board"));
}

}  // namespace
}  // namespace weft
