#include "services/server/rpc/result_names.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

// As docs/file-formats.md lists them.
TEST(ResultNames, AreThoseOfTheFormats) {
  EXPECT_EQ(ResultFileName(v1::RESULT_KIND_MESH), "mesh.ply");
  EXPECT_EQ(ResultFileName(v1::RESULT_KIND_CLOUD), "cloud.ply");
  EXPECT_EQ(ResultFileName(v1::RESULT_KIND_CLOUD_PCD), "cloud.pcd");
  EXPECT_EQ(ResultFileName(v1::RESULT_KIND_OBSERVATIONS), "observations.csv");
  EXPECT_EQ(ResultFileName(v1::RESULT_KIND_FRAME_REPORT), "report.json");
  EXPECT_EQ(ResultFileName(v1::RESULT_KIND_JOB), "job.json");
  EXPECT_EQ(ResultFileName(v1::RESULT_KIND_JOB_REPORT), "report.html");
}

TEST(ResultNames, AreEmptyForWhatIsNoKind) {
  EXPECT_EQ(ResultFileName(v1::RESULT_KIND_UNSPECIFIED), "");
  EXPECT_EQ(ResultFileName(static_cast<v1::ResultKind>(99)), "");
}

}  // namespace
}  // namespace weft
