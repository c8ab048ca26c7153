// `weft align`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>

#include "services/formats/files/cloud_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/template_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/weft_process.h"
#include "weft/v1/command.pb.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

constexpr int kSide = 12;

// A flat cloth at rest; its truth is the same cloth rolled onto a cylinder, which keeps every length along
// it.
Eigen::Vector3d Rolled(int row, int col) {
  constexpr double kRadiusMm = 20;
  const double angle = 2.7 * col / kRadiusMm;
  return {kRadiusMm * std::sin(angle) + 100, 2.7 * row - 30, kRadiusMm * (1 - std::cos(angle)) + 900};
}

class AlignCommand : public ::testing::Test {
 protected:
  AlignCommand() {
    TriangleMesh mesh;
    std::vector<VertexNode> cells;
    for (int row = 0; row < kSide; ++row) {
      for (int col = 0; col < kSide; ++col) {
        mesh.vertices_mm.emplace_back(2.7 * col, 2.7 * row, 0);
        cells.push_back({row, col});
        if (row == 0 || col == 0) continue;
        const int v = row * kSide + col;
        mesh.faces.push_back({v - kSide - 1, v - 1, v - kSide});
        mesh.faces.push_back({v - kSide, v - 1, v});
      }
    }
    const auto garment = ImportTemplate("cloth", mesh, cells, *GenerateBoard(kSide, kSide, 2.7, 1));
    EXPECT_TRUE(garment.ok()) << garment.status();
    EXPECT_TRUE(WriteTemplate(folder_ / "cloth", *garment).ok());
  }

  // All cells but a hidden square in the middle.
  Cloud VisibleCloud() const {
    Cloud cloud;
    for (int row = 0; row < kSide; ++row) {
      for (int col = 0; col < kSide; ++col) {
        if (Hidden(row, col)) continue;
        CloudPoint point;
        point.position_mm = Rolled(row, col);
        point.node = {row, col, NodeKind::kCenter};
        point.views = 4;
        point.sigma_mm = 0.2;
        cloud.points.push_back(point);
      }
    }
    return cloud;
  }
  static bool Hidden(int row, int col) { return row >= 5 && row <= 7 && col >= 5 && col <= 7; }

  WeftRun Align(const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments = {"align", folder_ / "cloud.ply", "--template", folder_ / "cloth",
                                          "--out", folder_ / "mesh.ply"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return RunWeft(arguments);
  }

  TempFolder folder_;
};

TEST_F(AlignCommand, RegistersSeenAndUnseenVertices) {
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", VisibleCloud()).ok());
  const WeftRun run = Align();
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("elastic"), HasSubstr("iterations"),
                             HasSubstr("vertices: 144, observed 135, inferred 9"),
                             HasSubstr("self-intersecting pairs of faces: 0")));
  const auto mesh = ReadRegisteredMesh(folder_ / "mesh.ply");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  for (int row = 0; row < kSide; ++row) {
    for (int col = 0; col < kSide; ++col) {
      const size_t v = static_cast<size_t>(row) * kSide + col;
      EXPECT_EQ(mesh->state[v], Hidden(row, col) ? VertexState::kInferred : VertexState::kObserved);
      EXPECT_LT((mesh->vertices_mm[v] - Rolled(row, col)).norm(), Hidden(row, col) ? 0.5 : 0.2)
          << row << " " << col;
    }
  }
}

