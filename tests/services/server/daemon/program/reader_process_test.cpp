// Readings by the real worker, and by programs that stand in for one that was taken over.
#include "services/server/daemon/program/reader_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>

#include "absl/strings/str_cat.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/json_file.h"
#include "services/results/report/job_verdict.h"
#include "services/work/items/item_files.h"
#include "services/work/reading/run_reading.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class ReaderProcessTest : public ::testing::Test {
 protected:
  ReaderProcessTest() {
    options_.allow_paths = {root_};
    options_.state_folder = root_ + "/state";
    options_.worker_program = root_ + "/program";
  }
  // A program that keeps what it is asked and answers this.
  void Play(const v1::ReadingAnswer& answer) {
    WriteBytes(root_ + "/answer", answer.SerializeAsString());
    PlayScript("echo \"$*\" > '" + root_ + "/arguments'; cat > '" + root_ + "/asked'; cat '" + root_ +
               "/answer'\n");
  }
  void PlayScript(const std::string& script) {
    WriteBytes(root_ + "/program", "#!/bin/sh\n" + script);
    fs::permissions(root_ + "/program", fs::perms::owner_all);
  }
  v1::Reading Asked() {
    v1::Reading reading;
    EXPECT_TRUE(reading.ParseFromString(ReadBytes(root_ + "/asked")));
    return reading;
  }
  static std::string Links(const std::string& root) {
    return absl::StrCat("allowed_paths: \"", root, "\" closed_folder: \"", root, "/state\" ");
  }
  static v1::Job Ended() {
    v1::Job job;
    job.set_id("j");
    job.set_state(v1::JOB_STATE_FAILED);
    job.set_message("no frame could be registered");
    job.mutable_frames()->set_total(1);
    job.mutable_frames()->set_failed(1);
    return job;
  }

  const TempFolder temp_;
  const std::string root_ = fs::canonical(temp_.path()).string();
  DaemonOptions options_;
};

TEST_F(ReaderProcessTest, ReadsInputsOfJobs) {
  v1::ReadingAnswer answer;
  answer.add_frames("0001");
  answer.add_frames("0002");
  answer.mutable_hashes()->set_rig("0123456789abcdef");
  answer.add_warnings("camera 7 has no images");
  answer.mutable_driven()->set_avatar("shirt");
  Play(answer);
  ReadInProcesses(options_);
  v1::RegistrationSpec spec;
  spec.set_dump("/take");
  const absl::StatusOr<LoadedInputs> inputs = options_.load_inputs(spec);
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  EXPECT_EQ(Asked().ShortDebugString(), Links(root_) + "job_inputs { dump: \"/take\" }");
  EXPECT_EQ(ReadBytes(root_ + "/arguments"),
            absl::StrCat("--read --parent=", getpid(), " --memory-mib=2048\n"));
  EXPECT_THAT(inputs->frames, ElementsAre("0001", "0002"));
  EXPECT_EQ(inputs->hashes.rig(), "0123456789abcdef");
  EXPECT_THAT(inputs->warnings, ElementsAre("camera 7 has no images"));
  ASSERT_TRUE(inputs->driven);
  EXPECT_EQ(inputs->driven->avatar(), "shirt");
  answer.clear_driven();
  Play(answer);
  EXPECT_FALSE(options_.load_inputs(spec)->driven);
  answer.clear_frames();
  Play(answer);
  EXPECT_EQ(options_.load_inputs(spec).status(),
            absl::InternalError("a reader found no frames, and no reason"));
}

TEST_F(ReaderProcessTest, FindsIncompleteFramesOfTheJobAlone) {
  v1::ReadingAnswer answer;
  v1::ReadingAnswer::Incomplete& one = *answer.add_incomplete();
  one.set_position(1);
  one.set_why("mesh.ply is missing");
  one.set_inputs_changed(true);
  Play(answer);
  ReadInProcesses(options_);
  std::vector<v1::FrameInfo> frames(2);
  frames[0].set_frame("a");
  frames[1].set_frame("b");
  const auto incomplete = options_.find_incomplete(Ended(), frames);
  ASSERT_TRUE(incomplete.ok()) << incomplete.status();
  ASSERT_EQ(incomplete->size(), 1u);
  EXPECT_EQ((*incomplete)[0].position, 1u);
  EXPECT_EQ((*incomplete)[0].why, "mesh.ply is missing");
  EXPECT_TRUE((*incomplete)[0].inputs_changed);
  EXPECT_EQ(Asked().ShortDebugString(), Links(root_) + "incomplete { job { " + Ended().ShortDebugString() +
                                            " } frames { frame: \"a\" } frames { frame: \"b\" } }");
  for (const int64_t position : {-1, 2}) {
    answer.mutable_incomplete(0)->set_position(position);
    Play(answer);
    EXPECT_EQ(options_.find_incomplete(Ended(), frames).status(),
              absl::InternalError("a reader named a frame that the job lacks"));
  }
  answer.mutable_incomplete(0)->set_position(0);
  Play(answer);
  EXPECT_TRUE(options_.find_incomplete(Ended(), frames).ok());
}

