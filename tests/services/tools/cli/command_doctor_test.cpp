// weft doctor.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"
#include "weft/v1/doctor.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class CommandDoctor : public ::testing::Test {
 protected:
  CommandRun Doctor(std::vector<std::string> words) const {
    words.insert(words.begin(), {"doctor", "--dir", folder_.path(), "--no-cameras", "--disk-test-gib", "0"});
    return RunCommand(AddDoctorCommand, std::move(words));
  }

  const TempFolder folder_;
};

// What is found depends on the machine; the folder is there.
TEST_F(CommandDoctor, TellsWhatItFoundAndEndsAsItsVerdict) {
  const CommandRun run = Doctor({"--json"});
  v1::DoctorReport report;
  ASSERT_TRUE(ParseJson(run.out, "report", report).ok()) << run.out;
  EXPECT_EQ(run.status.ok(), report.verdict().grade() != v1::GRADE_BAD);
  EXPECT_NE(report.verdict().grade(), v1::GRADE_UNSPECIFIED);
  bool has_disk = false, has_programs = false;
  for (const v1::DoctorFinding& finding : report.findings()) {
    has_disk |= finding.found().find(folder_.path()) != std::string::npos ||
                finding.subject().find(folder_.path()) != std::string::npos || finding.subject() == "disk";
    has_programs |= finding.subject().find("program") != std::string::npos;
    EXPECT_NE(finding.subject(), "cameras");
  }
  EXPECT_TRUE(has_disk) << run.out;
  EXPECT_TRUE(has_programs) << run.out;
  const CommandRun text = Doctor({});
  EXPECT_EQ(text.out.find('{'), std::string::npos);
  EXPECT_GT(text.out.size(), 100u);
}

TEST_F(CommandDoctor, ASessionThatIsNoneIsNamedBeforeTheWork) {
  const CommandRun run = Doctor({"--session", folder_ / "session.json"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(run.message(), HasSubstr(folder_ / "session.json"));
  EXPECT_EQ(run.out, "");
}

}  // namespace
}  // namespace weft