TEST_F(AlignCommand, TellsTheStagesAndWhatBecameOfTheVertices) {
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", VisibleCloud()).ok());
  const WeftRun run = Align({"--threads", "1"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out,
              MatchesRegex("stage             iterations   energy before    energy after        ms\n"
                           "([a-z_ ]{16}  +([0-9]+|-)  +([0-9.e+-]+|-)  +([0-9.e+-]+|-)  +[0-9]+\\.[0-9]\n)+"
                           "total {57}[ 0-9.]{8}\n"
                           "targets: 135, of them outliers 0; points without a vertex: 0\n"
                           "vertices: 144, observed 135, inferred 9; self-intersecting pairs of faces: 0\n"
                           "[^\n]*mesh.ply: written\n"));
  EXPECT_EQ(run.err, "");
}

TEST_F(AlignCommand, TheReportHasEveryMeasure) {
  Cloud cloud = VisibleCloud();
  cloud.points[0].position_mm += Eigen::Vector3d(0, 0, 60);  // an outlier
  CloudPoint stranger = cloud.points[1];
  stranger.node.row = 700;
  cloud.points.push_back(stranger);
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", cloud).ok());
  const WeftRun run = Align({"--json", "--set", "alignment.stretch_rings=3"});
  ASSERT_EQ(run.status, 0) << run.err;
  v1::AlignReport report;
  ASSERT_TRUE(ParseJson(run.out, "report", report).ok()) << run.out;
  EXPECT_EQ(report.mesh_file(), folder_ / "mesh.ply");
  EXPECT_EQ(report.preset(), "best");
  EXPECT_EQ(report.targets(), 135);
  EXPECT_EQ(report.outliers(), 1);
  EXPECT_EQ(report.mesh().unclaimed_points(), 1);
  EXPECT_EQ(report.mesh().vertices(), 144);
  EXPECT_EQ(report.mesh().observed(), 134);
  EXPECT_EQ(report.inferred(), 10);
  EXPECT_EQ(report.self_intersections(), 0);
  EXPECT_GT(report.align_ms(), 0);
  EXPECT_GT(report.mesh().stages_size(), 2);
  EXPECT_EQ(report.options().alignment().stretch_rings(), 3);
  EXPECT_FALSE(report.mesh().has_scan());
  // --stretchy is four of them.
  const WeftRun stretchy = Align({"--json", "--stretchy"});
  ASSERT_TRUE(ParseJson(stretchy.out, "report", report).ok()) << stretchy.err;
  EXPECT_EQ(report.options().alignment().stretch_rings(), 4);
}

// More than 5 % longer or shorter than the template is another garment, or another size.
TEST_F(AlignCommand, ClothOfAnotherSizeIsPointedOut) {
  for (const auto& [scale, words] :
       {std::pair(1.1, "the cloth is 10.0 % longer than the template"),
        std::pair(0.9, "the cloth is 10.0 % shorter than the template"), std::pair(1.03, "")}) {
    Cloud cloud = VisibleCloud();
    for (CloudPoint& point : cloud.points) point.position_mm *= scale;
    ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", cloud).ok());
    const WeftRun run = Align();
    if (*words == '\0') {
      EXPECT_EQ(run.err, "");
    } else {
      EXPECT_THAT(run.err, AllOf(HasSubstr(folder_ / "cloud.ply"), HasSubstr(words),
                                 HasSubstr("is it of the right size?")));
    }
  }
}

TEST_F(AlignCommand, AStartThatIsTurnedIsTurnedBack) {
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", VisibleCloud()).ok());
  ASSERT_EQ(Align().status, 0);
  auto start = ReadMesh(folder_ / "mesh.ply");
  ASSERT_TRUE(start.ok());
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(1.5707963, Eigen::Vector3d::UnitZ()));
  for (Eigen::Vector3d& v : start->vertices_mm) v = turn * v;
  ASSERT_TRUE(WriteMesh(folder_ / "start.ply", *start).ok());
  const WeftRun run = Align({"--start", folder_ / "start.ply"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.err,
              HasSubstr("start.ply: is turned by 90 degrees against the cloud, and was turned back"));
}

TEST_F(AlignCommand, PointsWithoutAMeasurementAreCounted) {
  std::string rows = "nan nan nan 1\n";
  for (int v = 0; v < kSide * kSide; ++v) {
    const Eigen::Vector3d p = Rolled(v / kSide, v % kSide);
    rows += std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + " " +
            std::to_string(v) + "\n";
  }
  WriteBytes(
      folder_ / "cloud.ply",
      "ply\nformat ascii 1.0\nelement vertex 145\nproperty float x\nproperty float y\nproperty float z\n"
      "property int template_vertex\nend_header\n" +
          rows);
  const WeftRun run = Align();
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.err, "weft: warning: " + (folder_ / "cloud.ply") +
                         ": 1 points have no measurement and are left out\n");
}

