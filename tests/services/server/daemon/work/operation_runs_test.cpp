// What becomes of the processes of operations: a program that does what the name of its take says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "base/host_clock.h"
#include "services/formats/files/json_file.h"
#include "services/server/daemon/work/operation_queue.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/daemon/captured_log.h"
#include "tests/services/server/daemon/wait_until.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const Caller kRunner{"token 1 (anna)", v1::ROLE_CLIENT};

class OperationRunsTest : public ::testing::Test {
 protected:
  OperationRunsTest() {
    WriteBytes(folder_ / "program",
               absl::StrCat("#!/bin/sh\ncd '", folder_.path(), "'\nfor last; do :; done\n",
                            "echo \"${last##*/}\" >> began\necho \"$*\" > arguments\n",
                            "out=$OLDPWD\n. ./script\n"));
    fs::permissions(folder_ / "program", fs::perms::owner_all);
    options_.folder = folder_ / "operations";
    options_.program = folder_ / "program";
    options_.resolve = [this](const std::string& field, auto,
                              const std::string& value) -> absl::StatusOr<std::string> {
      if (is_gone_) return absl::NotFoundError(field + ": it is gone");
      return value;
    };
    options_.adopt_take = [this](const std::string& folder, const std::string& id) {
      adopted_.push_back(absl::StrCat(folder.substr(folder_.path().size()), " as ", id));
      return adopts_;
    };
    options_.take_exists = [](const std::string& id) { return id == "0123-take"; };
    options_.memory_mib = 512;
    Restart();
  }
  void Restart() {
    queue_.reset();
    auto queue = OperationQueue::Create(options_);
    ASSERT_TRUE(queue.ok()) << queue.status();
    queue_ = *std::move(queue);
  }
  static v1::StartOperationRequest Request(const std::string& command = "take verify") {
    v1::StartOperationRequest request;
    request.mutable_spec()->set_command(command);
    v1::OperationInput& input = *request.mutable_spec()->add_inputs();
    input.set_name(command == "evaluate" ? "result" : "take");
    input.set_value("/takes/t");
    if (command == "evaluate") request.mutable_spec()->set_out_name("evaluation");
    return request;
  }
  std::string Start(const std::string& script, const v1::StartOperationRequest& request = Request()) {
    WriteBytes(folder_ / "script", script);
    const auto operation = queue_->Start(request, kRunner);
    EXPECT_TRUE(operation.ok()) << operation.status();
    return operation.ok() ? operation->id() : "";
  }
  v1::Operation WaitFor(const std::string& id, const std::function<bool(const v1::Operation&)>& is_so) {
    absl::StatusOr<v1::Operation> operation;
    EXPECT_TRUE(WaitUntil([&] {
      operation = queue_->Get(id);
      return operation.ok() && is_so(*operation);
    })) << id;
    return operation.ok() ? *operation : v1::Operation();
  }
  v1::Operation WaitForEnd(const std::string& id) { return WaitFor(id, HasEnded); }
  v1::Operation Run(const std::string& script, const v1::StartOperationRequest& request = Request()) {
    return WaitForEnd(Start(script, request));
  }
  // State, exit status, crashes, share and message of one that has ended.
  static std::string EndOf(const v1::Operation& operation) {
    return absl::StrCat(v1::JobState_Name(operation.state()), " ", operation.exit_status(), " ",
                        operation.crashes(), " ", operation.share_done(), " ", operation.message());
  }
  size_t TimesBegun() {
    return std::vector<std::string>(absl::StrSplit(ReadBytes(folder_ / "began"), '\n', absl::SkipEmpty()))
        .size();
  }

  const TempFolder folder_;
  const CapturedLog log_;
  OperationQueueOptions options_;
  std::atomic<bool> is_gone_ = false;
  absl::Status adopts_;
  std::vector<std::string> adopted_;
  std::unique_ptr<OperationQueue> queue_;
};

