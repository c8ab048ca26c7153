#include "services/work/pipeline/stage_reports.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "alignment/alignment_memory.h"
#include "pattern/board/board.h"

namespace weft {
namespace {

std::vector<std::string> ReasonsOf(const google::protobuf::RepeatedPtrField<v1::ReasonCount>& reasons) {
  std::vector<std::string> lines;
  for (const v1::ReasonCount& reason : reasons)
    lines.push_back(reason.reason() + " " + std::to_string(reason.count()));
  return lines;
}

Observation SeenNode(NodeKind kind) {
  Observation seen;
  seen.node.kind = kind;
  return seen;
}

TEST(StageReports, DecodingCountsNodesAndReasons) {
  DecodeResult result;
  for (const NodeKind kind : {NodeKind::kCenter, NodeKind::kCorner, NodeKind::kCenter})
    result.observations.push_back(SeenNode(kind));
  for (const char* reason : {"", "mirrored", "small", "mirrored", ""}) {
    PatchReport patch;
    patch.accepted = *reason == '\0';
    patch.reason = reason;
    result.patches.push_back(patch);
  }
  result.grey_levels = 71;
  result.timings = {1, 2, 3, 4, 5};
  v1::ViewReport report;
  report.set_read_ms(9);
  DescribeDecoding(result, report);
  EXPECT_EQ(report.centers(), 2);
  EXPECT_EQ(report.corners(), 1);
  EXPECT_EQ(report.patches_accepted(), 2);
  EXPECT_THAT(ReasonsOf(report.patches_rejected()), ::testing::ElementsAre("mirrored 2", "small 1"));
  EXPECT_EQ(report.grey_levels(), 71);
  EXPECT_EQ(report.read_ms(), 9) << "of the reading";
  EXPECT_EQ(report.lattice_ms(), 2);
  EXPECT_EQ(report.colors_ms(), 3);
  EXPECT_EQ(report.growth_ms(), 4);
  EXPECT_EQ(report.refinement_ms(), 5);
}

TEST(StageReports, ACloudHasMediansOfItsPoints) {
  Cloud cloud;
  for (const int k : {1, 2, 3}) {
    CloudPoint point;
    point.node.kind = k == 3 ? NodeKind::kCorner : NodeKind::kCenter;
    point.views = 2 * k, point.sigma_mm = 0.25 * k;
    cloud.points.push_back(point);
  }
  cloud.rejected = {{{0, 0}, 1, RejectReason::kIsolated},
                    {{0, 1}, 1, RejectReason::kTooFewViews},
                    {{0, 2}, 1, RejectReason::kIsolated}};
  v1::CloudReport report;
  DescribeCloud(cloud, report);
  EXPECT_EQ(report.centers(), 2);
  EXPECT_EQ(report.corners(), 1);
  EXPECT_EQ(report.median_views(), 4);
  EXPECT_EQ(report.median_sigma_mm(), 0.5);
  EXPECT_THAT(ReasonsOf(report.rejected()), ::testing::ElementsAre("isolated 2", "too_few_views 1"));
}

TEST(StageReports, ABiasOfNoObservationsIsNone) {
  CameraBias bias;
  bias.mean_px = {0.5, -0.25}, bias.rms_px = 0.75, bias.significance = 6;
  v1::ViewReport report;
  DescribeBias(bias, report);
  EXPECT_FALSE(report.has_bias());
  bias.observations = 12;
  DescribeBias(bias, report);
  EXPECT_EQ(report.bias().observations(), 12);
  EXPECT_EQ(report.bias().mean_x_px(), 0.5);
  EXPECT_EQ(report.bias().mean_y_px(), -0.25);
  EXPECT_EQ(report.bias().rms_px(), 0.75);
  EXPECT_EQ(report.bias().significance(), 6);
}

// Two garments of two vertices each; the last vertex is of no cell.
Template PairOfGarments() {
  Template garment;
  garment.id = "outfit";
  garment.rest.vertices_mm.resize(4);
  garment.node_of_vertex = {{0, 0}, {0, 1}, {9, 0, NodeKind::kCorner}, {}};
  garment.garments = {{"skirt", 0, 2, 0, 0}, {"shirt", 2, 2, 0, 0}};
  return garment;
}

RegisteredMesh MeshOfStates(const std::vector<VertexState>& states) {
  RegisteredMesh mesh;
  mesh.state = states;
  for (size_t v = 0; v < states.size(); ++v) mesh.sigma_mm.push_back(0.5f * static_cast<float>(v + 1));
  mesh.vertices_mm.resize(states.size());
  mesh.views.resize(states.size());
  return mesh;
}

TEST(StageReports, AMeshIsCountedWholeAndByGarment) {
  const RegisteredMesh mesh = MeshOfStates(
      {VertexState::kObserved, VertexState::kInferred, VertexState::kObserved, VertexState::kTwoView});
  v1::MeshReport report;
  DescribeMesh(mesh, PairOfGarments(), report);
  EXPECT_EQ(report.vertices(), 4);
  EXPECT_EQ(report.vertices_with_cell(), 3);
  EXPECT_EQ(report.observed(), 2);
  EXPECT_EQ(report.two_view(), 1);
  EXPECT_DOUBLE_EQ(report.coverage(), 2.0 / 3);
  EXPECT_EQ(report.median_observed_sigma_mm(), 1.5) << "the upper of two";
  ASSERT_EQ(report.garments_size(), 2);
  EXPECT_EQ(report.garments(0).id(), "skirt");
  EXPECT_EQ(report.garments(0).vertices(), 2);
  EXPECT_EQ(report.garments(0).vertices_with_cell(), 2);
  EXPECT_EQ(report.garments(0).coverage(), 0.5);
  EXPECT_EQ(report.garments(0).two_view(), 0);
  EXPECT_EQ(report.garments(1).vertices_with_cell(), 1);
  EXPECT_EQ(report.garments(1).observed(), 1);
  EXPECT_EQ(report.garments(1).two_view(), 1);
  EXPECT_EQ(report.garments(1).coverage(), 1);
  EXPECT_EQ(report.garments(1).median_observed_sigma_mm(), 1.5);
}

TEST(StageReports, WithoutCellsNothingIsCovered) {
  Template garment = PairOfGarments();
  garment.garments.clear();
  garment.node_of_vertex.assign(4, {});
  v1::MeshReport report;
  DescribeMesh(MeshOfStates(std::vector<VertexState>(4, VertexState::kInferred)), garment, report);
  EXPECT_EQ(report.coverage(), 0);
  EXPECT_EQ(report.garments_size(), 0);
}

TEST(StageReports, AnAlignmentTellsItsStagesAndWhichGarmentLiesOverWhich) {
  AlignResult result;
  result.mesh = MeshOfStates(std::vector<VertexState>(4, VertexState::kObserved));
  result.untangling.pairs_before = 7, result.untangling.pairs_after = 1;
  result.untangling.demoted_vertices = 3;
  result.rays = 5;
  result.layers = {{0, 1}};
  result.stages = {{"place", 0, 9, 8, 0.5}, {"elastic", 12, 8, 2, 40}};
  v1::MeshReport report;
  DescribeAlignment(result, PairOfGarments(), 6, report);
  EXPECT_EQ(report.vertices(), 4);
  EXPECT_DOUBLE_EQ(report.alignment_memory_mib(),
                   static_cast<double>(AlignmentMemoryBytes(4)) / (1024.0 * 1024));
  EXPECT_EQ(report.self_intersections_before(), 7);
  EXPECT_EQ(report.self_intersections(), 1);
  EXPECT_EQ(report.demoted(), 3);
  EXPECT_EQ(report.unclaimed_points(), 6);
  EXPECT_EQ(report.rays(), 5);
  ASSERT_EQ(report.overlaps_size(), 1);
  EXPECT_EQ(report.overlaps(0).inner(), "skirt");
  EXPECT_EQ(report.overlaps(0).outer(), "shirt");
  ASSERT_EQ(report.stages_size(), 2);
  EXPECT_EQ(report.stages(1).name(), "elastic");
  EXPECT_EQ(report.stages(1).iterations(), 12);
  EXPECT_EQ(report.stages(1).energy_before(), 8);
  EXPECT_EQ(report.stages(1).energy_after(), 2);
  EXPECT_EQ(report.stages(1).time_ms(), 40);
}

// Cells of 4 mm on a plane, measured 1 % larger; the template has them 5 % larger.
TEST(StageReports, TheCloudIsMeasuredAgainstPrintAndTemplate) {
  constexpr int board_rows = 12, board_cols = 14;
  constexpr double kCellMm = 4;
  Board board;
  board.rows = board_rows, board.cols = board_cols, board.cell_mm = kCellMm;
  Template garment;
  Cloud cloud;
  for (int row = 0; row < board_rows; ++row)
    for (int col = 0; col < board_cols; ++col) {
      CloudPoint point;
      point.node = {row, col}, point.views = 4, point.sigma_mm = 1e-3;
      point.position_mm = 1.01 * kCellMm * Eigen::Vector3d(col, row, 0);
      cloud.points.push_back(point);
      garment.node_of_vertex.push_back({row, col});
      garment.rest.vertices_mm.emplace_back(1.05 * kCellMm * Eigen::Vector3d(col, row, 0));
    }
  // Nodes that the board does not have, and corners, are nobody's cells.
  garment.node_of_vertex.push_back({0, board_cols});
  garment.node_of_vertex.push_back({0, 0, NodeKind::kCorner});
  garment.rest.vertices_mm.resize(garment.node_of_vertex.size(), Eigen::Vector3d(1000, 0, 0));
  v1::CloudReport report;
  DescribeScale(cloud, board, garment, report);
  EXPECT_NEAR(report.print_scale(), 1.01, 1e-4);
  EXPECT_NEAR(report.template_scale(), 1.01 / 1.05, 1e-4);
  // Parts have cells of their own size, and none of the board's.
  board.parts.resize(1);
  board.parts[0].rows = board_rows, board.parts[0].cell_mm = 2 * kCellMm;
  v1::CloudReport of_parts;
  DescribeScale(cloud, board, garment, of_parts);
  EXPECT_NEAR(of_parts.print_scale(), 1.01 / 2, 1e-4);
  // Too little of the template says nothing.
  garment.node_of_vertex.assign(garment.node_of_vertex.size(), {});
  v1::CloudReport of_none;
  DescribeScale(cloud, board, garment, of_none);
  EXPECT_FALSE(of_none.has_template_scale());
}

TEST(StageReports, PlacesAndScansAreToldAsTheyAre) {
  v1::MapPlaceReport place;
  DescribePlace({true, 1, -2, 30, 4, 5}, place);
  EXPECT_TRUE(place.half_turn());
  EXPECT_EQ(place.rows(), 1);
  EXPECT_EQ(place.cols(), -2);
  EXPECT_EQ(place.cells(), 30);
  EXPECT_EQ(place.outside(), 4);
  EXPECT_EQ(place.outside_there(), 5);

  ScanFile file;
  file.points = 40, file.unmeasured = 2, file.without_normal = 3;
  v1::ScanReport scan;
  DescribeScan(file, {30, 20, 0.125, true}, scan);
  EXPECT_EQ(scan.points(), 40);
  EXPECT_EQ(scan.unmeasured(), 2);
  EXPECT_EQ(scan.without_normal(), 3);
  EXPECT_EQ(scan.found(), 30);
  EXPECT_EQ(scan.vertices(), 20);
  EXPECT_TRUE(scan.normals_turned());
  EXPECT_EQ(scan.median_distance_mm(), 0.125);
  const std::string plain =
      "40 points, 30 of them found a vertex, 0.12 mm from the cloth in the median; 20 hidden vertices follow "
      "it";
  EXPECT_EQ(ScanText(scan), plain +
                                "; 2 points without a measurement; 3 points without a normal; its normals "
                                "pointed inwards and were turned");
  scan.set_unmeasured(0), scan.set_without_normal(0), scan.set_normals_turned(false);
  EXPECT_EQ(ScanText(scan), plain);
}

// Columns of the cloud go on beyond the board, or beyond the template: 40 distances of the template are known
// along the rows, too few.
TEST(StageReports, CellsOfNoVertexMeasureNothing) {
  constexpr int kLong = 40;
  Cloud cloud;
  for (int row = 0; row < kLong; ++row)
    for (int col = 0; col < 6; ++col) {
      CloudPoint point;
      point.node = {row, col}, point.views = 4, point.sigma_mm = 1e-3;
      point.position_mm = 4.0 * Eigen::Vector3d(col, row, 0);
      cloud.points.push_back(point);
    }
  struct Case {
    int board_cols, first_col, last_col;
    bool has_scale;
  };
  for (const Case& of :
       {Case{3, 1, 2, false}, Case{6, 1, 2, false}, Case{6, 1, 4, true}, Case{4, 1, 4, true}}) {
    Board board;
    board.rows = kLong, board.cols = of.board_cols, board.cell_mm = 4;
    Template garment;
    for (int row = 0; row < kLong; ++row)
      for (int col = of.first_col; col <= of.last_col; ++col) {
        garment.node_of_vertex.push_back({row, col});
        garment.rest.vertices_mm.emplace_back(4.0 * Eigen::Vector3d(col, row, 7));
      }
    v1::CloudReport report;
    DescribeScale(cloud, board, garment, report);
    EXPECT_TRUE(report.has_print_scale());
    EXPECT_EQ(report.has_template_scale(), of.has_scale) << of.board_cols << " " << of.last_col;
    if (of.has_scale) {
      EXPECT_NEAR(report.template_scale(), 1, 1e-9);
    }
  }
}

// Cells of two parts have no distance in common, and no size is none.
TEST(StageReports, PartsAreMeasuredOnTheirOwn) {
  Board board;
  board.rows = 40, board.cols = 14;
  board.parts.resize(2);
  board.parts[0].rows = 20, board.parts[0].cell_mm = 4;
  board.parts[1].first_row = 20, board.parts[1].rows = 20, board.parts[1].cell_mm = 2;
  Cloud cloud;
  for (int row = 0; row < board.rows; ++row)
    for (int col = 0; col < board.cols; ++col) {
      CloudPoint point;
      point.node = {row, col}, point.views = 4, point.sigma_mm = 1e-3;
      point.position_mm = (row < 20 ? 4.0 : 2.0) * 1.02 * Eigen::Vector3d(col, row, 0);
      cloud.points.push_back(point);
    }
  v1::CloudReport report;
  DescribeScale(cloud, board, Template(), report);
  EXPECT_NEAR(report.print_scale(), 1.02, 1e-4);
  board.parts[1].cell_mm = 0;
  v1::CloudReport of_one;
  DescribeScale(cloud, board, Template(), of_one);
  EXPECT_NEAR(of_one.print_scale(), 1.02, 1e-4);
  board.parts[0].cell_mm = 0;
  v1::CloudReport of_none;
  DescribeScale(cloud, board, Template(), of_none);
  EXPECT_FALSE(of_none.has_print_scale());
}

}  // namespace
}  // namespace weft
