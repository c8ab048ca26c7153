#include "services/server/daemon/work/result_owner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class ResultOwnerTest : public ::testing::Test {
 protected:
  absl::Status Check(const std::string& out, const Caller& caller,
                     const std::vector<std::string>& frames = {}) {
    v1::Job job;
    job.mutable_spec()->set_out(folder_ / out);
    return CheckResultOwner(job, frames, caller);
  }

  TempFolder folder_;
  const Caller anna_{"user anna", v1::ROLE_CLIENT}, bert_{"user bert", v1::ROLE_CLIENT};
  const std::string annas_ = "{\"submitted_by\": \"user anna\"}";
};

TEST_F(ResultOwnerTest, AloneMayWriteAgainBesideOperators) {
  WriteBytes(folder_ / "out/job.json", annas_);
  EXPECT_TRUE(Check("out", anna_).ok());
  EXPECT_TRUE(Check("out", {"user carl", v1::ROLE_OPERATOR}).ok());
  const absl::Status refused = Check("out", bert_);
  EXPECT_EQ(refused.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(refused.message(), "spec.out: the results in " + (folder_ / "out") +
                                   " belongs to user anna; ask its owner or an operator");
}

TEST_F(ResultOwnerTest, OwnsWhatLiesBelowAndFramesThatStandThere) {
  WriteBytes(folder_ / "out/job.json", annas_);
  WriteBytes(folder_ / "free/0001/job.json", annas_);
  EXPECT_EQ(Check("out/deep/down", bert_).code(), absl::StatusCode::kPermissionDenied);
  EXPECT_TRUE(Check("free", bert_, {"0000", "0002"}).ok());
  EXPECT_EQ(Check("free", bert_, {"0000", "0001"}).code(), absl::StatusCode::kPermissionDenied);
  EXPECT_TRUE(Check("free", anna_, {"0000", "0001"}).ok());
}

TEST_F(ResultOwnerTest, IsNobodyWhereTheFileDoesNotSay) {
  WriteBytes(folder_ / "empty/job.json", "{}");
  WriteBytes(folder_ / "text/job.json", "no json");
  WriteBytes(folder_ / "annas.json", annas_);
  std::filesystem::create_directories(folder_ / "link");
  std::filesystem::create_symlink(folder_ / "annas.json", folder_ / "link/job.json");
  for (const char* out : {"empty", "text", "link", "missing"}) EXPECT_TRUE(Check(out, bert_).ok()) << out;
}

}  // namespace
}  // namespace weft
