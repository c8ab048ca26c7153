#include "services/server/daemon/work/prepare_job.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include "base/host_clock.h"
#include "capture/take/take_writer.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/library/uploads.h"
#include "services/server/rpc/error_detail.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/work/items/sha256.h"
#include "services/work/pipeline/result_lock.h"
#include "tests/capture/temp_folder.h"
#include "weft/v1/recorder.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr char kTake[] = "20260101-000000-00000000";

class PrepareJobTest : public ::testing::Test {
 protected:
  PrepareJobTest() {
    for (const char* folder : {"/state/takes", "/state/results", "/dump", "/files", "/shirt"})
      fs::create_directories(root_ + folder);
    for (const char* file :
         {"/dump/0000/a.png", "/files/rig.json", "/files/board.json", "/shirt/template.json"})
      WriteBytes(root_ + file, "{}");
    fs::create_directory_symlink(root_ + "/files", root_ + "/link");
    policy_ = *PathPolicy::Create({root_}, root_ + "/state");
    library_ = *Library::Open(root_ + "/state");
    inputs_.frames = {"0001", "0002", "0003"};
    inputs_.hashes.set_rig("0123456789abcdef");
    inputs_.warnings = {"camera 7 has no images"};
  }

  v1::SubmitJobRequest Request() const {
    v1::SubmitJobRequest request;
    v1::RegistrationSpec& spec = *request.mutable_spec();
    spec.set_dump(root_ + "/dump");
    spec.set_rig(root_ + "/link/rig.json");
    spec.set_board(root_ + "/files/../files/board.json");
    spec.set_garment(root_ + "/shirt");
    spec.set_out(root_ + "/out");
    return request;
  }
  absl::StatusOr<PreparedJob> Prepare(const v1::SubmitJobRequest& request) {
    const JobPlaces places{policy_, *library_, resolve_, root_ + "/state/results", known_};
    return PrepareJob(request, places, "user anna",
                      [this](const v1::RegistrationSpec& spec) -> absl::StatusOr<LoadedInputs> {
                        loaded_.push_back(spec);
                        return inputs_;
                      });
  }
  std::string Refused(const v1::SubmitJobRequest& request, absl::StatusCode code) {
    const absl::Status status = Prepare(request).status();
    EXPECT_EQ(status.code(), code) << status;
    return std::string(status.message());
  }
  // A take of the daemon, with the request that it was recorded for.
  RecorderFiles PutTake(const v1::RecorderRequest& request = {}) const {
    const std::string folder = root_ + "/state/takes/" + kTake;
    fs::create_directories(folder);
    const RecorderFiles files(folder);
    EXPECT_TRUE(WriteJsonFile(files.request, request).ok());
    return files;
  }
  // As a recorder that lives holds it.
  static UniqueFd Hold(const RecorderFiles& files) {
    WriteBytes(files.lock, std::to_string(getpid()));
    UniqueFd lock(open(files.lock.c_str(), O_RDWR | O_CLOEXEC));
    EXPECT_EQ(flock(lock.get(), LOCK_EX | LOCK_NB), 0);
    return lock;
  }
  // An item of one file in the library; its id.
  std::string PutItem(v1::ItemKind kind, const std::string& name, const std::string& path) {
    const Caller caller{"user anna", v1::ROLE_CLIENT};
    Uploads uploads(
        *library_, root_ + "/state",
        [](v1::ItemKind, const v1::ItemManifest&, const std::string&) { return absl::OkStatus(); });
    v1::BeginUploadRequest request;
    request.set_kind(kind);
    request.set_name(name);
    v1::ItemFile& file = *request.mutable_manifest()->add_files();
    file.set_path(path);
    file.set_bytes(static_cast<int64_t>(name.size()));
    file.set_sha256(Sha256().Add(name).Hex());
    const auto begun = uploads.Begin(request, caller);
    EXPECT_TRUE(begun.ok()) << begun.status();
    v1::WriteFileRequest piece;
    piece.set_upload_id(begun->upload_id());
    piece.set_path(path);
    piece.set_data(name);
    UploadWriter writer(uploads, caller);
    EXPECT_TRUE(writer.Add(piece).ok());
    EXPECT_TRUE(writer.Sync().ok());
    const auto item = uploads.Finish(begun->upload_id(), caller);
    EXPECT_TRUE(item.ok()) << item.status();
    return item.ok() ? item->id() : "";
  }

