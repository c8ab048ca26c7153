#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "services/results/report/report_sections.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Coverage rises with the number.
std::vector<v1::FrameReport> DoneFrames(int count) {
  std::vector<v1::FrameReport> frames;
  for (int i = 0; i < count; ++i) {
    v1::FrameReport& frame = frames.emplace_back();
    frame.set_frame("f" + std::to_string(i));
    frame.set_state(v1::FRAME_STATE_DONE);
    frame.mutable_mesh()->set_coverage(0.5 + 0.01 * i);
  }
  return frames;
}

TEST(FrameSections, LongTablesFoldBehindTheLowestCoverage) {
  EXPECT_THAT(FrameSection({}), HasSubstr("No frame has a report."));
  EXPECT_THAT(FrameSection(DoneFrames(40)), Not(HasSubstr("<details>")));
  const std::string html = FrameSection(DoneFrames(41));
  const std::string shown = html.substr(0, html.find("<details>"));
  EXPECT_THAT(html, HasSubstr("<summary>All 41 frames</summary>"));
  EXPECT_THAT(shown, HasSubstr("<bdi>f4</bdi>"));
  EXPECT_THAT(shown, Not(HasSubstr("<bdi>f5</bdi>")));
}

TEST(FrameSections, FramesThatFailedAreAlwaysShown) {
  std::vector<v1::FrameReport> frames = DoneFrames(41);
  frames[30].set_state(v1::FRAME_STATE_FAILED);
  frames[30].mutable_temporal()->set_bridged(true);
  const std::string html = FrameSection(frames);
  EXPECT_THAT(html.substr(0, html.find("<details>")),
              HasSubstr("<bdi>f30</bdi></td><td><span class=\"state bad\">&#10005; bridged</span></td>"
                        "<td>\xE2\x80\x93</td>"));
}

TEST(FrameSections, RemarksSayWhatUntanglingCost) {
  std::vector<v1::FrameReport> frames = DoneFrames(1);
  frames[0].set_reason("a<b");
  frames[0].mutable_mesh()->set_demoted(1);
  frames[0].mutable_mesh()->set_self_intersections(2);
  EXPECT_THAT(FrameSection(frames),
              HasSubstr("<td>a&lt;b; 2 pairs of faces intersect; 1 observed vertex moved "
                        "to undo a self-intersection</td>"));
  // The refinement counts anew.
  frames[0].mutable_temporal()->set_refined(true);
  EXPECT_THAT(FrameSection(frames), Not(HasSubstr("intersect;")));
}

TEST(FrameSections, PlotsMarkFramesWithoutAMesh) {
  EXPECT_EQ(PlotSection({}), "");
  std::vector<v1::FrameReport> frames = DoneFrames(2);
  EXPECT_THAT(PlotSection(frames), Not(HasSubstr("Red triangles")));
  frames[1].set_state(v1::FRAME_STATE_CANCELLED);
  EXPECT_THAT(PlotSection(frames), HasSubstr("Red triangles mark frames without a mesh."));
}

TEST(FrameSections, DrivenJobsPlotRaysInsteadOfCoverage) {
  std::vector<v1::FrameReport> frames = DoneFrames(1);
  frames[0].mutable_driven()->set_rays(100);
  const std::string html = PlotSection(frames);
  EXPECT_THAT(html, HasSubstr("Rays: cells seen by a camera"));
  EXPECT_THAT(html, Not(HasSubstr("Coverage")));
}

}  // namespace
}  // namespace weft
