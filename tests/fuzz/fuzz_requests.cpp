// Requests as they come over the wire, to all services of a daemon: the first byte chooses the method, the
// rest is the request. Nobody may end the daemon, get an answer without a category, or write outside of its
// state folder; what was acknowledged is there, also for the next daemon.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "capture/file/plain_text.h"
#include "services/server/daemon/program/daemon.h"
#include "services/server/rpc/service_files.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/services/server/daemon/acting_inputs.h"
#include "weft/v1/cameras.pb.h"
#include "weft/v1/jobs.pb.h"
#include "weft/v1/library.pb.h"
#include "weft/v1/operations.pb.h"
#include "weft/v1/server.pb.h"
#include "weft/v1/sessions.pb.h"
#include "weft/v1/takes.pb.h"

namespace {

namespace fs = std::filesystem;
namespace pb = google::protobuf;

// Stands for the daemon's folder in requests, since that has another name in each process.
constexpr char kFolder[] = "/fuzz/";
constexpr int kInputsPerDaemon = 2000;
constexpr int kDaemonsPerFolder = 4;

// All methods but ListCameras, which asks the network and takes a second.
const std::vector<const pb::MethodDescriptor*>& Methods() {
  static const auto methods = [] {
    std::vector<const pb::MethodDescriptor*> found;
    for (const pb::MethodDescriptor* method : weft::ServiceMethods()) {
      if (method->name() != "ListCameras") found.push_back(method);
    }
    return found;
  }();
  return methods;
}

std::unique_ptr<pb::Message> NewMessage(const pb::Descriptor* type) {
  return std::unique_ptr<pb::Message>(pb::MessageFactory::generated_factory()->GetPrototype(type)->New());
}

void ReplaceFolder(const std::string& folder, pb::Message& message) {
  std::vector<const pb::FieldDescriptor*> fields;
  const pb::Reflection& reflection = *message.GetReflection();
  reflection.ListFields(message, &fields);
  for (const pb::FieldDescriptor* field : fields) {
    const int count = field->is_repeated() ? reflection.FieldSize(message, field) : 1;
    for (int i = 0; i < count; ++i) {
      if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE) {
        ReplaceFolder(folder, *(field->is_repeated() ? reflection.MutableRepeatedMessage(&message, field, i)
                                                     : reflection.MutableMessage(&message, field)));
      } else if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_STRING && !field->is_repeated()) {
        const std::string text = reflection.GetString(message, field);
        reflection.SetString(&message, field, absl::StrReplaceAll(text, {{kFolder, folder}}));
      }
    }
  }
}

struct Answer {
  grpc::Status status;
  std::vector<std::string> messages;
};

