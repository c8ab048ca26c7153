// Files of a daemon's state folder as a crash, a bad disk or a curious person may leave them: the first byte
// chooses the file, the rest is its content. Whoever reads it at the daemon's start goes on without it, says
// which file it is, and never changes or removes what it could not read.
#include <spdlog/spdlog.h>

#include <filesystem>
#include <map>
#include <memory>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/server/daemon/studio/session_registry.h"
#include "services/server/daemon/studio/take_store.h"
#include "services/server/daemon/work/operation_queue.h"
#include "services/server/library/library.h"
#include "services/studio/recording/session_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "weft/v1/operations.pb.h"
#include "weft/v1/recorder.pb.h"
#include "weft/v1/take.pb.h"

namespace {

namespace fs = std::filesystem;
using weft::FuzzFolder;
using weft::FuzzRequire;

const std::string kId = "20260101-000000-00000001";
const weft::Caller kAnybody{"token 1 (anna)", weft::v1::ROLE_OPERATOR};
const std::string kItem = std::string(64, 'a');

class State {
 public:
  State() : folder_(FuzzFolder("state_files")) {
    spdlog::set_level(spdlog::level::off);
    fs::remove_all(folder_);
  }
  ~State() { fs::remove_all(folder_); }

  void Try(char kind, const std::string& content) {
    using Reader = void (State::*)(const std::string& path);
    static const std::vector<std::pair<std::string, Reader>> files = {
        {"sessions/" + kId + ".json", &State::ReadSessions},
        {"operations/" + kId + "/operation.json", &State::ReadOperations},
        {"takes/" + kId + "/request.json", &State::ReadTakes},
        {"takes/" + kId + "/state.json", &State::ReadTakes},
        {"takes/" + kId + "/keeping.json", &State::ReadTakes},
        {"takes/" + kId + "/take/ledger.csv", &State::ReadTakes},
        {"takes/" + kId + "/take/take.json", &State::ReadTakes},
        {"library/rig/" + kItem + "/item.json", &State::ReadLibrary},
        {"library/rig/" + kItem + "/manifest.json", &State::ReadLibrary},
        {"session.json", &State::ReadSessionFile}};
    const auto& [name, read] = files[static_cast<unsigned char>(kind) % files.size()];
    fs::remove_all(folder_);
    fs::create_directories((folder_ / name).parent_path());
    for (const auto& [other, text] : Companions()) {
      if (fs::exists((folder_ / other).parent_path())) Write(other, text);
    }
    Write(name, content);
    (this->*read)(folder_ / name);
  }

 private:
  // What stands beside the file, so that reading goes on.
  static const std::map<std::string, std::string>& Companions() {
    static const std::map<std::string, std::string> files = {
        {"takes/" + kId + "/request.json",
         R"({"session": {"cameras": [{"id": "a", "gige": {"device": "b"}}]}})"},
        {"takes/" + kId + "/state.json", R"({"phase": "RECORDER_PHASE_RECORDING"})"},
        {"library/rig/" + kItem + "/item.json", R"({"kind": "ITEM_KIND_RIG", "id": ")" + kItem + R"("})"}};
    return files;
  }

  void Write(const std::string& name, const std::string& content) {
    FuzzRequire(weft::WriteFileAtomically(folder_ / name, content).ok());
  }

  template <typename Message>
  static bool IsReadable(const std::string& path) {
    Message message;
    return weft::ReadJsonFile(path, message).ok();
  }

  void ReadSessions(const std::string& path) {
    const bool readable = IsReadable<weft::v1::CaptureSession>(path);
    const std::string before = *weft::ReadWholeFile(path);
    const auto keeper = weft::SessionRegistry::Create(folder_ / "sessions");
    FuzzRequire(keeper.ok());
    const weft::v1::ListSessionsResponse list = *(*keeper)->List(10);
    (*keeper)->UsersOfDevices();
    for (const weft::v1::CaptureSession& session : list.sessions()) FuzzRequire(session.id() == kId);
    FuzzRequire(readable || (list.sessions().empty() && *weft::ReadWholeFile(path) == before));
    weft::v1::OpenSessionRequest request;
    request.mutable_cameras()->add_cameras()->mutable_gige()->set_device("127.0.0.2");
    (void)(*keeper)->Open(request, kAnybody);
  }

  void ReadOperations(const std::string& path) {
    const bool readable = IsReadable<weft::v1::Operation>(path);
    const std::string before = *weft::ReadWholeFile(path);
    weft::OperationQueueOptions options;
    options.folder = folder_ / "operations";
    options.program = folder_ / "no_such_program";
    options.resolve = [](const std::string&, auto, const std::string& value) -> absl::StatusOr<std::string> {
      return value;
    };
    options.adopt_take = [](const std::string&, const std::string&) { return absl::OkStatus(); };
    const auto queue = weft::OperationQueue::Create(options);
    FuzzRequire(queue.ok());
    const weft::v1::ListOperationsResponse list = *(*queue)->List(10);
    FuzzRequire(list.operations_size() + list.warnings_size() <= 1);
    if (!readable) FuzzRequire(list.warnings_size() == 1 && *weft::ReadWholeFile(path) == before);
    for (const weft::v1::Operation& operation : list.operations()) {
      FuzzRequire(operation.id() == kId);
      weft::v1::ListOperationFilesRequest files;
      files.set_operation_id(operation.id());
      (void)(*queue)->Files(files);
      (void)(*queue)->OpenFile(operation.id(), "../operation.json", {});
      (void)(*queue)->Cancel(operation.id(), kAnybody);
      (void)(*queue)->Delete(operation.id(), kAnybody);
    }
  }

