#include "services/formats/files/cloud_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Cloud TwoPoints() {
  Cloud cloud;
  cloud.points.resize(2);
  cloud.points[0].position_mm = {1.5, -2, 1000.25};
  cloud.points[0].node = {3, 4, NodeKind::kCenter};
  cloud.points[0].views = 7;
  cloud.points[0].sigma_mm = 0.25;
  cloud.points[0].covariance_mm2 << 1, 0.5, 0.25, 0.5, 2, -0.125, 0.25, -0.125, 4;
  cloud.points[0].fold_covariance_mm2.diagonal().setConstant(0.125 * 0.125);
  cloud.points[1].position_mm = {0, 0, 1};
  cloud.points[1].node = {0, 0, NodeKind::kCorner};
  return cloud;
}

// A garment of three vertices with the cells (0, 0), (0, 1) and none.
Template SmallGarment() {
  Template garment;
  garment.id = "small";
  garment.rest = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  garment.node_of_vertex = {{0, 0}, {0, 1}, {-1, -1}};
  return garment;
}

std::string CloudText(const std::string& properties, const std::string& rows) {
  std::string head = "ply\nformat ascii 1.0\nelement vertex " +
                     std::to_string(std::count(rows.begin(), rows.end(), '\n')) +
                     "\nproperty float x\nproperty float y\nproperty float z\n";
  for (size_t at = 0; at < properties.size();) {
    const size_t end = properties.find(' ', at);
    head += "property int " + properties.substr(at, end - at) + "\n";
    at = end == std::string::npos ? end : end + 1;
  }
  return head + "end_header\n" + rows;
}

absl::StatusOr<CloudTargets> ReadTargets(const std::string& path, const Template& garment) {
  const absl::StatusOr<Ply> ply = ReadPly(path);
  return ply.ok() ? TargetsFromPly(*ply, path, garment) : ply.status();
}

TEST(CloudFile, ReadsBackWithAndWithoutCovariance) {
  const TempFolder folder;
  const Cloud cloud = TwoPoints();
  for (const CloudColumns columns : {CloudColumns::kPlain, CloudColumns::kWithCovariance}) {
    ASSERT_TRUE(WriteCloud(folder / "cloud.ply", cloud, columns).ok());
    const auto back = ReadCloud(folder / "cloud.ply");
    ASSERT_TRUE(back.ok()) << back.status();
    ASSERT_EQ(back->points.size(), 2u);
    EXPECT_EQ(back->points[0].position_mm, cloud.points[0].position_mm);
    EXPECT_EQ(back->points[0].node, cloud.points[0].node);
    EXPECT_EQ(back->points[0].views, 7);
    EXPECT_EQ(back->points[0].sigma_mm, 0.25);
    EXPECT_EQ(back->points[1].node.kind, NodeKind::kCorner);
    const Eigen::Matrix3d expected =
        columns == CloudColumns::kPlain ? Eigen::Matrix3d::Zero() : cloud.points[0].covariance_mm2;
    EXPECT_EQ(back->points[0].covariance_mm2, expected);
    // Without covariances its size is kept.
    EXPECT_EQ(back->points[0].fold_covariance_mm2, cloud.points[0].fold_covariance_mm2);
  }
}

TEST(CloudFile, GivesThePointsBackAsTheyAreInFiles) {
  const TempFolder folder;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  Cloud cloud;
  for (int i = 0; i < 500; ++i) {
    CloudPoint& point = cloud.points.emplace_back();
    point.position_mm = 2000 * Eigen::Vector3d(any(random), any(random), any(random));
    point.node = {i / 20, i % 20, NodeKind::kCenter};
    const Eigen::Matrix3d m = Eigen::Matrix3d::NullaryExpr([&] { return 0.1 * any(random); });
    point.covariance_mm2 = m * m.transpose();
    point.sigma_mm = std::sqrt(point.covariance_mm2.trace() / 3);
    point.fold_covariance_mm2 = point.covariance_mm2 * (i % 3 == 0 ? 1.0 : 0.3);  // all of it, or a part
  }
  ASSERT_TRUE(WriteCloud(folder / "cloud.ply", cloud, CloudColumns::kWithCovariance).ok());
  const auto back = ReadCloud(folder / "cloud.ply");
  ASSERT_TRUE(back.ok()) << back.status();
  const Cloud here = AsInFile(cloud);
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const CloudPoint &a = here.points[i], &b = back->points[i];
    EXPECT_EQ(a.position_mm, b.position_mm);
    EXPECT_EQ(a.sigma_mm, b.sigma_mm);
    EXPECT_EQ(a.covariance_mm2, b.covariance_mm2);
    EXPECT_EQ(a.fold_covariance_mm2, b.fold_covariance_mm2);
    EXPECT_LE(a.fold_covariance_mm2.trace(), 3 * a.sigma_mm * a.sigma_mm) << "folds are a part of the whole";
    EXPECT_TRUE(a.position_mm.isApprox(cloud.points[i].position_mm, 1e-6));
  }
}

