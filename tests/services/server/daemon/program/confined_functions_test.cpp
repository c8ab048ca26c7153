// What functions of a job may read and write: here they try.
#include "services/server/daemon/program/confined_functions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "services/ground/confinement/confinement.h"
#include "services/server/daemon/program/daemon.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class ConfinedFunctionsTest : public ::testing::Test {
 protected:
  ConfinedFunctionsTest() {
    options_.allow_paths = {root_};
    options_.state_folder = root_ + "/state";
    for (const char* file : {"/take/0000/a.png", "/rig/rig.json", "/out/job.json", "/other/secret"})
      WriteBytes(root_ + file, "x");
    job_.mutable_spec()->set_dump(root_ + "/take");
    job_.mutable_spec()->set_rig(root_ + "/rig/rig.json");
    job_.mutable_spec()->set_out(root_ + "/out");
  }
  // "take", "rig", "other" and so on where a file can be read, "+out" where one can be written.
  std::string Reach() const {
    std::string reach;
    for (const char* file : {"take/0000/a.png", "rig/rig.json", "out/job.json", "other/secret"}) {
      const std::string folder = fs::path(file).begin()->string();
      if (std::ifstream(root_ + "/" + file).good()) reach += folder + " ";
      if (std::ofstream(root_ + "/" + folder + "/new").good()) reach += "+" + folder + " ";
    }
    return reach;
  }

  const TempFolder temp_;
  const std::string root_ = fs::canonical(temp_.path()).string();
  DaemonOptions options_;
  v1::Job job_;
};

TEST_F(ConfinedFunctionsTest, ReachTheFilesOfTheirJobAlone) {
  if (!ConfinementGaps().empty()) GTEST_SKIP() << ConfinementGaps();
  std::vector<std::string> reached;
  const auto look = [&] { reached.push_back(Reach()); };
  options_.load_inputs = [&](const v1::RegistrationSpec& spec) -> absl::StatusOr<LoadedInputs> {
    look();
    return LoadedInputs{{spec.dump()}, {}, {}};
  };
  options_.find_incomplete = [&](const v1::Job&, const std::vector<v1::FrameInfo>& frames) {
    look();
    return std::vector<IncompleteFrame>{{frames.size(), "why", false}};
  };
  options_.endings.assess = [&](const std::string&, const v1::Job&) {
    look();
    v1::Verdict verdict;
    verdict.set_grade(v1::GRADE_GOOD);
    return verdict;
  };
  options_.endings.write_report = [&](const std::string&, const v1::Job&) {
    look();
    return absl::DataLossError("no report");
  };
  ConfineFunctions(options_);
  EXPECT_EQ(options_.load_inputs(job_.spec())->frames, std::vector<std::string>{root_ + "/take"});
  EXPECT_EQ((*options_.find_incomplete(job_, std::vector<v1::FrameInfo>(3)))[0].position, 3u);
  EXPECT_EQ(options_.endings.assess(root_ + "/out", job_).grade(), v1::GRADE_GOOD);
  EXPECT_EQ(options_.endings.write_report(root_ + "/out", job_), absl::DataLossError("no report"));
  EXPECT_THAT(reached, ::testing::ElementsAre("take rig ", "take rig out +out ", "take rig out +out ",
                                              "take rig out +out "));
  EXPECT_NE(Reach().find("other"), std::string::npos) << "this thread is free";
}

TEST_F(ConfinedFunctionsTest, HandOnWhatIsThrown) {
  options_.load_inputs = [](const v1::RegistrationSpec& spec) -> absl::StatusOr<LoadedInputs> {
    if (spec.first_frame() == 1) throw std::runtime_error("broken library");
    throw std::system_error(EAGAIN, std::generic_category());
  };
  options_.endings = {};
  options_.find_incomplete = nullptr;
  ConfineFunctions(options_);
  const absl::Status lack = options_.load_inputs(job_.spec()).status();
  EXPECT_EQ(lack.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(lack.message()), HasSubstr("makes no further threads"));
  job_.mutable_spec()->set_first_frame(1);
  EXPECT_THAT([&] { options_.load_inputs(job_.spec()).IgnoreError(); },
              ::testing::ThrowsMessage<std::runtime_error>("broken library"));
  EXPECT_FALSE(options_.find_incomplete);
  EXPECT_FALSE(options_.endings.assess);
  EXPECT_FALSE(options_.endings.write_report);
}

}  // namespace
}  // namespace weft
