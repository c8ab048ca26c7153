// weft register: what is asked of a daemon, and how the job's end is told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>

#include "services/formats/verdict/verdict.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_aloud.h"
#include "tests/services/tools/client/answering_daemon.h"
#include "weft/v1/library.grpc.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// Has whatever is sent.
class KnowingLibrary final : public v1::Library::Service {
 public:
  std::vector<std::string> begun;

 private:
  grpc::Status BeginUpload(grpc::ServerContext*, grpc::ServerReader<v1::BeginUploadRequest>* in,
                           v1::BeginUploadResponse* out) override {
    v1::BeginUploadRequest message;
    in->Read(&message);
    begun.push_back(v1::ItemKind_Name(message.kind()) + " " + message.name());
    out->mutable_item()->set_id(absl::StrCat("f", begun.size()));
    return grpc::Status::OK;
  }
};

class CommandRegister : public ::testing::Test {
 protected:
  CommandRegister() {
    unsetenv("WEFT_SERVER");
    daemon_.jobs.submit = [this](const v1::SubmitJobRequest& request, v1::Job* job) {
      submitted_ = request;
      probe_ = ReadBytes(request.spec().out() + "/" + request.out_probe());
      *job->mutable_spec() = request.spec();
      job->set_id("j1");
      return grpc::Status::OK;
    };
    daemon_.jobs.watch = [this](const v1::WatchJobRequest& request, grpc::ServerWriter<v1::JobUpdate>* out) {
      EXPECT_EQ(request.job_id(), "j1");
      for (v1::JobUpdate update : updates_) {
        update.mutable_job()->set_id("j1");
        *update.mutable_job()->mutable_spec() = submitted_.spec();
        if (!elsewhere_.empty()) update.mutable_job()->mutable_spec()->set_out(elsewhere_);
        out->Write(update);
      }
      return grpc::Status::OK;
    };
  }
  static AloudRun Register(std::vector<std::string> words) {
    words.insert(words.begin(), "register");
    return RunAloud(AddRegisterCommand, std::move(words));
  }
  std::vector<std::string> Words(std::vector<std::string> more) const {
    std::vector<std::string> words = {"take:t1", "--out", out_, "--server", daemon_.address()};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  AloudRun AtDaemon(std::vector<std::string> more = {}) const { return Register(Words(std::move(more))); }
  // The job's last state is that of the text.
  void Ends(const std::string& job) {
    updates_ = {FromText<v1::JobUpdate>(
                    "job { state: JOB_STATE_RUNNING warnings: \"the rig is old\" } "
                    "frames { frame: \"0001\" state: FRAME_STATE_DONE coverage: 0.5 total_ms: 1500 }"),
                FromText<v1::JobUpdate>("job { " + job + " warnings: \"the rig is old\" }")};
  }

  KnowingLibrary library_;
  AnsweringDaemon daemon_{{&library_}};
  const TempFolder folder_;
  const std::string out_ = folder_ / "out";
  v1::SubmitJobRequest submitted_;
  std::vector<v1::JobUpdate> updates_;
  std::string probe_, elsewhere_;
};

constexpr char kGood[] =
    "state: JOB_STATE_DONE frames { total: 2 done: 1 degraded: 1 } "
    "verdict { grade: GRADE_GOOD reason: \"all is well\" checks { id: \"register.scan_share\" grade: "
    "GRADE_GOOD name: "
    "\"scans used\" value: \"80 %\" } checks { id: \"register.coverage\" grade: GRADE_GOOD name: "
    "\"coverage\" value: "
    "\"99 %\" } }";

TEST_F(CommandRegister, SendsWhatTheCommandLineSays) {
  Ends(kGood);
  const AloudRun run = AtDaemon({"--rig",
                                 folder_ / "a/../rig.json",
                                 "--board",
                                 "library:b",
                                 "--template",
                                 folder_ / "shirt",
                                 "--frames",
                                 "0:2",
                                 "--priority",
                                 "3",
                                 "--live",
                                 "5",
                                 "--observations",
                                 "--frames-alone",
                                 "--single-pass",
                                 "--set",
                                 "decode.levels=2",
                                 "--preset",
                                 "paper",
                                 "--cloud-format",
                                 "pcd"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(
      TextOf(submitted_.spec()),
      "dump: \"take:t1\" rig: \"" + (folder_ / "rig.json") + "\" board: \"library:b\" garment: \"" +
          (folder_ / "shirt") + "\" out: \"" + out_ +
          "\" options { preset: \"paper\" write_observations: true frames_alone: true single_pass: true "
          "pipeline { decode { levels: 2 } } cloud_format: \"pcd\" } frames: \"0:2\" live_every: 5");
  EXPECT_EQ(submitted_.priority(), 3);
  EXPECT_NE(submitted_.idempotency_key(), "");
  // By it the daemon knew that it sees the same folder.
  EXPECT_THAT(submitted_.out_probe(), StartsWith(".weft-probe-"));
  EXPECT_EQ(probe_, "weft\n");
  EXPECT_TRUE(fs::is_empty(out_));
  AtDaemon();
  EXPECT_EQ(TextOf(submitted_.spec()),
            "dump: \"take:t1\" out: \"" + out_ +
                "\" options { preset: \"best\" pipeline { } cloud_format: \"ply\" }");
}

TEST_F(CommandRegister, TellsVerdictScansAndPlaces) {
  Ends(kGood);
  const AloudRun run = AtDaemon();
  ASSERT_TRUE(run.status.ok()) << run.status;
  const std::string places = "results  " + out_ + "\nreport   " + out_ + "/report.html\n";
  EXPECT_EQ(
      run.out,
      "good: all is well\nscans    scans used: 80 %\n2 of 2 frames registered (1 with cameras missing)\n" +
          places);
  EXPECT_EQ(run.err, "weft: warning: the rig is old\n0001    done        50.0 % of the cells     1.5 s\n");
  // What the reason says already is not said again.
  Ends(
      "state: JOB_STATE_DONE frames { total: 1 done: 1 } verdict { grade: GRADE_GOOD reason: \"1 of 1 frame "
      "registered, all well\" }");
  EXPECT_EQ(AtDaemon().out, "good: 1 of 1 frame registered, all well\n" + places);
  Ends("state: JOB_STATE_DONE frames { total: 1 done: 1 }");
  EXPECT_EQ(AtDaemon().out, "1 of 1 frame registered\n" + places) << "of an older daemon";
}

TEST_F(CommandRegister, QuietlyTellsWhatIsNotGoodAlone) {
  const auto quietly = [&] {
    std::vector<std::string> words = Words({});
    words.insert(words.begin(), "register");
    return RunCommand(AddRegisterCommand, words);
  };
  Ends(kGood);
  EXPECT_EQ(quietly().out, "");
  Ends("state: JOB_STATE_DONE verdict { grade: GRADE_USABLE reason: \"a camera is missing\" }");
  EXPECT_EQ(quietly().out, "usable: a camera is missing\n");
}

TEST_F(CommandRegister, EndsAsTheJobDid) {
  Ends("state: JOB_STATE_DONE verdict { grade: GRADE_BAD reason: \"nothing is seen\" }");
  EXPECT_TRUE(IsVerdict(AtDaemon().status));
  const AloudRun json = AtDaemon({"--json"});
  EXPECT_TRUE(IsVerdict(json.status));
  EXPECT_EQ(FromJson<v1::Job>(json.out).verdict().reason(), "nothing is seen");
  Ends("state: JOB_STATE_CANCELLED frames { total: 2 done: 1 }");
  EXPECT_EQ(AtDaemon().status,
            absl::CancelledError(
                "the job was cancelled: 1 of 2 frames registered; run the command again to go on"));
  daemon_.jobs.watch = [](const v1::WatchJobRequest&, grpc::ServerWriter<v1::JobUpdate>*) {
    return grpc::Status(grpc::StatusCode::NOT_FOUND, "there is no job j1");
  };
  EXPECT_EQ(
      AtDaemon().status,
      absl::NotFoundError("there is no job j1; the job is j1, see it with `weft job watch j1 --server " +
                          daemon_.address() + "`"));
}

TEST_F(CommandRegister, BringsResultsOfADaemonThatWritesElsewhere) {
  elsewhere_ = "/var/lib/weft/j1/out";
  Ends(kGood);
  daemon_.jobs.frames = [](const v1::ListFramesRequest&, v1::ListFramesResponse* out) {
    out->add_frames()->set_frame("0001");
    out->mutable_frames(0)->set_state(v1::FRAME_STATE_DONE);
    return grpc::Status::OK;
  };
  daemon_.jobs.fetch = [](const v1::FetchResultRequest& request, grpc::ServerWriter<v1::FileChunk>* out) {
    if (request.kind() != v1::RESULT_KIND_MESH) return grpc::Status(grpc::StatusCode::NOT_FOUND, "none");
    out->Write(Chunk("mesh", 0, 4, "v1"));
    return grpc::Status::OK;
  };
  const AloudRun run = AtDaemon();
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(ReadBytes(out_ + "/0001/mesh.ply"), "mesh");
  daemon_.jobs.fetch = nullptr;
  EXPECT_FALSE(AtDaemon().status.ok());
}

TEST_F(CommandRegister, MayLeaveTheJobToTheDaemon) {
  const AloudRun run = AtDaemon({"--detach"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, "j1\n");
  EXPECT_EQ(submitted_.spec().out(), out_);
  EXPECT_EQ(
      Register({"d", "--rig", "r", "--board", "b", "--template", "t", "--out", out_, "--detach"}).status,
      absl::InvalidArgumentError("--detach leaves the job to a daemon, so it needs --server HOST:PORT"));
}

TEST_F(CommandRegister, UploadsWhatTheDaemonDoesNotHold) {
  Ends(kGood);
  WriteBytes(folder_ / "board.json", "{}");
  const AloudRun run = AtDaemon({"--upload", "--rig", "library:studio", "--board", folder_ / "none.json",
                                 "--template", "library:shirt"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kNotFound) << run.status;
  EXPECT_THAT(run.message(), HasSubstr("none.json"));
  EXPECT_THAT(library_.begun, IsEmpty());
  const AloudRun held =
      AtDaemon({"--upload", "--rig", "library:studio", "--board", "library:b", "--template", "library:t"});
  EXPECT_TRUE(held.status.ok()) << held.status;
  EXPECT_EQ(submitted_.spec().rig(), "library:studio");
  EXPECT_EQ(
      Register({"d", "--rig", "r", "--board", "b", "--template", "t", "--out", out_, "--upload"}).status,
      absl::InvalidArgumentError("--upload sends the inputs to a daemon, so it needs --server HOST:PORT"));
  // An input that would be written over is told before anything is sent.
  fs::create_directories(folder_ / "images");
  const AloudRun within =
      Register({folder_ / "images", "--rig", "library:r", "--board", "library:b", "--template", "library:t",
                "--out", folder_ / "images/out", "--server", daemon_.address()});
  EXPECT_EQ(within.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(within.message(), HasSubstr("which is only read"));
}

TEST_F(CommandRegister, NamesWhatIsMissing) {
  const std::string ending =
      " required; only a take of a daemon's session (take:ID with --server) knows its own. `weft register "
      "--help` "
      "explains them";
  EXPECT_EQ(Register({"take:t1", "--out", out_}).message(), "--rig, --board, --template are" + ending);
  EXPECT_EQ(Register({"dump", "--rig", "r", "--template", "t", "--out", out_, "--server", daemon_.address()})
                .message(),
            "--board is" + ending);
  EXPECT_EQ(Register({"dump", "--rig", "r", "--board", "b", "--template", "t", "--out", out_, "--live", "1"})
                .message(),
            "--live: a daemon follows a take that is being recorded, so it needs --server HOST:PORT");
  EXPECT_THAT(AtDaemon({"--set", "decode.nothing=2"}).message(), HasSubstr("nothing"));
  const AloudRun local = Register({folder_ / "none", "--rig", folder_ / "r", "--board", folder_ / "b",
                                   "--template", folder_ / "t", "--out", out_});
  EXPECT_EQ(local.status.code(), absl::StatusCode::kNotFound) << local.status;
}

}  // namespace
}  // namespace weft