TEST_F(AlignCommand, TakesPointsByTemplateVertexAndPrintsJson) {
  std::string rows;
  int count = 0;
  for (int v = 0; v < kSide * kSide; v += 2, ++count) {
    const Eigen::Vector3d p = Rolled(v / kSide, v % kSide);
    rows += std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + " " +
            std::to_string(v) + "\n";
  }
  WriteBytes(folder_ / "cloud.ply",
             "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) +
                 "\nproperty float x\nproperty float y\nproperty float z\nproperty int "
                 "template_vertex\nend_header\n" +
                 rows);
  const WeftRun run = Align({"--preset", "paper", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("\"targets\": 72"), HasSubstr("\"preset\": \"paper\""),
                             HasSubstr("\"inferred\": 72")));
}

TEST_F(AlignCommand, StartsFromAMeshAndWritesEachStage) {
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", VisibleCloud()).ok());
  ASSERT_EQ(Align().status, 0);
  std::filesystem::rename(folder_ / "mesh.ply", folder_ / "before.ply");
  const WeftRun run = Align({"--start", folder_ / "before.ply", "--stages", folder_ / "stages"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto mesh = ReadMesh(folder_ / "mesh.ply"), last = ReadMesh(folder_ / "stages/04_untangle.ply"),
             first = ReadMesh(folder_ / "stages/01_fill.ply"), before = ReadMesh(folder_ / "before.ply");
  ASSERT_TRUE(mesh.ok() && last.ok() && first.ok() && before.ok()) << first.status() << last.status();
  const size_t hidden = 6 * kSide + 6;
  EXPECT_LT((last->vertices_mm[hidden] - mesh->vertices_mm[hidden]).norm(), 1e-4);
  EXPECT_LT((first->vertices_mm[hidden] - before->vertices_mm[hidden]).norm(), 0.2);

  ASSERT_TRUE(WriteMesh(folder_ / "small.ply", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}).ok());
  const WeftRun refused = Align({"--start", folder_ / "small.ply"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, HasSubstr("start: has 3 vertices, the template 144"));
}

// Points of the whole cloth, the hidden square included, each times `scale`, with normals where `side` is not
// 0, turned by `turn`.
std::string ScanText(double scale, int side, const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity()) {
  std::string rows;
  int count = 0;
  for (double row = 0; row < kSide - 1; row += 0.3) {
    for (double col = 0; col < kSide - 1; col += 0.3, ++count) {
      const double angle = 2.7 * col / 20;
      const Eigen::Vector3d p =
          scale * turn *
          Eigen::Vector3d(20 * std::sin(angle) + 100, 2.7 * row - 30, 20 * (1 - std::cos(angle)) + 900);
      const Eigen::Vector3d n = side * Eigen::Vector3d(-std::sin(angle), 0, std::cos(angle));
      for (const double x : {p.x(), p.y(), p.z()}) rows += std::to_string(x) + " ";
      if (side != 0)
        for (const double x : {n.x(), n.y(), n.z()}) rows += std::to_string(x) + " ";
      rows += "\n";
    }
  }
  const std::string zeros = side == 0 ? "" : " 0 0 0";
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count + 2) +
         "\nproperty float x\nproperty float y\nproperty float z\n" +
         (side == 0 ? "" : "property float nx\nproperty float ny\nproperty float nz\n") + "end_header\n" +
         rows + "nan nan nan" + zeros + "\n1 2 3" + zeros + "\n";
}

TEST_F(AlignCommand, SaysWhatBecameOfAScan) {
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", VisibleCloud()).ok());
  WriteBytes(folder_ / "scan.ply", ScanText(1, 0));
  const WeftRun run = Align({"--scan", folder_ / "scan.ply"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("scan: 1371 points, 1369 of them found a vertex"),
                    HasSubstr("9 hidden vertices follow it"), HasSubstr("1 points without a measurement")));
  // Normals of one side are those of the mesh; of the other they are turned.
  int turned = 0;
  for (const int side : {1, -1}) {
    WriteBytes(folder_ / "scan.ply", ScanText(1, side));
    const WeftRun sided = Align({"--scan", folder_ / "scan.ply", "--json"});
    ASSERT_EQ(sided.status, 0) << sided.err;
    EXPECT_THAT(sided.out, AllOf(HasSubstr("\"found\": 1369"), HasSubstr("\"without_normal\": 1")));
    turned += sided.out.find("\"normals_turned\": true") != std::string::npos;
  }
  EXPECT_EQ(turned, 1);
}

TEST_F(AlignCommand, SaysThatAScanLiesElsewhere) {
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", VisibleCloud()).ok());
  WriteBytes(folder_ / "scan.ply", ScanText(1, 0));
  EXPECT_THAT(Align({"--scan", folder_ / "scan.ply"}).err, Not(HasSubstr("found the cloth")));
  // Axes of another program, y up and z towards us; then a turn by 0.7 degrees, 11 mm at the cloth.
  const Eigen::Matrix3d other = Eigen::Vector3d(1, -1, -1).asDiagonal();
  WriteBytes(folder_ / "scan.ply", ScanText(1, 0, other));
  EXPECT_THAT(
      Align({"--scan", folder_ / "scan.ply"}).err,
      AllOf(HasSubstr("no point of it lies on the cloth"), HasSubstr("in the rig's world with its axes")));
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.012, Eigen::Vector3d::UnitY()));
  WriteBytes(folder_ / "scan.ply", ScanText(1, 0, turn));
  EXPECT_THAT(Align({"--scan", folder_ / "scan.ply"}).err,
              AllOf(HasSubstr("points found the cloth ("), HasSubstr("in the median, as they do by chance")));
}