TEST(CloudFile, RaysComeBackAsTheyAreInFiles) {
  const TempFolder folder;
  Cloud cloud = TwoPoints();
  cloud.rays = {{{0, 1}, {100.1, -200.2, 1500.3}, Eigen::Vector3d(0.1, 0.3, -0.9).normalized(), 1.23e-4},
                {{7, 9, NodeKind::kCorner}, {1, 2, 3}, {0, 0, 1}, 0}};
  ASSERT_TRUE(WriteCloud(folder / "cloud.ply", cloud).ok());
  const auto back = ReadCloud(folder / "cloud.ply");
  ASSERT_TRUE(back.ok()) << back.status();
  const Cloud here = AsInFile(cloud);
  ASSERT_EQ(back->rays.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back->rays[i].node, cloud.rays[i].node);
    EXPECT_EQ(back->rays[i].origin_mm, here.rays[i].origin_mm);
    EXPECT_EQ(back->rays[i].direction, here.rays[i].direction);
    EXPECT_EQ(back->rays[i].sigma_rad, here.rays[i].sigma_rad);
    EXPECT_TRUE(here.rays[i].origin_mm.isApprox(cloud.rays[i].origin_mm, 1e-7));
  }
  const auto targets = ReadTargets(folder / "cloud.ply", SmallGarment());
  ASSERT_TRUE(targets.ok()) << targets.status();
  ASSERT_EQ(targets->rays.size(), 1u);
  EXPECT_EQ(targets->rays[0].vertex, 1);
  EXPECT_EQ(targets->rays[0].direction, here.rays[0].direction);
}

TEST(CloudFile, NamesRowAndPropertyOfARay) {
  const TempFolder folder;
  const auto error = [&](const std::string& row) {
    std::string text = CloudText("board_row board_col", "0 0 0 1 1\n");
    const std::string element =
        "element ray 1\nproperty float x\nproperty float y\nproperty float z\nproperty float dx\n"
        "property float dy\nproperty float dz\nproperty int board_row\nproperty int board_col\n"
        "property uchar kind\nproperty float sigma_rad\n";
    text.insert(text.find("end_header"), element);
    WriteBytes(folder / "cloud.ply", text + row);
    const auto cloud = ReadCloud(folder / "cloud.ply");
    EXPECT_THAT(cloud.status().message(), HasSubstr("cloud.ply: element ray, row 0"));
    EXPECT_EQ(ReadTargets(folder / "cloud.ply", SmallGarment()).status(), cloud.status());
    return std::string(cloud.status().message());
  };
  EXPECT_THAT(error("0 0 0 0.5 0 0 1 1 0 0.1\n"), HasSubstr("must be 1"));
  EXPECT_THAT(error("0 0 0 0 0 3 1 1 0 0.1\n"), HasSubstr("property dz: 3"));
  EXPECT_THAT(error("0 nan 0 0 0 1 1 1 0 0.1\n"), HasSubstr("property y"));
  EXPECT_THAT(error("0 0 0 0 0 1 1 -1 0 0.1\n"), HasSubstr("property board_col: -1"));
  EXPECT_THAT(error("0 0 0 0 0 1 1 1 2 0.1\n"), HasSubstr("property kind: 2"));
  EXPECT_THAT(error("0 0 0 0 0 1 1 1 0 -1\n"), HasSubstr("property sigma_rad: -1"));
}

