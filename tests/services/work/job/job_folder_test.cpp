#include "services/work/job/job_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "services/formats/files/json_file.h"
#include "services/work/pipeline/frame_folder.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class JobFolderTest : public ::testing::Test {
 protected:
  JobFolderTest() {
    for (const char* name : {"a", "b"}) {
      infos_.emplace_back();
      infos_.back().set_frame(name);
      infos_.back().set_state(v1::FRAME_STATE_FAILED);
    }
    job_.set_id("j");
  }

  const TempFolder temp_;
  const std::string out_ = std::filesystem::canonical(temp_.path()).string() + "/out";
  JobFolder folder_{out_, "the test"};
  std::vector<v1::FrameInfo> infos_;
  v1::Job job_;
};

TEST_F(JobFolderTest, IsMadeAndHasOneOwner) {
  ASSERT_TRUE(folder_.Take(std::chrono::milliseconds(0)).ok());
  ASSERT_TRUE(folder_.Take(std::chrono::milliseconds(0)).ok()) << "again";
  JobFolder other(out_, "another");
  const absl::Status refused = other.Take(std::chrono::milliseconds(0));
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(refused.message(), HasSubstr("the test"));
  folder_.LetGo();
  EXPECT_TRUE(other.Take(std::chrono::milliseconds(0)).ok());
}

TEST_F(JobFolderTest, ChecksItsOwnPathWithoutLeftovers) {
  ASSERT_TRUE(folder_.Take(std::chrono::milliseconds(0)).ok());
  std::filesystem::create_directories(out_ + "/a");
  WriteBytes(out_ + "/a/mesh.ply.tmp.1.2", "half");
  job_.mutable_spec()->set_out("as the user typed it");
  const auto incomplete = folder_.Check(job_, infos_, [&](const v1::Job& job, const auto& frames) {
    EXPECT_EQ(job.spec().out(), out_);
    EXPECT_FALSE(std::filesystem::exists(out_ + "/a/mesh.ply.tmp.1.2"));
    return std::vector<IncompleteFrame>{{frames.size() - 1, "because"}};
  });
  ASSERT_TRUE(incomplete.ok()) << incomplete.status();
  ASSERT_EQ(incomplete->size(), 1u);
  EXPECT_EQ(incomplete->front().position, 1u);
}

TEST_F(JobFolderTest, LooksForNothingOfAJobThatBegins) {
  ASSERT_TRUE(folder_.Take(std::chrono::milliseconds(0)).ok());
  int looks = 0;
  const auto find = [&](const v1::Job&, const auto&) { return std::vector<IncompleteFrame>(++looks); };
  infos_[0].set_state(v1::FRAME_STATE_WAITING), infos_[1].set_state(v1::FRAME_STATE_RUNNING);
  EXPECT_THAT(folder_.Check(job_, infos_, find).value(), ::testing::IsEmpty());
  EXPECT_EQ(looks, 0);
  for (const v1::FrameState state :
       {v1::FRAME_STATE_DONE, v1::FRAME_STATE_DEGRADED, v1::FRAME_STATE_FAILED}) {
    infos_[1].set_state(state);
    const auto found = folder_.Check(job_, infos_, find).value();
    EXPECT_EQ(found.size(), static_cast<size_t>(looks));
  }
  EXPECT_EQ(looks, 3);
}

TEST_F(JobFolderTest, FindsBridgedFrames) {
  ASSERT_TRUE(folder_.Take(std::chrono::milliseconds(0)).ok());
  v1::FrameReport report;
  report.set_frame("b");
  report.mutable_temporal()->set_bridged(true);
  const auto frame = FrameFolder::Open(out_, "b", ConfinedFolder::IfMissing::kMake);
  ASSERT_TRUE(frame.ok() && frame->Commit(report).ok());
  EXPECT_THAT(folder_.BridgedFrames(infos_), ElementsAre(1u));
}

TEST_F(JobFolderTest, FinishesWithVerdictJobAndReport) {
  std::string reported;
  const JobEndings endings{[](const std::string&, const v1::Job&) {
                             v1::Verdict verdict;
                             verdict.set_grade(v1::GRADE_BAD);
                             return verdict;
                           },
                           [&](const std::string& out, const v1::Job&) {
                             reported = out;
                             return absl::OkStatus();
                           }};
  ASSERT_TRUE(folder_.Finish(infos_, endings, job_).ok());
  EXPECT_EQ(reported, out_);
  v1::Job written;
  ASSERT_TRUE(ReadJsonFile(out_ + "/job.json", written).ok());
  EXPECT_EQ(written.verdict().grade(), v1::GRADE_BAD);
}