TEST_F(OperationRunsTest, TellWhatTheirProgramSays) {
  const int64_t before_ns = HostTime_ns();
  const std::string id = Start(
      "echo 'weft: progress: reading: 3 of 12' >&2\nwhile [ ! -e go ]; do sleep 0.01; done\n"
      "echo 'weft: warning: soft focus' >&2; echo plain words >&2\n"
      "echo 'weft: progress: reading' >&2; echo 'weft: progress: reading: x of 12' >&2\n"
      "printf 'weft: error: two\\ttakes\\n' >&2; echo verdict bad; exit 1\n");
  const v1::Operation running = WaitFor(id, [](const v1::Operation& now) { return !now.step().empty(); });
  EXPECT_EQ(running.state(), v1::JOB_STATE_RUNNING);
  EXPECT_EQ(running.step(), "reading");
  EXPECT_EQ(running.share_done(), 0.25);
  EXPECT_GE(running.started_unix_ns(), running.created_unix_ns());
  EXPECT_GE(running.created_unix_ns(), before_ns);
  EXPECT_EQ(running.finished_unix_ns(), 0);
  WriteBytes(folder_ / "go", "");
  const v1::Operation ended = WaitForEnd(id);
  EXPECT_EQ(EndOf(ended), "JOB_STATE_FAILED 1 0 0.25 two\\x09takes");
  EXPECT_THAT(ended.notes(), ElementsAre("soft focus", "plain words"));
  EXPECT_EQ(ended.output(), "verdict bad\n");
  EXPECT_GE(ended.finished_unix_ns(), ended.started_unix_ns());
  EXPECT_EQ(ended.started_by(), "token 1 (anna)");
  EXPECT_EQ(ended.about(), "/takes/t");
  EXPECT_THAT(log_.Lines(), ::testing::Contains(absl::StrCat("info operation ", id, ": take verify")));
  EXPECT_THAT(log_.Lines(),
              ::testing::Contains(absl::StrCat("info operation ", id, ": JOB_STATE_FAILED two\\x09takes")));
}

TEST_F(OperationRunsTest, AreDoneWhereNothingWentWrong) {
  EXPECT_EQ(EndOf(Run("exit 0")), "JOB_STATE_DONE 0 0 1 ");
  EXPECT_EQ(EndOf(Run("exit 1")), "JOB_STATE_DONE 1 0 1 ") << "a verdict, not an error";
  EXPECT_EQ(EndOf(Run("exit 2")), "JOB_STATE_FAILED 2 0 0 ");
  EXPECT_EQ(EndOf(Run("echo 'weft: progress: x: 5 of 4' >&2; exit 2")), "JOB_STATE_FAILED 2 0 1 ");
  EXPECT_EQ(EndOf(Run("echo 'weft: progress: x: 5 of 0' >&2; exit 2")), "JOB_STATE_FAILED 2 0 0 ");
}

TEST_F(OperationRunsTest, ThatCrashAreStartedTwice) {
  EXPECT_EQ(EndOf(Run("kill -9 $$")), "JOB_STATE_FAILED 0 2 0 killed by signal 9 (Killed)");
  EXPECT_EQ(TimesBegun(), 2u);
  EXPECT_EQ(EndOf(Run("[ -e crashed ] && exit 0; touch crashed; kill -9 $$")), "JOB_STATE_DONE 0 1 1 ");
  EXPECT_EQ(TimesBegun(), 4u);
}

TEST_F(OperationRunsTest, WaitForThreadsThatTheMachineLacks) {
  const std::string id = Start(
      "[ -e threads ] && exit 0\necho 'weft: error: fork: Resource temporarily unavailable' >&2; exit 1\n");
  const v1::Operation waits = WaitFor(id, [](const v1::Operation& now) { return !now.message().empty(); });
  EXPECT_EQ(waits.state(), v1::JOB_STATE_QUEUED);
  EXPECT_EQ(waits.message(), "fork: Resource temporarily unavailable");
  EXPECT_EQ(waits.finished_unix_ns(), 0);
  WriteBytes(folder_ / "threads", "");
  EXPECT_EQ(EndOf(WaitForEnd(id)), "JOB_STATE_DONE 0 0 1 ");
  EXPECT_EQ(TimesBegun(), 2u);
}

TEST_F(OperationRunsTest, ThatCannotBeginFail) {
  options_.program = folder_ / "none";
  Restart();
  EXPECT_THAT(EndOf(Run("")), AllOf(HasSubstr("JOB_STATE_FAILED 1 0 0 "), HasSubstr("none")));
  options_.program = folder_ / "program";
  Restart();
  const std::string first = Start("while [ ! -e go ]; do sleep 0.01; done");
  ASSERT_TRUE(WaitUntil([this] { return TimesBegun() == 1; }));
  const std::string second = queue_->Start(Request(), kRunner)->id();
  is_gone_ = true;
  WriteBytes(folder_ / "go", "");
  EXPECT_EQ(EndOf(WaitForEnd(first)), "JOB_STATE_DONE 0 0 1 ");
  EXPECT_EQ(EndOf(WaitForEnd(second)), "JOB_STATE_FAILED 2 0 0 spec.inputs.take: it is gone");
}