  const TempFolder temp_;
  const std::string root_ = fs::canonical(temp_.path()).string();
  PathPolicy policy_;
  std::unique_ptr<Library> library_;
  const ResolveInput resolve_ = [](const std::string&, v1::ItemKind, const std::string& value) {
    return value;
  };
  KnownInputs known_;
  LoadedInputs inputs_;
  std::vector<v1::RegistrationSpec> loaded_;
};

TEST_F(PrepareJobTest, FillsInWhatTheQueueWants) {
  v1::SubmitJobRequest request = Request();
  request.set_idempotency_key("0123-weft");
  request.set_priority(7);
  inputs_.driven.emplace().set_avatar("shirt");
  const absl::StatusOr<PreparedJob> prepared = Prepare(request);
  ASSERT_TRUE(prepared.ok()) << prepared.status();
  v1::Job job = prepared->job;
  EXPECT_THAT(prepared->frames, ElementsAre("0001", "0002", "0003"));
  EXPECT_THAT(prepared->holds, IsEmpty());
  EXPECT_EQ(job.spec().dump(), root_ + "/dump");
  EXPECT_EQ(job.spec().rig(), root_ + "/files/rig.json");
  EXPECT_EQ(job.spec().board(), root_ + "/files/board.json");
  EXPECT_EQ(job.spec().garment(), root_ + "/shirt");
  EXPECT_EQ(job.spec().out(), root_ + "/out");
  EXPECT_EQ(job.spec().options().preset(), "best") << "what is not said is spelled out";
  EXPECT_TRUE(fs::is_directory(root_ + "/out"));
  EXPECT_NE(job.weft_version(), "");
  EXPECT_EQ(job.request_hash(), HashOfRequest(request));
  EXPECT_EQ(job.items().ShortDebugString(), "");
  ASSERT_THAT(loaded_, SizeIs(1));
  EXPECT_EQ(loaded_[0].rig(), root_ + "/files/rig.json");
  EXPECT_EQ(loaded_[0].options().preset(), "best");
  job.clear_spec();
  job.clear_items();
  job.clear_weft_version();
  job.clear_request_hash();
  EXPECT_EQ(job.ShortDebugString(),
            "id: \"0123-weft\" inputs { rig: \"0123456789abcdef\" } warnings: \"camera 7 has no images\" "
            "first_frame: \"0001\" last_frame: \"0003\" priority: 7 driven { avatar: \"shirt\" }");
}

TEST_F(PrepareJobTest, GivesAnIdAndAFolderToThoseWithoutOne) {
  v1::SubmitJobRequest request = Request();
  request.mutable_spec()->clear_out();
  const absl::StatusOr<PreparedJob> prepared = Prepare(request);
  ASSERT_TRUE(prepared.ok()) << prepared.status();
  EXPECT_NE(prepared->job.id(), "");
  EXPECT_EQ(prepared->job.request_hash(), "") << "nobody can repeat it";
  EXPECT_EQ(prepared->job.spec().out(), root_ + "/state/results/" + prepared->job.id());
  EXPECT_EQ(loaded_[0].out(), prepared->job.spec().out()) << "who loads inputs wants every field";
  EXPECT_FALSE(prepared->job.has_driven());
}

TEST_F(PrepareJobTest, RequestsAreTheSameBySpecAndPriority) {
  const v1::SubmitJobRequest request = Request();
  v1::SubmitJobRequest same = request, other = request;
  same.set_out_probe("probe");
  EXPECT_EQ(HashOfRequest(same), HashOfRequest(request));
  EXPECT_THAT(HashOfRequest(request), SizeIs(16));
  other.set_priority(1);
  EXPECT_NE(HashOfRequest(other), HashOfRequest(request));
  other = request;
  other.mutable_spec()->set_first_frame(1);
  EXPECT_NE(HashOfRequest(other), HashOfRequest(request));
}

