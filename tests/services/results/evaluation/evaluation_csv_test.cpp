#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "services/results/evaluation/evaluation_text.h"

namespace weft {
namespace {

TEST(EvaluationCsv, FramesWithoutMeasuresHaveEmptyFields) {
  JobEvaluation evaluation;
  const std::string heading = FrameCsv(evaluation);
  evaluation.frames.emplace_back().frame = "frame \"7\"";
  const auto columns = static_cast<size_t>(std::count(heading.begin(), heading.end(), ','));
  EXPECT_GT(columns, 8u);
  EXPECT_EQ(FrameCsv(evaluation), heading + "\"frame \"\"7\"\"\"" + std::string(columns, ',') + "\n");
}

TEST(EvaluationCsv, CamerasWithoutErrorsKeepTheirCounts) {
  JobEvaluation evaluation;
  CameraErrors& camera = evaluation.cameras.emplace_back();
  camera.camera_id = "c01";
  camera.observations = 10, camera.outliers = 3;
  EXPECT_THAT(CameraCsv(evaluation), ::testing::EndsWith("\nc01,10,3,,,,,,\n"));
}

}  // namespace
}  // namespace weft