TEST_F(ReaderProcessTest, HandsOnErrorsAndSaysWhatAReaderHas) {
  v1::ReadingAnswer answer;
  SetStatus(absl::NotFoundError("no rig"), answer);
  Play(answer);
  options_.worker_user = "nobody";
  ReadInProcesses(options_);
  EXPECT_EQ(options_.load_inputs({}).status(), absl::NotFoundError("no rig"));
  EXPECT_THAT(ReadBytes(root_ + "/arguments"), HasSubstr(" --memory-mib=2048 --user=nobody\n"));
  EXPECT_EQ(options_.find_incomplete({}, {}).status(), absl::NotFoundError("no rig"));
  EXPECT_EQ(options_.endings.write_report(root_, Ended()), absl::NotFoundError("no rig"));
  EXPECT_EQ(options_.check_item(v1::ITEM_KIND_RIG, {}, root_), absl::NotFoundError("no rig"));
  EXPECT_THAT([&] { options_.endings.assess(root_, Ended()); },
              ::testing::ThrowsMessage<std::runtime_error>("no rig"));
  SetStatus(absl::ResourceExhaustedError("too much"), answer);
  Play(answer);
  EXPECT_EQ(options_.load_inputs({}).status(),
            absl::ResourceExhaustedError("too much; a reader has 2048 MiB"));
}

TEST_F(ReaderProcessTest, AnEndOfItsProcessIsTheFaultOfWhatWasRead) {
  PlayScript("kill -11 $$\n");
  ReadInProcesses(options_);
  const absl::Status ended = options_.load_inputs({}).status();
  EXPECT_EQ(ended.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(ended.message()),
              StartsWith("reading the files ended its process, so they are damaged or made to do so: "));
  EXPECT_THAT(std::string(ended.message()), HasSubstr("signal 11"));
  PlayScript("printf '\\377'\n");
  EXPECT_EQ(options_.load_inputs({}).status(), absl::InternalError("a reader's answer is none"));
  fs::remove(root_ + "/program");
  EXPECT_EQ(options_.load_inputs({}).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(ReaderProcessTest, ReadsByTheWorker) {
  options_.worker_program = WEFT_WORKER;
  ReadInProcesses(options_);
  v1::RegistrationSpec spec;
  spec.mutable_work()->set_kind("no such work");
  EXPECT_EQ(options_.load_inputs(spec).status().code(), absl::StatusCode::kUnimplemented);
  ASSERT_TRUE(WriteBoard(root_ + "/board", *GenerateBoard(6, 6, 2.7, 1), "").ok());
  const auto item = ListLocalItem(v1::ITEM_KIND_BOARD, root_ + "/board");
  ASSERT_TRUE(item.ok()) << item.status();
  EXPECT_EQ(options_.check_item(v1::ITEM_KIND_BOARD, item->manifest, root_ + "/board"), absl::OkStatus());
  WriteBytes(root_ + "/board/board.png", "no image");
  EXPECT_THAT(
      std::string(options_.check_item(v1::ITEM_KIND_BOARD, item->manifest, root_ + "/board").message()),
      HasSubstr("board.png"));
  fs::create_directories(root_ + "/out");
  ASSERT_TRUE(WriteJsonFile(root_ + "/out/job.json", Ended()).ok());
  EXPECT_EQ(options_.endings.assess(root_ + "/out", Ended()).ShortDebugString(),
            AssessJobFolder(root_ + "/out", Ended()).ShortDebugString());
  EXPECT_FALSE(fs::exists(root_ + "/out/report.html"));
  EXPECT_EQ(options_.endings.write_report(root_ + "/out", Ended()), absl::OkStatus());
  EXPECT_TRUE(fs::exists(root_ + "/out/report.html"));
}

}  // namespace
}  // namespace weft
