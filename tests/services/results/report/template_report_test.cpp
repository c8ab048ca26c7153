#include "services/results/report/template_report.h"

#include <gtest/gtest.h>

#include "tests/services/results/report/page_data.h"
#include "tests/services/results/report/proto_text.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {
namespace {

// Two panels of two cells each with a seam between them, sewn at the middle vertex 4.
BuiltTemplate SewnSquare() {
  BuiltTemplate built;
  built.garment.id = "bib";
  built.garment.rest = {{{0, 0, 0}, {10, 0, 0}, {10, 20, 0}, {0, 20, 0}, {5, 10, 1}},
                        {{0, 4, 1}, {1, 4, 2}, {2, 4, 3}, {3, 4, 0}}};
  built.sheet.cell_of_vertex = {{3, 1}, {3, 2}, {5, 7}, {5, 6}};
  built.sheet.loops = {{0, 1}, {2, 3}};
  built.parts.texture_mm = {{0, 1}, {10, 1}, {10, 21.5}, {0, 21.5}, {5, 11}};
  Seam& seam = built.parts.seams.emplace_back();
  seam.side_a = {1, 0}, seam.side_b = {2, 3}, seam.middle = {4};
  seam.panel_a = 0, seam.panel_b = 1, seam.length_mm = 10;
  TemplateBorder& opening = built.parts.openings.emplace_back();
  opening.loop = {0, 1, 2, 3}, opening.length_mm = 60, opening.panels = {0, 1};
  built.closed_holes.emplace_back().length_mm = 7;
  built.strain.of_vertex = {0.01, -0.02, 0.03, 0, 0.005};
  built.measured_pitch_mm = 2.95;
  built.seam_faces = 2, built.filled_cells = 11, built.speck_cells = 12, built.contradicting_points = 13;
  built.reference = 1;
  return built;
}

TEST(TemplateReport, ThePageHoldsWhatWasBuilt) {
  v1::TemplateSummary summary;
  summary.set_hash("0123");
  const auto page =
      MakeTemplateReport(SewnSquare(), summary, {"board.json", "panels.txt", {"a.ply", "b.ply"}});
  ASSERT_TRUE(page.ok()) << page.status();
  EXPECT_NE(page->find("<title>Template bib</title>"), std::string::npos);
  EXPECT_EQ(MemberOf<v1::TemplateSummary>(*page, "summary").hash(), "0123");
  EXPECT_EQ(MemberOf<v1::Template>(*page, "template").seams(0).length_mm(), 10);
  v1::TemplatePage shown = MemberOf<v1::TemplatePage>(*page, "page");
  ASSERT_EQ(shown.sewn_size(), 2);
  ASSERT_EQ(shown.strain().pictures_size(), 2);
  EXPECT_EQ(shown.strain().key().scale().colors_size(), 17);
  EXPECT_NE(shown.sewn(0).bytes(), shown.strain().pictures(0).bytes());
  shown.clear_sewn();
  shown.mutable_strain()->clear_pictures();
  shown.mutable_strain()->mutable_key()->mutable_scale()->clear_colors();
  EXPECT_EQ(
      shown.DebugString(),
      TextOf<v1::TemplatePage>(
          R"(seam_faces: 2 outlines { cells: 1 cells: 3 cells: 2 cells: 3 texture_mm: 0 texture_mm: 1 texture_mm: 10
texture_mm: 1 } outlines { cells: 7 cells: 5 cells: 6 cells: 5 texture_mm: 10 texture_mm: 21.5
texture_mm: 0 texture_mm: 21.5 } seams { color: "#e03f29" side_a { cells: 2 cells: 3 cells: 1 cells: 3
texture_mm: 10 texture_mm: 1 texture_mm: 0 texture_mm: 1 } side_b { cells: 7 cells: 5 cells: 6 cells: 5
texture_mm: 10 texture_mm: 21.5 texture_mm: 0 texture_mm: 21.5 } } closed_holes { length_mm: 7 } strain {
title: "Distance from the print" key { scale { high: 3 label: "strain" unit: "%" bounded: true } } }
measured_pitch_mm: 2.95 filled_cells: 11 contradicting_points: 13 speck_cells: 12 board: "board.json"
panels: "panels.txt" clouds: "a.ply" clouds: "b.ply" reference: 1)"));
}

// Hues a golden angle apart.
TEST(TemplateReport, SeamsHaveColoursOfTheirOwn) {
  BuiltTemplate built = SewnSquare();
  for (int i = 1; i < 7; ++i) built.parts.seams.push_back(built.parts.seams[0]);
  const auto page = MakeTemplateReport(built, {}, {});
  ASSERT_TRUE(page.ok()) << page.status();
  std::string colors;
  const v1::TemplatePage shown = MemberOf<v1::TemplatePage>(*page, "page");
  for (const v1::TemplatePage::Seam& seam : shown.seams()) colors += seam.color() + " ";
  EXPECT_EQ(colors, R"(#e03f29 #1b36bb #99e755 #e029b3 #1bbbb4 #e7b655 #6d29e0 )");
}

TEST(TemplateReport, WhatCannotBeDrawnIsAnError) {
  BuiltTemplate built = SewnSquare();
  built.garment.rest.faces.clear();
  EXPECT_EQ(MakeTemplateReport(built, {}, {}).status().message(), "the mesh has no faces");
  built = SewnSquare();
  built.strain.of_vertex.pop_back();
  EXPECT_EQ(MakeTemplateReport(built, {}, {}).status().message(), "colors: there are 4 for 5 vertices");
}

}  // namespace
}  // namespace weft