std::string BytesOf(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string bytes;
  if (buffer.Dump(&slices).ok()) {
    for (const grpc::Slice& slice : slices)
      bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes;
}

class Server {
 public:
  Server() : folder_(weft::FuzzFolder("requests")) {
    spdlog::set_level(spdlog::level::off);
    StartAnew();
  }
  ~Server() {
    daemon_.reset();
    fs::remove_all(folder_);
  }

  void Try(const pb::MethodDescriptor* method, const std::string& bytes) {
    const std::unique_ptr<pb::Message> request = NewMessage(method->input_type());
    const bool is_request = request->ParseFromString(bytes);
    if (is_request) ReplaceFolder(folder_.string() + "/", *request);
    const Answer answer = Call(method, is_request ? request->SerializeAsString() : bytes);
    const grpc::StatusCode code = answer.status.error_code();
    const std::string& message = answer.status.error_message();
    const std::string said = absl::StrCat(method->name(), ": ", code, ": ", message);
    weft::FuzzRequire(!is_request || (code != grpc::INTERNAL && code != grpc::UNKNOWN), said);
    weft::FuzzRequire(weft::IsUtf8(message) && weft::EscapedText(message) == message, said);
    if (answer.status.ok() && !answer.messages.empty()) Persist(method->name(), answer.messages[0]);
    if (++inputs_ % kInputsPerDaemon == 0) Restart();
  }

 private:
  void StartAnew() {
    daemon_.reset();
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "data/shirt");
    std::ofstream(folder_ / "data/take") << "a\nb\n";
    for (const char* name : {"rig.json", "board.json"}) std::ofstream(folder_ / "data" / name) << "{}";
    known_.clear();
    Start();
  }

  void Start() {
    weft::DaemonOptions options;
    options.listen = {"127.0.0.1:0"};
    options.state_folder = folder_ / "state";
    options.allow_paths = {folder_ / "data"};
    options.worker_program = "/bin/false";
    options.recorder_program = options.command_program = folder_ / "no_such_program";
    options.workers = options.threads_per_worker = 1;
    options.load_inputs = weft::LoadActingInputs;
    auto daemon = weft::Daemon::Start(options);
    weft::FuzzRequire(daemon.ok());
    daemon_ = *std::move(daemon);
    stub_ = std::make_unique<grpc::GenericStub>(
        grpc::CreateChannel(daemon_->address(), grpc::InsecureChannelCredentials()));
  }

  void Restart() {
    const auto entries = std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
    weft::FuzzRequire(entries == 2);
    if (++daemons_ % kDaemonsPerFolder == 0) return StartAnew();
    daemon_.reset();
    Start();
    for (const auto& [method, id] : known_) CheckIsThere(method, id);
  }

  // What was acknowledged can be got.
  void Persist(const std::string& method, const std::string& answer) {
    static const std::map<std::string, std::string> getters = {
        {"SubmitJob", "GetJob"}, {"OpenSession", "GetSession"}, {"StartOperation", "GetOperation"}};
    const auto getter = getters.find(method);
    if (getter == getters.end()) return;
    const pb::MethodDescriptor* get = FindMethod(getter->second);
    const std::unique_ptr<pb::Message> made = NewMessage(get->output_type());
    weft::FuzzRequire(made->ParseFromString(answer));
    const pb::FieldDescriptor* id = made->GetDescriptor()->FindFieldByName("id");
    CheckIsThere(getter->second, made->GetReflection()->GetString(*made, id));
    known_.emplace(getter->second, made->GetReflection()->GetString(*made, id));
  }

  void CheckIsThere(const std::string& getter, const std::string& id) {
    const pb::MethodDescriptor* get = FindMethod(getter);
    const std::unique_ptr<pb::Message> request = NewMessage(get->input_type());
    request->GetReflection()->SetString(request.get(), get->input_type()->field(0), id);
    const grpc::Status status = Call(get, request->SerializeAsString()).status;
    weft::FuzzRequire(status.ok(), absl::StrCat(getter, " ", id, ": ", status.error_message()));
  }

  static const pb::MethodDescriptor* FindMethod(const std::string& name) {
    return *std::find_if(Methods().begin(), Methods().end(),
                         [&](const auto* one) { return one->name() == name; });
  }

  // Streams that do not end are left after some messages or a second.
  Answer Call(const pb::MethodDescriptor* method, const std::string& request) {
    constexpr size_t kMostMessages = 20;
    grpc::CompletionQueue queue;
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() +
                         std::chrono::seconds(method->server_streaming() ? 1 : 60));
    const auto call = stub_->PrepareCall(&context, weft::PathOf(*method), &queue);
    const auto wait = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    Answer answer;
    call->StartCall(nullptr);
    bool goes_on = wait();
    if (goes_on) {
      const grpc::Slice slice(request);
      call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
      goes_on = wait();
    }
    while (goes_on) {
      grpc::ByteBuffer message;
      call->Read(&message, nullptr);
      goes_on = wait();
      if (goes_on) answer.messages.push_back(BytesOf(message));
      if (answer.messages.size() == kMostMessages) context.TryCancel();
    }
    call->Finish(&answer.status, nullptr);
    wait();
    return answer;
  }

  const fs::path folder_;
  std::unique_ptr<weft::Daemon> daemon_;
  std::unique_ptr<grpc::GenericStub> stub_;
  std::set<std::pair<std::string, std::string>> known_;  // method that gets it, id
  int inputs_ = 0, daemons_ = 0;
};

