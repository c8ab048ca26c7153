#include "services/tools/cli/template_summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/services/tools/cli/run_aloud.h"

namespace weft {
namespace {

v1::TemplateSummary SummaryOfShirt() {
  v1::TemplateSummary summary;
  summary.set_id("shirt");
  summary.set_vertices(13000);
  summary.set_panels(5);
  summary.set_seams(4);
  summary.set_components(1);
  for (const double length_mm : {900.4, 600.0, 200.0, 200.0}) summary.add_openings_mm(length_mm);
  return summary;
}

TEST(TemplateSummaries, HaveAHeadline) {
  EXPECT_EQ(TemplateHeadline(SummaryOfShirt()), "5 panels, 4 seams, 4 openings, 13,000 vertices");
  v1::TemplateSummary bare;
  bare.set_vertices(1);
  bare.add_openings_mm(7);
  EXPECT_EQ(TemplateHeadline(bare), "1 opening, 1 vertex");
}

TEST(TemplateSummaries, ListOpeningsWhereTheirCountIsWrong) {
  EXPECT_TRUE(CheckOpeningCount(SummaryOfShirt(), 4).ok());
  EXPECT_TRUE(CheckOpeningCount(SummaryOfShirt(), -1).ok());
  const absl::Status status = CheckOpeningCount(SummaryOfShirt(), 3);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(),
            "the garment has 4 openings, expected were 3. Lengths of their borders: 900 mm, 600 mm, 200 mm, "
            "200 mm");
  EXPECT_FALSE(CheckOpeningCount({}, 1).ok());
}

TEST(TemplateSummaries, AreUsableWithLoosePiecesHandlesOrWarnings) {
  EXPECT_EQ(TemplateVerdict(SummaryOfShirt()).grade(), v1::GRADE_GOOD);
  v1::TemplateSummary loose = SummaryOfShirt();
  loose.set_components(2);
  EXPECT_EQ(TemplateVerdict(loose).grade(), v1::GRADE_USABLE);
  EXPECT_EQ(TemplateVerdict(loose).reason(), "the garment is in 2 disconnected pieces");
  v1::TemplateSummary handle = SummaryOfShirt();
  handle.set_handles(1);
  EXPECT_EQ(TemplateVerdict(handle).grade(), v1::GRADE_USABLE);
  v1::TemplateSummary warned = SummaryOfShirt();
  warned.add_warnings("panel 3 is small");
  EXPECT_EQ(TemplateVerdict(warned).reason(), "panel 3 is small");
}

TEST(TemplateSummaries, TakeTheScaleThatIsFurthestFromThePrint) {
  TemplateSize size;
  size.scales.resize(3);
  size.scales[0].median = 1.01;
  size.scales[1].median = 0.95;
  size.scales[2].median = 0;  // nothing is printed
  v1::TemplateSummary summary;
  AddPrintScale(size, &summary);
  EXPECT_DOUBLE_EQ(summary.print_scale(), 0.95);
  v1::TemplateSummary none;
  AddPrintScale({}, &none);
  EXPECT_FALSE(none.has_print_scale());
}

TEST(TemplateSummaries, NameATemplateByItsFolder) {
  EXPECT_EQ(TemplateIdOf("garments/shirt"), "shirt");
  EXPECT_EQ(TemplateIdOf("garments/shirt/"), "shirt");
  EXPECT_EQ(TemplateIdOf("garments/x/../shirt"), "shirt");
  for (const char* path : {"", ".", "..", "/"}) EXPECT_EQ(TemplateIdOf(path), "template") << path;
}

// A sheet of 3 x 2 vertices, 10 mm apart; the left half is one panel and the right half another, sewn in the
// middle.
Template Sheet() {
  Template garment;
  garment.id = "sheet";
  garment.board_hash = "abc";
  for (int row = 0; row < 2; ++row)
    for (int col = 0; col < 3; ++col) {
      garment.rest.vertices_mm.emplace_back(10 * col, -10 * row, 0);
      garment.node_of_vertex.push_back({row, col, col == 2 ? NodeKind::kCorner : NodeKind::kCenter});
    }
  garment.rest.faces = {{0, 3, 1}, {1, 3, 4}, {1, 4, 2}, {2, 4, 5}};
  return garment;
}

GarmentParts PartsOfSheet() {
  GarmentParts parts;
  parts.cell_mm = 10;
  parts.panels.resize(2);
  parts.panels[0].cells = 3;
  parts.panels[1].cells = 1;
  parts.seams.resize(1);
  parts.seams[0].side_a = {1, 4};
  parts.seams[0].side_b = {4, 1};
  parts.openings.resize(1);
  parts.openings[0].loop = {0, 3, 4, 5, 2, 1};
  parts.expected_openings = 1;
  parts.panel_faces = 4;
  parts.texture_side_mm = 40;
  for (const Eigen::Vector3d& v : Sheet().rest.vertices_mm)
    parts.texture_mm.emplace_back(0.8 * v.x(), 10 + v.y());
  return parts;
}

TEST(TemplateSummaries, CountWhatATemplateHas) {
  auto summary = SummarizeTemplate(Sheet(), PartsOfSheet());
  ASSERT_TRUE(summary.ok()) << summary.status();
  // Of the nine edges four run along x, which is 8 mm on the print, three along y and two across.
  EXPECT_NEAR(summary->strain_median(), std::sqrt(200.0 / 164) - 1, 1e-9);
  EXPECT_NEAR(summary->strain_p95(), 0.25, 1e-12);
  summary->clear_strain_median();
  summary->clear_strain_p95();
  EXPECT_EQ(TextOf(*summary),
            "id: \"sheet\" hash: \"" + Sheet().ContentHash() +
                "\" board_hash: \"abc\" vertices: 6 vertices_with_cell: 4 faces: 4 components: 1 "
                "euler: 1 openings_mm: 60 expected_openings: 1 panels: 2 seams: 1 texture_coverage: "
                "0.25 vertices_with_corner: 2");
  GarmentParts bare;
  const auto imported = SummarizeTemplate(Sheet(), bare);
  ASSERT_TRUE(imported.ok());
  EXPECT_FALSE(imported->has_expected_openings());
  EXPECT_FALSE(imported->has_strain_median());
  bare.expected_openings = 0;
  EXPECT_TRUE(SummarizeTemplate(Sheet(), bare)->has_expected_openings());
}

TEST(TemplateSummaries, SeamsAndOpeningsLieInTheMesh) {
  GarmentParts parts = PartsOfSheet();
  parts.seams[0].side_b = {4, 0};
  EXPECT_EQ(SummarizeTemplate(Sheet(), parts).status(),
            absl::FailedPreconditionError("seam 0 runs from vertex 4 to 0, where the mesh has no edge"));
  parts = PartsOfSheet();
  parts.openings[0].loop.pop_back();
  EXPECT_EQ(SummarizeTemplate(Sheet(), parts).status(),
            absl::FailedPreconditionError("opening 0 of template.json is no border of the mesh"));
}

TEST(TemplateSummaries, AreTextForPeople) {
  const auto summary = FromText<v1::TemplateSummary>(R"(
    id: "shirt" hash: "0a" vertices: 13000 faces: 25000 vertices_with_cell: 12000 vertices_with_corner: 900 components: 2
    euler: -3 handles: 1 openings_mm: 900.4 openings_mm: 200 panels: 5 seams: 1 texture_coverage: 0.62
    print_scale: 1.01234 print_scale_along_axis: 0.98765 strain_median: 0.0012 strain_p95: 0.0345)");
  EXPECT_EQ(TemplateSummaryText(summary),
            "shirt: 13,000 vertices, 25,000 faces, 12,000 vertices with a cell, 900 on a corner, hash 0a\n"
            "surface  clean, 2 pieces, Euler characteristic -3, 1 handle\n"
            "openings 2: 900 mm, 200 mm\n"
            "parts    5 panels, 1 seam\n"
            "texture  panels cover 62 % of its square\n"
            "size     edges are 1.0123 times as long as on the print in the median\n"
            "         0.9877 times along the direction that is furthest off\n"
            "rest     edges within 0.1 % of the print (median), 3.5 % (95 of 100)\n");
  EXPECT_EQ(TemplateSummaryText({}),
            ": 0 vertices, 0 faces, 0 vertices with a cell, hash \nsurface  clean, 0 pieces, Euler "
            "characteristic 0, 0 "
            "handles\nopenings 0: none\n");
}

TEST(TemplateSummaries, AreGradedBySizeAndStrain) {
  const auto checks = [](const std::string& more) {
    const auto summary = FromText<v1::TemplateSummary>("vertices: 1 " + more);
    std::vector<std::string> said;
    const v1::Verdict verdict = TemplateVerdict(summary);
    for (const v1::VerdictCheck& check : verdict.checks()) said.push_back(check.id() + " " + check.value());
    return said;
  };
  EXPECT_THAT(checks(""), testing::IsEmpty());
  EXPECT_THAT(checks("print_scale: 1.01 print_scale_along_axis: 0.97"),
              testing::ElementsAre("template.scale 3.0 %"));
  EXPECT_THAT(checks("strain_p95: 0.025"), testing::ElementsAre("template.strain 2.5 %"));
  const v1::Verdict handles = TemplateVerdict(FromText<v1::TemplateSummary>("handles: 2"));
  EXPECT_EQ(handles.reason(), "the surface has 2 handles: cloth that is sewn to cloth it does not touch");
  TemplateSize size;
  size.scales.resize(2);
  size.scales[0].median = 1.02, size.scales[0].along_axis = 0.9;
  size.scales[1].median = 0.95, size.scales[1].along_axis = 0.94;
  v1::TemplateSummary summary;
  AddPrintScale(size, &summary);
  EXPECT_EQ(TextOf(summary), "print_scale: 1.02 print_scale_along_axis: 0.9");
}

}  // namespace
}  // namespace weft
