#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "services/results/report/job_summary.h"
#include "services/results/report/report_sections.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(JobSections, TablesWithoutAHeadingHaveNone) {
  EXPECT_EQ(TableRow("th", {"a", "b"}), "<tr><th>a</th><th>b</th></tr>\n");
  EXPECT_THAT(Table({}, "", "facts"), Not(HasSubstr("<thead>")));
  EXPECT_EQ(Section("id", "Heading", "body"), "<section id=\"id\">\n<h2>Heading</h2>\nbody</section>\n");
}

TEST(JobSections, FiftyWarningsAreShown) {
  v1::Job job;
  EXPECT_EQ(WarningSection(job, {}), "");
  job.add_warnings("a<b");
  EXPECT_THAT(WarningSection(job, {"note"}), HasSubstr("<li>a&lt;b</li>\n<li>note</li>\n</ul>"));
  const std::string html = WarningSection(job, std::vector<std::string>(51, "note"));
  EXPECT_THAT(html, HasSubstr("<li>and 2 more</li>"));
}

TEST(JobSections, InputsSayWhichFramesWereAskedFor) {
  v1::Job job;
  EXPECT_THAT(InputSection(job, {}), HasSubstr("<td>all frames of the dump</td>"));
  job.mutable_spec()->set_first_frame(2);
  EXPECT_THAT(InputSection(job, {}), HasSubstr("<td>from position 2 to the end</td>"));
  job.mutable_spec()->set_end_frame(5);
  EXPECT_THAT(InputSection(job, {}), HasSubstr("<td>positions 2 to 4 of the dump</td>"));
  job.mutable_spec()->set_frames("<7");
  EXPECT_THAT(InputSection(job, {}), HasSubstr("<td>&lt;7</td>"));
}

TEST(JobSections, InputsNameTheTakeAndEveryVersionOnce) {
  const TempFolder folder;
  WriteBytes(folder / "take.json", R"({"slate": "12A"})");
  v1::Job job;
  job.mutable_spec()->set_dump(folder.path());
  std::vector<v1::FrameReport> frames(2);
  for (v1::FrameReport& frame : frames) {
    frame.set_threads(4);
    v1::StageKey& key = *frame.add_keys();
    key.set_stage("rigid_fit");
    key.set_version(3);
  }
  const std::string html = InputSection(job, frames);
  EXPECT_THAT(html, HasSubstr("<td>Slate</td><td>12A</td>"));
  EXPECT_THAT(html, HasSubstr("<td>4 per frame</td>"));
  EXPECT_THAT(html, HasSubstr("<td>rigid fit 3</td>"));
}

TEST(JobSections, TheHeadSaysThatAJobIsNotFinished) {
  v1::Job job;
  JobSummary summary;
  summary.coverage = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(HeadSection(job, summary), HasSubstr("not finished"));
  job.mutable_verdict()->set_grade(v1::GRADE_GOOD);
  EXPECT_THAT(HeadSection(job, summary), Not(HasSubstr("not finished")));
}

}  // namespace
}  // namespace weft