TEST(CloudFile, PointsComeInTheOrderOfTheirNodes) {
  const TempFolder folder;
  WriteBytes(folder / "cloud.ply",
             CloudText("board_row board_col kind", "0 0 1 2 0 0\n0 0 2 1 5 1\n0 0 3 1 5 0\n"));
  const auto cloud = ReadCloud(folder / "cloud.ply");
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->points[0].position_mm.z(), 3);
  EXPECT_EQ(cloud->points[1].position_mm.z(), 1);
  EXPECT_EQ(cloud->points[2].position_mm.z(), 2);
}

TEST(CloudFile, NamesFileRowAndProperty) {
  const TempFolder folder;
  const auto error = [&](const std::string& properties, const std::string& rows) {
    WriteBytes(folder / "cloud.ply", CloudText(properties, rows));
    const auto cloud = ReadCloud(folder / "cloud.ply");
    EXPECT_EQ(cloud.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(cloud.status().message(), HasSubstr("cloud.ply"));
    return std::string(cloud.status().message());
  };
  EXPECT_THAT(error("board_row", "0 0 0 1\n"), HasSubstr("no property board_col"));
  EXPECT_THAT(error("board_row board_col", "0 0 0 1 1\n0 0 0 -1 1\n"),
              AllOf(HasSubstr("row 1"), HasSubstr("board_row: -1")));
  EXPECT_THAT(error("board_row board_col kind", "0 0 0 1 1 2\n"), HasSubstr("property kind: 2"));
  EXPECT_THAT(error("board_row board_col", "0 0 0 1 2\n5 5 5 1 2\n"),
              HasSubstr("centre at row 1, column 2 occurs twice"));
  EXPECT_THAT(error("board_row board_col", "0 inf 0 1 2\n"), HasSubstr("property y"));
}

TEST(ReadTargets, ByBoardCellOrByTemplateVertex) {
  const TempFolder folder;
  const Template garment = SmallGarment();
  WriteBytes(folder / "cells.ply", CloudText("board_row board_col", "0 0 9 5 5\n0 0 7 0 1\n"));
  const auto by_cell = ReadTargets(folder / "cells.ply", garment);
  ASSERT_TRUE(by_cell.ok()) << by_cell.status();
  ASSERT_EQ(by_cell->targets.size(), 1u);
  EXPECT_EQ(by_cell->targets[0].vertex, 1);
  EXPECT_EQ(by_cell->targets[0].position_mm.z(), 7);
  EXPECT_EQ(by_cell->unclaimed, 1);

  WriteBytes(folder / "vertices.ply", CloudText("template_vertex", "0 0 3 2\n0 0 9 -1\n0 0 1 0\n"));
  const auto by_vertex = ReadTargets(folder / "vertices.ply", garment);
  ASSERT_TRUE(by_vertex.ok()) << by_vertex.status();
  ASSERT_EQ(by_vertex->targets.size(), 2u);
  EXPECT_EQ(by_vertex->targets[0].vertex, 0);
  EXPECT_EQ(by_vertex->targets[1].position_mm.z(), 3);
  EXPECT_EQ(by_vertex->unclaimed, 1);
}

TEST(ReadTargets, RefusesVerticesOffTheTemplateAndCloudsWithoutNames) {
  const TempFolder folder;
  const auto error = [&](const std::string& properties, const std::string& rows) {
    WriteBytes(folder / "cloud.ply", CloudText(properties, rows));
    return std::string(ReadTargets(folder / "cloud.ply", SmallGarment()).status().message());
  };
  EXPECT_THAT(error("template_vertex", "0 0 0 3\n"), HasSubstr("template_vertex: 3"));
  EXPECT_THAT(error("template_vertex", "0 0 0 1\n1 1 1 1\n"), HasSubstr("vertex 1 occurs twice"));
  EXPECT_THAT(error("quality", "0 0 0 1\n"),
              HasSubstr("neither board_row and board_col nor template_vertex"));
}

}  // namespace
}  // namespace weft