TEST_F(OperationRunsTest, OutputAndNotesHaveTheirLimits) {
  const v1::Operation loud =
      Run("head -c 3000000 /dev/zero | tr '\\0' x\n"
          "i=0; while [ $i -lt 120 ]; do echo note $i >&2; i=$((i+1)); done\n");
  EXPECT_EQ(loud.output(), std::string(1 << 20, 'x'));
  ASSERT_THAT(loud.notes(), SizeIs(100));
  EXPECT_EQ(loud.notes(99), "note 99");
  const v1::Operation wide = Run("head -c 9000 /dev/zero | tr '\\0' y >&2; echo >&2; printf 'a\\377b'\n");
  EXPECT_THAT(wide.notes(), ElementsAre(std::string(8192, 'y')));
  EXPECT_EQ(wide.output(), "a\\xffb");
}

TEST_F(OperationRunsTest, GetTheRightToReadTheirInputsAlone) {
  WriteBytes(folder_ / "data/light.bin", "x");
  fs::create_directories(folder_ / "take");
  fs::create_symlink(folder_ / "data/light.bin", folder_ / "take/light.bin");
  options_.links.allowed = {folder_.path()};
  options_.readable_besides = [] { return std::vector<std::string>{"/besides"}; };
  Restart();
  v1::StartOperationRequest request = Request();
  request.mutable_spec()->mutable_inputs(0)->set_value(folder_ / "take");
  EXPECT_EQ(EndOf(Run("", request)), "JOB_STATE_DONE 0 0 1 ");
  const std::string first = absl::StrCat("--watched-by=", getpid(), " --memory-mib=512 --may-read=");
  EXPECT_EQ(ReadBytes(folder_ / "arguments"),
            absl::StrCat(first, folder_ / "take", " --may-read=", folder_ / "data/light.bin",
                         " take verify -- ", folder_ / "take", "\n"));
  EXPECT_EQ(EndOf(Run("", Request("evaluate"))), "JOB_STATE_DONE 0 0 1 ");
  EXPECT_EQ(ReadBytes(folder_ / "arguments"),
            absl::StrCat(first, "/takes/t --may-read=/besides evaluate --out=evaluation -- /takes/t\n"));
}

TEST_F(OperationRunsTest, HandOverTheTakeThatTheyMade) {
  const v1::Operation done = Run("mkdir -p \"$out/take\"", Request("take trim"));
  EXPECT_EQ(EndOf(done), "JOB_STATE_DONE 0 0 1 ");
  EXPECT_EQ(done.take_id(), done.id());
  EXPECT_THAT(adopted_, ElementsAre(absl::StrCat("/operations/", done.id(), "/out/take as ", done.id())));
  EXPECT_EQ(EndOf(Run("exit 2", Request("take trim"))), "JOB_STATE_FAILED 2 0 0 ");
  EXPECT_THAT(adopted_, SizeIs(1));
  adopts_ = absl::DataLossError("no take.json\n");
  const v1::Operation refused = Run("exit 0", Request("take trim"));
  EXPECT_THAT(EndOf(refused), HasSubstr("JOB_STATE_FAILED 0 0 0 no take.json"));
  EXPECT_EQ(refused.take_id(), "");
  v1::StartOperationRequest taken = Request("take trim");
  taken.set_idempotency_key("0123-take");
  const absl::Status status = queue_->Start(taken, kRunner).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(status.message(), "idempotency_key: is the id of take 0123-take; choose a new key");
  taken = Request();
  taken.set_idempotency_key("0123-take");
  EXPECT_TRUE(queue_->Start(taken, kRunner).ok()) << "it makes no take";
}

