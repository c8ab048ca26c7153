// Clients that fetch files, and those that begin to and take nothing.
#include "services/server/daemon/calls/file_stream.h"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <thread>

#include "services/server/daemon/calls/server_stream.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "weft/v1/jobs.grpc.pb.h"
#include "weft/v1/library.grpc.pb.h"

namespace weft {
namespace {

class StalledClients : public DaemonTest {
 protected:
  static constexpr int kStreams = 70;  // more than the daemon has threads for

  StalledClients() {
    StartDaemon();
    id_ = Submit({"a"});
    WaitForEnd(id_);
    WriteBytes(folder_ / "out/a/mesh.ply", std::string(4 << 20, 'm'));
  }

  // A connection of its own, as another client has it.
  std::shared_ptr<grpc::Channel> Connection() const {
    grpc::ChannelArguments own;
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(daemon_->address(), grpc::InsecureChannelCredentials(), own);
  }

  std::string id_;
};

// The stream's window fills, and the daemon waits for the client.
class UnreadStream {
 public:
  UnreadStream(v1::Jobs::Stub& stub, const std::string& job_id) {
    v1::FetchResultRequest request;
    request.set_job_id(job_id);
    request.set_frame("a");
    request.set_kind(v1::RESULT_KIND_MESH);
    reader_ = stub.FetchResult(&context_, request);
  }
  ~UnreadStream() {
    context_.TryCancel();
    reader_->Finish();
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::FileChunk>> reader_;
};

TEST_F(StalledClients, ThatDoNotReadLeaveTheOthersAlone) {
  const auto stub = v1::Jobs::NewStub(Connection());
  std::vector<std::unique_ptr<UnreadStream>> streams;
  for (int i = 0; i < kStreams; ++i) {
    streams.push_back(std::make_unique<UnreadStream>(*stub, id_));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // until the daemon waits for all of them
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(client_->Get(id_).ok());
  EXPECT_TRUE(client_->Fetch(id_, "a", v1::RESULT_KIND_MESH, folder_ / "mesh.ply").ok());
}

TEST_F(StalledClients, ThatDoNotWriteLeaveTheOthersAlone) {
  const auto stub = v1::Library::NewStub(Connection());
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<v1::WriteFileResponse>> responses;
  std::vector<std::unique_ptr<grpc::ClientWriter<v1::WriteFileRequest>>> writers;
  for (int i = 0; i < kStreams; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    responses.push_back(std::make_unique<v1::WriteFileResponse>());
    writers.push_back(stub->WriteFile(contexts.back().get(), responses.back().get()));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // until the daemon waits for all of them
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(client_->Get(id_).ok());
  for (size_t i = 0; i < writers.size(); ++i) {
    contexts[i]->TryCancel();
    writers[i]->Finish();
  }
}

// A service of files alone, whose patience is short.
class Files final : public v1::Jobs::WithCallbackMethod_FetchResult<v1::Jobs::Service> {
 public:
  explicit Files(const std::string& folder) : folder_(*ConfinedFolder::Open(folder)) {}
  grpc::ServerWriteReactor<v1::FileChunk>* FetchResult(grpc::CallbackServerContext* context,
                                                       const v1::FetchResultRequest*) override {
    return SendFile(
        context, "FetchResult", [this] { return FilePieces::Open(folder_, "file", {}); }, kReadTimeout);
  }

  static constexpr std::chrono::milliseconds kReadTimeout{1000};

 private:
  const ConfinedFolder folder_;
};

class Patience : public ::testing::Test {
 protected:
  Patience() {
    WriteBytes(folder_ / "file", std::string(64 << 20, 'm'));
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&files_);
    server_ = builder.BuildAndStart();
    stub_ = v1::Jobs::NewStub(
        grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials()));
  }

  // Reads with pauses; how the stream ended.
  grpc::Status Read(std::chrono::milliseconds pause, int pauses) {
    grpc::ClientContext context;
    const auto reader = stub_->FetchResult(&context, {});
    v1::FileChunk chunk;
    for (int i = 0; reader->Read(&chunk); ++i) {
      if (i < pauses) std::this_thread::sleep_for(pause);
    }
    return reader->Finish();
  }

  TempFolder folder_;
  Files files_{folder_.path()};
  std::unique_ptr<v1::Jobs::Stub> stub_;
  std::unique_ptr<grpc::Server> server_;
};

TEST_F(Patience, EndsWithClientsThatTakeNothing) {
  EXPECT_EQ(Read(std::chrono::milliseconds(3000), 1).error_code(), grpc::StatusCode::CANCELLED);
}

// Watches of something that changes all the time, and of something that does not.
class Watches final : public v1::Jobs::WithCallbackMethod_FetchResult<v1::Jobs::Service> {
 public:
  grpc::ServerWriteReactor<v1::FileChunk>* FetchResult(grpc::CallbackServerContext* context,
                                                       const v1::FetchResultRequest* request) override {
    return WatchByLooking<v1::FileChunk>(
        context, "FetchResult",
        [this, changes = request->frame() == "changes"] {
          v1::FileChunk chunk;
          if (changes) chunk.set_data(std::string(1 << 20, static_cast<char>('a' + looks_++ % 26)));
          chunk.set_file_bytes(1);
          return absl::StatusOr<v1::FileChunk>(chunk);
        },
        [](const v1::FileChunk&) { return false; }, Files::kReadTimeout);
  }

 private:
  std::atomic<int> looks_ = 0;
};

class PatienceWithWatchers : public ::testing::Test {
 protected:
  PatienceWithWatchers() {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&watches_);
    server_ = builder.BuildAndStart();
    stub_ = v1::Jobs::NewStub(
        grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials()));
  }

  // Reads one message, nothing for a while, and then all that comes; how the stream ended. It would go on.
  grpc::Status Watch(const std::string& what) {
    constexpr std::chrono::seconds kPause{6}, kMost{9};
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kMost);
    v1::FetchResultRequest request;
    request.set_frame(what);
    const auto reader = stub_->FetchResult(&context, request);
    v1::FileChunk chunk;
    reader->Read(&chunk);
    std::this_thread::sleep_for(kPause);
    while (reader->Read(&chunk)) {
    }
    return reader->Finish();
  }

  Watches watches_;
  std::unique_ptr<v1::Jobs::Stub> stub_;
  std::unique_ptr<grpc::Server> server_;
};

TEST_F(PatienceWithWatchers, EndsWithThoseThatTakeNothing) {
  EXPECT_EQ(Watch("changes").error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(PatienceWithWatchers, HoldsWhereNothingHappens) {
  EXPECT_EQ(Watch("rests").error_code(), grpc::StatusCode::DEADLINE_EXCEEDED) << "the client's own";
}

TEST_F(Patience, HoldsForSlowClients) {
  EXPECT_TRUE(Read(std::chrono::milliseconds(10), 150).ok());
  EXPECT_TRUE(Read({}, 0).ok());
}

}  // namespace
}  // namespace weft