TEST_F(PrepareJobTest, ATakeOfTheDaemonBringsTheInputsOfItsSession) {
  v1::RecorderRequest recorded;
  recorded.set_rig(root_ + "/files/rig.json");
  recorded.set_board(root_ + "/files/board.json");
  recorded.set_garment(root_ + "/shirt");
  fs::create_directories(PutTake(recorded).take);
  v1::SubmitJobRequest request = Request();
  request.mutable_spec()->set_dump(std::string("take:") + kTake);
  for (const char* given : {"rig", "board", "garment", ""}) {
    v1::SubmitJobRequest one = request;
    for (const char* field : {"rig", "board", "garment"})
      if (std::string(field) != given)
        one.mutable_spec()->GetReflection()->ClearField(one.mutable_spec(),
                                                        one.spec().GetDescriptor()->FindFieldByName(field));
    const absl::StatusOr<PreparedJob> prepared = Prepare(one);
    ASSERT_TRUE(prepared.ok()) << prepared.status();
    EXPECT_EQ(prepared->job.spec().dump(), root_ + "/state/takes/" + kTake + "/take");
    EXPECT_EQ(prepared->job.spec().rig(), root_ + "/files/rig.json");
    EXPECT_EQ(prepared->job.spec().board(), root_ + "/files/board.json");
    EXPECT_EQ(prepared->job.spec().garment(), root_ + "/shirt");
  }
  // What the request says goes before it.
  WriteBytes(root_ + "/other/rig.json", "{}");
  request.mutable_spec()->set_rig(root_ + "/other/rig.json");
  EXPECT_EQ(Prepare(request)->job.spec().rig(), root_ + "/other/rig.json");
  request.mutable_spec()->set_dump("take:20260101-000000-11111111");
  EXPECT_EQ(Refused(request, absl::StatusCode::kNotFound),
            "spec.dump: take:20260101-000000-11111111: no such take; `weft take list` shows the takes");
  request.mutable_spec()->set_dump("take:../results");
  EXPECT_THAT(Refused(request, absl::StatusCode::kInvalidArgument), HasSubstr("take_id"));
}

TEST_F(PrepareJobTest, ALiveJobWaitsForTheFirstFrameSetOfItsTake) {
  const RecorderFiles files = PutTake();
  UniqueFd lock = Hold(files);
  v1::SubmitJobRequest request = Request();
  request.mutable_spec()->set_dump(std::string("take:") + kTake);
  EXPECT_EQ(Refused(request, absl::StatusCode::kFailedPrecondition),
            std::string("spec.dump: take:") + kTake +
                ": its cameras are being opened; wait until it is recorded, or register it live");
  request.mutable_spec()->set_live_every(2);
  std::jthread cameras([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    const auto writer = TakeWriter::Create(files.take, {"cam1"}, {});
    ASSERT_TRUE(writer.ok()) << writer.status();
    for (uint64_t number = 0; number < 2; ++number) {
      RawFrameSet set;
      set.number = number;
      set.missing = {{"cam1", "no light"}};
      ASSERT_TRUE((*writer)->Append(0, set).ok());
      ASSERT_TRUE((*writer)->Commit(number, EntriesOfRecorded(set, HostTime_ns())).ok());
    }
    ASSERT_TRUE((*writer)->Close(1, {}, {}).ok());
  });
  const absl::StatusOr<PreparedJob> prepared = Prepare(request);
  cameras.join();
  ASSERT_TRUE(prepared.ok()) << prepared.status();
  ASSERT_FALSE(prepared->frames.empty());
  EXPECT_EQ(prepared->frames[0], "0000") << "not what was loaded";
  EXPECT_EQ(prepared->job.first_frame(), "0000");
  // One that was closed without any.
  lock.Close();
  fs::remove_all(files.take);
  const auto empty = TakeWriter::Create(files.take, {"cam1"}, {});
  ASSERT_TRUE((*empty)->Close(0, {}, {}).ok());
  EXPECT_EQ(Refused(request, absl::StatusCode::kFailedPrecondition),
            "spec.dump: " + files.take + " has no frame set yet; start its cameras first");
}