TEST_F(OperationRunsTest, AreStoppedWhenTheyAreCancelled) {
  const std::string id =
      Start("trap 'touch stopped; exit 3' TERM; touch ready; while :; do sleep 0.01; done");
  ASSERT_TRUE(WaitUntil([this] { return fs::exists(folder_ / "ready"); }));
  EXPECT_TRUE(queue_->Reads("/takes/t"));
  EXPECT_TRUE(queue_->Reads("/takes"));
  EXPECT_FALSE(queue_->Reads("/take"));
  EXPECT_FALSE(queue_->Reads("/takes/t/deeper"));
  const v1::ListOperationFilesRequest files = [&] {
    v1::ListOperationFilesRequest request;
    request.set_operation_id(id);
    return request;
  }();
  EXPECT_EQ(queue_->Files(files).status().message(),
            absl::StrCat("operation_id: operation ", id, " is not done; wait for it"));
  EXPECT_EQ(queue_->Delete(id, kRunner).status().message(),
            absl::StrCat("operation_id: operation ", id, " has not ended; wait for it, or cancel it first"));
  EXPECT_THAT(queue_->EndedHoldings(), IsEmpty());
  ASSERT_TRUE(queue_->Cancel(id, kRunner).ok());
  EXPECT_EQ(EndOf(WaitForEnd(id)), "JOB_STATE_CANCELLED 0 0 0 ");
  EXPECT_TRUE(fs::exists(folder_ / "stopped"));
  EXPECT_FALSE(queue_->Reads("/takes/t"));
  EXPECT_EQ(EndOf(*queue_->Cancel(id, kRunner)), "JOB_STATE_CANCELLED 0 0 0 ") << "may be repeated";
  EXPECT_EQ(queue_->OpenFile(id, "o/a", {}).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(OperationRunsTest, BeginAnewWithTheNextDaemon) {
  const std::string id = Start("touch ready; while [ ! -e go ]; do sleep 0.01; done; ls \"$out\"");
  ASSERT_TRUE(WaitUntil([this] { return fs::exists(folder_ / "ready"); }));
  WriteBytes(folder_ / ("operations/" + id + "/out/half"), "written");
  queue_->Stop();
  const absl::StatusOr<v1::Operation> stopped = queue_->Get(id);
  EXPECT_EQ(stopped->state(), v1::JOB_STATE_RUNNING);
  queue_.reset();
  fs::create_directories(folder_ / "operations/not-acknowledged");
  WriteBytes(folder_ / "operations/damaged/operation.json", "{");
  WriteBytes(folder_ / "operations/copied/operation.json",
             ReadBytes(folder_ / ("operations/" + id + "/operation.json")));
  WriteBytes(folder_ / "go", "");
  Restart();
  const v1::Operation ended = WaitForEnd(id);
  EXPECT_EQ(EndOf(ended), "JOB_STATE_DONE 0 0 1 ");
  EXPECT_EQ(ended.output(), "") << "its folder was empty";
  EXPECT_EQ(TimesBegun(), 2u);
  EXPECT_FALSE(fs::exists(folder_ / "operations/not-acknowledged"));
  const auto list = queue_->List(10);
  ASSERT_TRUE(list.ok());
  EXPECT_THAT(list->warnings(), ::testing::UnorderedElementsAre(
                                    HasSubstr("damaged/operation.json"),
                                    absl::StrCat(folder_ / "operations/copied/operation.json",
                                                 ": is operation \"", id, "\"; remove the folder")));
  EXPECT_EQ(log_.Count("warning " + (folder_ / "operations/damaged")), 1);
  EXPECT_THAT(queue_->List(10, id + "x")->warnings(), IsEmpty()) << "on the first page alone";
}

TEST_F(OperationRunsTest, ThatHaveEndedAreForgottenWithTheirFiles) {
  const v1::Operation ended = Run("exit 0");
  const std::vector<Holding> held = queue_->EndedHoldings();
  ASSERT_THAT(held, SizeIs(1));
  EXPECT_EQ(held[0].kind, v1::HOLDING_KIND_OPERATION);
  EXPECT_EQ(held[0].id, ended.id());
  EXPECT_EQ(held[0].since_unix_ns, ended.finished_unix_ns());
  EXPECT_FALSE(held[0].kept);
  EXPECT_EQ(queue_->ForgetEnded(ended.id(), ended.finished_unix_ns() + 1).message(),
            "it is gone, or runs again");
  EXPECT_EQ(queue_->ForgetEnded("unknown", 0).code(), absl::StatusCode::kFailedPrecondition);
  ASSERT_TRUE(queue_->ForgetEnded(ended.id(), ended.finished_unix_ns()).ok());
  EXPECT_TRUE(fs::is_empty(folder_ / "operations"));
  EXPECT_EQ(
      queue_->Get(ended.id()).status().message(),
      absl::StrCat("operation_id: no operation \"", ended.id(), "\"; `weft operation list` shows them"));
}

TEST_F(OperationRunsTest, ListsTellWhatTheyAreAboutInFewWords) {
  v1::StartOperationRequest request = Request();
  const std::string end(200, 'e');
  request.mutable_spec()->mutable_inputs(0)->set_value("/" + end);
  EXPECT_EQ(Run("echo said", request).about(), "..." + end);
  request.mutable_spec()->mutable_inputs(0)->set_value("/" + end.substr(1));
  EXPECT_EQ(Run("exit 0", request).about(), "/" + end.substr(1));
  const auto list = queue_->List(10);
  ASSERT_EQ(list->operations_size(), 2);
  for (const v1::Operation& operation : list->operations()) {
    EXPECT_EQ(operation.spec().ShortDebugString(), "command: \"take verify\"");
    EXPECT_EQ(operation.output(), "");
  }
}

}  // namespace
}  // namespace weft
