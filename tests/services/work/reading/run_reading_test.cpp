#include "services/work/reading/run_reading.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "absl/strings/cord.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/json_file.h"
#include "services/work/items/item_files.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// In a process of its own, which is confined for good.
v1::ReadingAnswer ReadApart(const v1::Reading& reading) {
  int ends[2];
  EXPECT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    const std::string bytes = RunReading(reading).SerializeAsString();
    const ssize_t written = write(ends[1], bytes.data(), bytes.size());
    _exit(written == static_cast<ssize_t>(bytes.size()) ? 0 : 1);
  }
  close(ends[1]);
  std::string bytes;
  char piece[4096];
  for (ssize_t n = 0; (n = read(ends[0], piece, sizeof(piece))) > 0;)
    bytes.append(piece, static_cast<size_t>(n));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  v1::ReadingAnswer answer;
  EXPECT_TRUE(answer.ParseFromString(bytes));
  return answer;
}

class RunReadingTest : public ::testing::Test {
 protected:
  v1::Reading BoardItem(const std::string& folder) {
    v1::Reading reading;
    reading.mutable_item()->set_kind(v1::ITEM_KIND_BOARD);
    const auto item = ListLocalItem(v1::ITEM_KIND_BOARD, folder);
    EXPECT_TRUE(item.ok()) << item.status();
    *reading.mutable_item()->mutable_manifest() = item->manifest;
    reading.mutable_item()->set_folder(folder);
    return reading;
  }

  const TempFolder temp_;
  const std::string root_ = fs::canonical(temp_.path()).string();
};

TEST(ReadingAnswer, CarriesAStatusWithItsDetails) {
  absl::Status status = absl::NotFoundError("no rig");
  status.SetPayload("weft/a", absl::Cord("one"));
  status.SetPayload("weft/b", absl::Cord(std::string("t\0o", 3)));
  v1::ReadingAnswer answer;
  SetStatus(status, answer);
  EXPECT_EQ(answer.code(), static_cast<int>(absl::StatusCode::kNotFound));
  EXPECT_EQ(answer.message(), "no rig");
  EXPECT_EQ(StatusOf(answer), status);
  EXPECT_EQ(StatusOf(v1::ReadingAnswer()), absl::OkStatus());
}

TEST_F(RunReadingTest, ItemsAreCheckedWhereTheyLieAlone) {
  ASSERT_TRUE(WriteBoard(root_ + "/board", *GenerateBoard(6, 6, 2.7, 1), "").ok());
  v1::Reading reading = BoardItem(root_ + "/board");
  EXPECT_EQ(StatusOf(ReadApart(reading)), absl::OkStatus());
  // An image that leads out of the item is not read.
  fs::rename(root_ + "/board/board.png", root_ + "/elsewhere.png");
  fs::create_symlink(root_ + "/elsewhere.png", root_ + "/board/board.png");
  EXPECT_FALSE(StatusOf(ReadApart(reading)).ok());
  fs::remove(root_ + "/board/board.png");
  WriteBytes(root_ + "/board/board.png", "no image");
  const absl::Status status = StatusOf(ReadApart(reading));
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("board.png"));
}

// A client's path was checked before: where a link has taken its place meanwhile, nothing is read.
TEST_F(RunReadingTest, InputsOfJobsAreNotReadThroughLinks) {
  fs::create_directories(root_ + "/take");
  WriteBytes(root_ + "/rig.json", "no rig");
  v1::Reading reading;
  v1::RegistrationSpec& spec = *reading.mutable_job_inputs();
  spec.set_dump(root_ + "/take");
  spec.set_rig(root_ + "/rig.json");
  spec.set_board(root_ + "/board.json");
  spec.set_garment(root_ + "/template");
  spec.set_out(root_ + "/out");
  reading.add_allowed_paths(root_);
  const absl::Status read = StatusOf(ReadApart(reading));
  EXPECT_EQ(read.code(), absl::StatusCode::kInvalidArgument) << read;
  EXPECT_THAT(std::string(read.message()), HasSubstr("rig.json"));
  fs::rename(root_ + "/rig.json", root_ + "/elsewhere.json");
  fs::create_symlink(root_ + "/elsewhere.json", root_ + "/rig.json");
  const absl::Status refused = StatusOf(ReadApart(reading));
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("rig.json: was exchanged for a symbolic link"));
}

TEST_F(RunReadingTest, ErrorsAreTheWholeAnswer) {
  v1::Reading reading;
  EXPECT_EQ(StatusOf(ReadApart(reading)).code(), absl::StatusCode::kInvalidArgument) << "nothing to read";
  reading.mutable_job_inputs()->mutable_work()->set_kind("no such work");
  const v1::ReadingAnswer answer = ReadApart(reading);
  EXPECT_EQ(StatusOf(answer).code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(answer.message(), HasSubstr("\"no such work\" is none"));
  EXPECT_EQ(answer.frames_size(), 0);
  v1::Reading incomplete;
  incomplete.mutable_incomplete()->mutable_job()->mutable_spec()->mutable_work()->set_kind("no such work");
  EXPECT_EQ(StatusOf(ReadApart(incomplete)).code(), absl::StatusCode::kUnimplemented);
}

TEST_F(RunReadingTest, ResultsAreAssessedAndReportedInTheirFolder) {
  const std::string out = root_ + "/out";
  fs::create_directories(out);
  v1::Job job;
  job.set_id("j");
  job.set_state(v1::JOB_STATE_FAILED);
  job.set_message("no frame could be registered");
  job.mutable_frames()->set_total(1);
  job.mutable_frames()->set_failed(1);
  ASSERT_TRUE(WriteJsonFile(out + "/job.json", job).ok());
  v1::Reading assess, report;
  *assess.mutable_assess()->mutable_job() = job;
  assess.mutable_assess()->set_out(out);
  const v1::ReadingAnswer answer = ReadApart(assess);
  EXPECT_EQ(StatusOf(answer), absl::OkStatus());
  EXPECT_EQ(answer.verdict().grade(), v1::GRADE_BAD);
  EXPECT_FALSE(fs::exists(out + "/report.html"));
  *report.mutable_write_report()->mutable_job() = job;
  report.mutable_write_report()->set_out(out);
  EXPECT_EQ(StatusOf(ReadApart(report)), absl::OkStatus());
  EXPECT_TRUE(fs::exists(out + "/report.html"));
}

}  // namespace
}  // namespace weft