  void ReadTakes(const std::string& path) {
    const std::string before = *weft::ReadWholeFile(path);
    weft::TakeStoreOptions options;
    options.takes_folder = folder_ / "takes";
    options.trash_folder = folder_ / "trash";
    options.looks_folder = folder_ / "looks";
    options.recorder_program = folder_ / "no_such_program";
    weft::TakeStore keeper(options);
    const weft::v1::ListTakesResponse list = keeper.List({}, 10);
    FuzzRequire(list.takes_size() + list.warnings_size() == 1);
    FuzzRequire(list.takes_size() == 1 || *weft::ReadWholeFile(path) == before);
    keeper.UsersOfDevices();
    const bool pinned = absl::EndsWith(path, "keeping.json") && !IsReadable<weft::v1::TakeKeeping>(path);
    const absl::Status deleted = keeper.Delete(kId, "fuzz").status();
    FuzzRequire(!deleted.ok() || !pinned);
    if (deleted.ok()) {
      weft::v1::ListTakesRequest trash;
      trash.set_trash(true);
      const weft::v1::ListTakesResponse listed = keeper.List(trash, 10);
      FuzzRequire(listed.takes_size() + listed.warnings_size() == 1);
    }
  }

  void ReadLibrary(const std::string& path) {
    const std::string before = *weft::ReadWholeFile(path);
    const auto library = weft::Library::Open(folder_);
    FuzzRequire(library.ok());
    const auto listing = (*library)->List(weft::v1::ITEM_KIND_UNSPECIFIED);
    FuzzRequire(listing.ok() && listing->items.size() + listing->damaged.size() <= 1);
    for (const weft::v1::LibraryItem& item : listing->items) {
      FuzzRequire(item.id() == kItem);
      FuzzRequire(
          !(*library)->Hold(weft::v1::ITEM_KIND_RIG, "sha256:" + kItem).ok());  // its content is missing
      if (!item.names().empty()) (void)(*library)->Find(weft::v1::ITEM_KIND_RIG, item.names(0).name());
    }
    FuzzRequire(*weft::ReadWholeFile(path) == before);
  }

  // That of an operator.
  void ReadSessionFile(const std::string& path) {
    const absl::StatusOr<weft::v1::Session> session = weft::ReadSession(path);
    if (!session.ok()) return FuzzRequire(absl::StrContains(session.status().message(), "session.json"));
    (void)weft::RecordingOptionsOf(*session);
    weft::DevicesOf(*session);
    for (const std::string& take : weft::ReplayedTakesOf(*session))
      FuzzRequire(take[0] == '/' || absl::StartsWith(take, "take:"));
  }

  const fs::path folder_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static State state;
  if (size == 0) return 0;
  state.Try(static_cast<char>(data[0]), std::string(reinterpret_cast<const char*>(data) + 1, size - 1));
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  const std::string cameras =
      R"("cameras": [{"id": "a", "gige": {"device": "127.0.0.2", "features": ["Width=64"]}},
{"id": "b", "own_pace": true, "v4l2": {"device": "/dev/video0", "format": "YUYV", "controls": ["Gain=1"]}},
{"id": "c", "replay": {"take": "../take", "speed": 2}}])";
  const std::string session =
      "{\"fps\": 30, \"tolerance_ms\": 2, \"clocks\": \"SESSION_CLOCKS_ESTIMATED\", " + cameras +
      R"(, "trigger": {"kind": "SESSION_TRIGGER_KIND_ACTION", "device_key": 1}})";
  const auto seed = [](int kind, const std::string& text) { return static_cast<char>(kind) + text; };
  return {
      seed(0, R"({"id": ")" + kId + R"(", "cameras": )" + session + R"(, "owner": "anna", "lease": ")" + kId +
                  R"(.0123", "lease_s": 60,
"state": "CAPTURE_SESSION_STATE_OPEN"})"),
      seed(1, R"({"id": ")" + kId + R"(", "state": "JOB_STATE_RUNNING", "spec": {"command": "take verify",
"inputs": [{"name": "take", "value": "take:20260101-000000-00000001"}], "options": [], "json": true}})"),
      seed(1,
           R"({"id": ")" + kId + R"(", "state": "JOB_STATE_DONE", "finished_unix_ns": "5", "take_id": "x"})"),
      seed(2,
           R"({"seconds": 1, "capture_session": "s", "rig": "library:studio", "session": )" + session + "}"),
      seed(3, R"({"phase": "RECORDER_PHASE_ENDED", "sets_recorded": "3", "cameras": [{"id": "a"}]})"),
      seed(3, R"({"phase": "RECORDER_PHASE_FAILED", "message": "no light", "error_code": "NOT_FOUND"})"),
      seed(4, R"({"pinned": true, "deleted_unix_ns": "5", "deleted_because": "age"})"),
      seed(5,
           "event,first_set,last_set,device_time_ns,host_time_ns,camera,cause\n"
           "recorded,0,0,-5,17,,\nmissing,0,0,0,9,\"a\",\"b\"\nend,0,0,0,20,,\"complete\"\n"),
      seed(6, R"({"cameras": ["a"], "frame_sets": "3"})"),
      seed(7, R"({"kind": "ITEM_KIND_RIG", "id": ")" + kItem +
                  R"(", "names": [{"name": "studio", "version": 2, "created_unix_ns": "5"}], "bytes": "3"})"),
      seed(8, R"({"files": [{"path": "rig.json", "bytes": "3", "sha256": ")" + kItem + R"("}]})"),
      seed(9, session)};
}