TEST_F(PrepareJobTest, ItemsOfTheLibraryBecomePathsAndAreHeld) {
  const std::string rig = PutItem(v1::ITEM_KIND_RIG, "lab", "rig.json"),
                    board = PutItem(v1::ITEM_KIND_BOARD, "print", "board.json"),
                    shirt = PutItem(v1::ITEM_KIND_TEMPLATE, "shirt", "template.json"),
                    dump = PutItem(v1::ITEM_KIND_DUMP, "walk", "0000/a.png"),
                    avatar = PutItem(v1::ITEM_KIND_AVATAR, "tee", "avatar.json");
  v1::SubmitJobRequest request = Request();
  request.mutable_spec()->set_dump("library:walk");
  request.mutable_spec()->set_rig("library:lab@1");
  request.mutable_spec()->set_board("library:print");
  request.mutable_spec()->set_garment("library:sha256:" + shirt);
  request.mutable_spec()->mutable_driving()->set_avatar("library:tee");
  const absl::StatusOr<PreparedJob> prepared = Prepare(request);
  ASSERT_TRUE(prepared.ok()) << prepared.status();
  EXPECT_EQ(prepared->job.items().ShortDebugString(), "dump: \"" + dump + "\" rig: \"" + rig +
                                                          "\" board: \"" + board + "\" garment: \"" + shirt +
                                                          "\" avatar: \"" + avatar + "\"");
  EXPECT_EQ(ReadBytes(prepared->job.spec().rig()), "lab");
  EXPECT_EQ(ReadBytes(prepared->job.spec().dump() + "/0000/a.png"), "walk");
  EXPECT_THAT(prepared->holds, SizeIs(5));
  EXPECT_EQ(
      library_->Delete(v1::ITEM_KIND_RIG, "lab", [](const v1::LibraryItem&) { return absl::OkStatus(); })
          .status()
          .code(),
      absl::StatusCode::kFailedPrecondition);
  request.mutable_spec()->set_board("library:none");
  EXPECT_THAT(Refused(request, absl::StatusCode::kNotFound),
              HasSubstr("spec.board: the library has no board \"none\""));
}

TEST_F(PrepareJobTest, InputsThatLeadElsewhereAreNotLoaded) {
  WriteBytes(root_ + "/shirt/ok", "");
  const TempFolder outside;
  WriteBytes(outside / "secret", "x");
  for (const char* input : {"dump", "shirt"}) {
    fs::create_symlink(outside / "secret", root_ + "/" + input + "/way-out");
    EXPECT_THAT(Refused(Request(), absl::StatusCode::kPermissionDenied), HasSubstr("way-out is a link"));
    fs::remove(root_ + "/" + input + "/way-out");
  }
  EXPECT_THAT(loaded_, IsEmpty());
  v1::SubmitJobRequest request = Request();
  request.mutable_spec()->set_rig(root_ + "/none.json");
  EXPECT_EQ(Refused(request, absl::StatusCode::kNotFound),
            "spec.rig: " + root_ + "/none.json: no such file on the daemon's machine; copy it there");
  // The daemon's own takes are not looked through.
  const RecorderFiles files = PutTake();
  fs::create_directories(files.take);
  fs::create_symlink(outside / "secret", files.take + "/way-out");
  request = Request();
  request.mutable_spec()->set_dump(std::string("take:") + kTake);
  EXPECT_TRUE(Prepare(request).ok());
}

TEST_F(PrepareJobTest, ResultsGoToNoFolderOfInputsOfTheDaemonOrOfAnotherWriter) {
  v1::SubmitJobRequest request = Request();
  request.mutable_spec()->set_out(root_ + "/dump/out");
  EXPECT_THAT(Refused(request, absl::StatusCode::kInvalidArgument),
              HasSubstr("out: " + root_ + "/dump/out lies in the folder of "));
  for (const char* probe : {"", "probe"}) {
    request.mutable_spec()->set_out(root_ + "/state/elsewhere/../results");
    request.set_out_probe(probe);
    EXPECT_EQ(Refused(request, absl::StatusCode::kPermissionDenied),
              "spec.out: " + root_ + "/state/results is in the daemon's own folder, " + root_ +
                  "/state; choose another one");
  }
  request = Request();
  request.mutable_spec()->set_out("/elsewhere");
  EXPECT_THAT(Refused(request, absl::StatusCode::kPermissionDenied), HasSubstr("--allow-path"));
  request.set_out_probe("probe");
  EXPECT_THAT(Prepare(request)->job.spec().out(), HasSubstr(root_ + "/state/results/"));
  fs::create_directories(root_ + "/out");
  const auto writer = ResultLock::Acquire(root_ + "/out", "weft of a test", std::chrono::milliseconds(0));
  ASSERT_TRUE(writer.ok()) << writer.status();
  EXPECT_THAT(Refused(Request(), absl::StatusCode::kFailedPrecondition), HasSubstr("weft of a test"));
}

}  // namespace
}  // namespace weft