TEST_F(AlignCommand, RefusesAScanInAnotherUnit) {
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", VisibleCloud()).ok());
  for (const auto& [scale, unit] : {std::pair(1e-3, "metres"), std::pair(0.1, "centimetres")}) {
    WriteBytes(folder_ / "scan.ply", ScanText(scale, 0));
    const WeftRun run = Align({"--scan", folder_ / "scan.ply"});
    EXPECT_EQ(run.status, 2);
    EXPECT_THAT(run.err, HasSubstr(std::string("scan.ply: is in ") + unit));
  }
  WriteBytes(folder_ / "scan.ply",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
             "property float z\nend_header\n500 500 500\n");
  EXPECT_EQ(Align({"--scan", folder_ / "scan.ply"}).status, 2);
}

TEST_F(AlignCommand, TooFewPointsLeaveNoMesh) {
  Cloud cloud = VisibleCloud();
  cloud.points.resize(2);
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", cloud).ok());
  const WeftRun run = Align();
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.err, HasSubstr("cloud.ply: "));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "mesh.ply"));
}

TEST_F(AlignCommand, CloudOfAnotherGarmentIsPointedOut) {
  Cloud cloud = VisibleCloud();
  for (CloudPoint& point : cloud.points) point.node.row += point.node.row < 3 ? 0 : 500;
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", cloud).ok());
  EXPECT_THAT(Align().err, AllOf(HasSubstr("have no vertex in the template"),
                                 HasSubstr("is it the template of this garment?")));
}

TEST_F(AlignCommand, BadInputEndsWithStatus2) {
  EXPECT_THAT(Align().err, HasSubstr("cloud.ply: no such file"));
  ASSERT_TRUE(WriteCloud(folder_ / "cloud.ply", VisibleCloud()).ok());
  const WeftRun preset = Align({"--preset", "fast"});
  EXPECT_EQ(preset.status, 2);
  EXPECT_THAT(preset.err, AllOf(HasSubstr("fast"), HasSubstr("best or paper")));
  const WeftRun out = RunWeft(
      {"align", folder_ / "cloud.ply", "--template", folder_ / "cloth", "--out", folder_ / "no/mesh.ply"});
  EXPECT_EQ(out.status, 2);
  EXPECT_THAT(out.err, HasSubstr("no is missing"));
}

}  // namespace
}  // namespace weft
