#include "services/tools/cli/json_output.h"

#include <gtest/gtest.h>

#include "services/formats/files/json_file.h"
#include "weft/v1/job.pb.h"

namespace weft {
namespace {

TEST(JsonOutput, IsTheMessageAsProgramsReadIt) {
  v1::Job job;
  job.set_id("20260101-1");
  job.set_message("a \"quoted\" word");
  ::testing::internal::CaptureStdout();
  const absl::Status status = PrintJsonMessage(job);
  const std::string printed = ::testing::internal::GetCapturedStdout();
  EXPECT_TRUE(status.ok());
  v1::Job read;
  ASSERT_TRUE(ParseJson(printed, "stdout", read).ok()) << printed;
  EXPECT_EQ(read.id(), "20260101-1");
  EXPECT_EQ(read.message(), "a \"quoted\" word");
}

TEST(JsonOutput, IsPrintedWhereItIsAskedFor) {
  v1::Job job;
  job.set_id("20260101-1");
  const auto printed = [&job](bool as_json) {
    ::testing::internal::CaptureStdout();
    EXPECT_TRUE(PrintMessage(job, as_json, "a job\n").ok());
    return ::testing::internal::GetCapturedStdout();
  };
  EXPECT_EQ(printed(false), "a job\n");
  EXPECT_EQ(printed(true).find("{\n \"id\": \"20260101-1\","), 0u);
}

}  // namespace
}  // namespace weft