TEST_F(JobFolderTest, MeasuresOfAnEarlierResultGo) {
  ASSERT_TRUE(folder_.Finish(infos_, {}, job_).ok());
  WriteBytes(out_ + "/frames.csv", "of the user");
  ASSERT_TRUE(folder_.Finish(infos_, {}, job_).ok());
  EXPECT_TRUE(std::filesystem::exists(out_ + "/frames.csv"));
  for (const char* name : {"/evaluation.json", "/cameras.csv"}) WriteBytes(out_ + name, "{}");
  ASSERT_TRUE(folder_.Finish(infos_, {}, job_).ok());
  for (const char* name : {"/evaluation.json", "/cameras.csv", "/frames.csv"})
    EXPECT_FALSE(std::filesystem::exists(out_ + name)) << name;
  EXPECT_TRUE(std::filesystem::exists(out_ + "/job.json"));
}

TEST_F(JobFolderTest, WhatEndingsThrowCostsThemAlone) {
  const JobEndings endings{
      [](const std::string&, const v1::Job&) -> v1::Verdict { throw std::runtime_error("no judge"); },
      [](const std::string&, const v1::Job&) -> absl::Status { throw std::runtime_error("no ink"); }};
  const absl::Status status = folder_.Finish(infos_, endings, job_);
  EXPECT_THAT(status.message(), HasSubstr("the report cannot be written: no ink"));
  v1::Job written;
  ASSERT_TRUE(ReadJsonFile(out_ + "/job.json", written).ok());
  EXPECT_THAT(written.warnings(), ElementsAre(HasSubstr("no judge")));
}

TEST_F(JobFolderTest, ALackOfThreadsIsNoVerdictAndNoReport) {
  const auto lacking = [] { return std::system_error(EAGAIN, std::generic_category()); };
  JobEndings endings;
  endings.assess = [&](const std::string&, const v1::Job&) -> v1::Verdict { throw lacking(); };
  EXPECT_EQ(folder_.Finish(infos_, endings, job_).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(job_.warnings_size(), 0);
  EXPECT_FALSE(std::filesystem::exists(out_ + "/job.json")) << "it is tried again";
  endings.assess = {};
  endings.write_report = [&](const std::string&, const v1::Job&) -> absl::Status { throw lacking(); };
  EXPECT_EQ(folder_.Finish(infos_, endings, job_).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(std::filesystem::exists(out_ + "/job.json"));
}

TEST_F(JobFolderTest, AnotherOwnersFolderIsNotWritten) {
  JobFolder other(out_, "another");
  ASSERT_TRUE(other.Take(std::chrono::milliseconds(0)).ok());
  EXPECT_EQ(folder_.Finish(infos_, {}, job_).code(), absl::StatusCode::kFailedPrecondition);
  const auto find = [](const v1::Job&, const auto&) { return std::vector<IncompleteFrame>{}; };
  EXPECT_EQ(folder_.Check(job_, infos_, find).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_FALSE(std::filesystem::exists(out_ + "/job.json"));
}

TEST_F(JobFolderTest, FinishesWithoutLeftovers) {
  ASSERT_TRUE(folder_.Take(std::chrono::milliseconds(0)).ok());
  WriteBytes(out_ + "/b/mesh.ply.tmp.1.2", "half");
  WriteBytes(out_ + "/job.json.tmp.1.2", "half");
  ASSERT_TRUE(folder_.Finish(infos_, {}, job_).ok());
  EXPECT_FALSE(std::filesystem::exists(out_ + "/b/mesh.ply.tmp.1.2"));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/job.json.tmp.1.2"));
}

TEST_F(JobFolderTest, OnlyFailedFramesAreBridged) {
  ASSERT_TRUE(folder_.Take(std::chrono::milliseconds(0)).ok());
  for (const v1::FrameInfo& info : infos_) {
    v1::FrameReport report;
    report.mutable_temporal()->set_bridged(true);
    ASSERT_TRUE(FrameFolder::Open(out_, info.frame(), ConfinedFolder::IfMissing::kMake)->Commit(report).ok());
  }
  EXPECT_THAT(folder_.BridgedFrames(infos_), ElementsAre(0u, 1u));
  infos_[0].set_state(v1::FRAME_STATE_DONE);
  EXPECT_THAT(folder_.BridgedFrames(infos_), ElementsAre(1u));
}

}  // namespace
}  // namespace weft
