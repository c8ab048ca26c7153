#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/results/evaluation/compare_jobs.h"

namespace weft {
namespace {

std::vector<std::string> DifferingParts(const v1::Job& a, const v1::Job& b) {
  std::vector<std::string> parts;
  for (const JobDifference& difference : DifferencesOf(a, b))
    parts.push_back(difference.what + ": " + difference.a + " | " + difference.b);
  return parts;
}

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(JobDifferences, OfTheSameJobThereAreNone) {
  v1::Job job;
  job.mutable_spec()->set_dump("/take");
  EXPECT_THAT(DifferingParts(job, job), IsEmpty());
}

TEST(JobDifferences, ACopiedBoardIsTheSameBoard) {
  v1::Job a, b;
  a.mutable_spec()->set_board("/a/board.json");
  b.mutable_spec()->set_board("/b/board.json");
  EXPECT_THAT(DifferingParts(a, b), IsEmpty());
  b.mutable_inputs()->set_board("ff");
  EXPECT_THAT(DifferingParts(a, b), ElementsAre("board: /a/board.json | /b/board.json (ff)"));
}

TEST(JobDifferences, OptionsAreNamedByTheirPath) {
  v1::Job a, b;
  a.mutable_spec()->mutable_options()->set_frames_alone(true);
  v1::RegistrationOptions& options = *b.mutable_spec()->mutable_options();
  options.mutable_pipeline()->mutable_triangulation()->mutable_consensus()->set_min_views(4);
  b.set_weft_version("0.2.0");
  EXPECT_THAT(DifferingParts(a, b),
              ElementsAre("frames alone: yes | no", "triangulation.consensus.min_views:  | 4",
                          "version of Weft:  | 0.2.0"));
}

}  // namespace
}  // namespace weft