std::string Seed(const std::string& method, const pb::Message& request) {
  for (size_t i = 0; i < Methods().size(); ++i) {
    if (Methods()[i]->name() == method) return static_cast<char>(i) + request.SerializeAsString();
  }
  std::abort();
}

weft::v1::Session TwoCameras() {
  weft::v1::Session session;
  session.set_fps(30);
  session.add_cameras()->set_id("left");
  session.mutable_cameras(0)->mutable_gige()->set_device("127.0.0.2");
  session.add_cameras()->set_id("usb");
  session.mutable_cameras(1)->set_unsynchronized(true);
  session.mutable_cameras(1)->mutable_v4l2()->set_device("/dev/video0");
  return session;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static std::unique_ptr<Server> server;
  if (server == nullptr) server = std::make_unique<Server>();
  weft::fuzz_end = [] { server.reset(); };
  if (size == 0) return 0;
  server->Try(Methods()[data[0] % Methods().size()],
              std::string(reinterpret_cast<const char*>(data) + 1, size - 1));
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  std::vector<std::string> seeds;
  v1::SubmitJobRequest job;
  job.mutable_spec()->set_dump("/fuzz/data/take");
  job.mutable_spec()->set_rig("/fuzz/data/rig.json");
  job.mutable_spec()->set_board("/fuzz/data/board.json");
  job.mutable_spec()->set_garment("/fuzz/data/shirt");
  job.mutable_spec()->set_frames("0:1");
  job.set_idempotency_key("20260101-000000-00000001");
  seeds.push_back(Seed("SubmitJob", job));
  v1::WatchJobRequest watch;
  watch.set_job_id("20260101-000000-00000001");
  for (const char* method : {"GetJob", "WatchJob", "CancelJob", "RetryJob", "ListFrames", "FetchResult"})
    seeds.push_back(Seed(method, watch));
  v1::OpenSessionRequest session;
  *session.mutable_cameras() = TwoCameras();
  session.set_rig("/fuzz/data/rig.json");
  session.set_owner("anna");
  session.set_lease_s(60);
  seeds.push_back(Seed("OpenSession", session));
  session.set_take_over(true);
  session.set_board("library:stripes@2");
  session.set_idempotency_key("20260101-000000-00000002");
  seeds.push_back(Seed("OpenSession", session));
  v1::StartTakeRequest take;
  *take.mutable_recording()->mutable_session() = TwoCameras();
  take.mutable_recording()->set_seconds(1);
  seeds.push_back(Seed("StartTake", take));
  take.mutable_recording()->mutable_session()->mutable_cameras(0)->clear_gige();
  take.mutable_recording()->mutable_session()->mutable_cameras(0)->mutable_replay()->set_take(
      "take:20260101-000000-00000003");
  seeds.push_back(Seed("StartTake", take));
  v1::LookAtCamerasRequest look;
  *look.mutable_cameras() = TwoCameras();
  seeds.push_back(Seed("LookAtCameras", look));
  v1::StartOperationRequest operation;
  operation.mutable_spec()->set_command("take verify");
  v1::OperationInput& input = *operation.mutable_spec()->add_inputs();
  input.set_name("take");
  input.set_value("/fuzz/data/take");
  operation.set_idempotency_key("20260101-000000-00000004");
  seeds.push_back(Seed("StartOperation", operation));
  v1::BeginUploadRequest upload;
  upload.set_kind(v1::ITEM_KIND_RIG);
  upload.set_name("studio");
  v1::ItemFile& file = *upload.mutable_manifest()->add_files();
  file.set_path("rig.json");
  file.set_bytes(2);
  file.set_sha256(std::string(64, 'a'));
  seeds.push_back(Seed("BeginUpload", upload));
  v1::GetTakeRequest of_take;
  of_take.set_take_id("20260101-000000-00000003");
  for (const pb::MethodDescriptor* method : Methods()) seeds.push_back(Seed(method->name(), of_take));
  return seeds;
}
