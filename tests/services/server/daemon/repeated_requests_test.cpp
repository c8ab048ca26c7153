// Requests whose answer is lost, and transfers that break off.
#include <future>
#include <thread>

#include "services/server/daemon/calls/file_stream.h"
#include "tests/services/server/daemon/cutting_proxy.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr char kKey[] = "3f2a9c1e-weft";

std::string SomeBytes(size_t count) {
  std::string bytes(count, '\0');
  for (size_t i = 0; i < count; ++i) bytes[i] = static_cast<char>(i * 2654435761u >> 24);
  return bytes;
}

class RepeatedRequests : public DaemonTest {
 protected:
  v1::SubmitJobRequest KeyedRequest() {
    v1::SubmitJobRequest request = MakeRequest({"a", "b"});
    request.set_idempotency_key(kKey);
    return request;
  }
  size_t CountJobs() { return client_->List(0).value().size(); }
};

TEST_F(RepeatedRequests, GetTheSameJobAlsoAfterARestart) {
  StartDaemon();
  const auto first = client_->Submit(KeyedRequest());
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->id(), kKey);
  EXPECT_EQ(client_->Submit(KeyedRequest()).value().created_unix_ns(), first->created_unix_ns());
  EXPECT_EQ(WaitForEnd(kKey).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(client_->Submit(KeyedRequest()).value().state(), v1::JOB_STATE_DONE);
  daemon_.reset();
  StartDaemon();
  EXPECT_EQ(client_->Submit(KeyedRequest()).value().created_unix_ns(), first->created_unix_ns());
  EXPECT_EQ(CountJobs(), 1u);
}

TEST_F(RepeatedRequests, ThatAskForSomethingElseAreRefused) {
  StartDaemon();
  ASSERT_TRUE(client_->Submit(KeyedRequest()).ok());
  v1::SubmitJobRequest other_priority = KeyedRequest(), other_spec = KeyedRequest();
  other_priority.set_priority(3);
  other_spec.mutable_spec()->mutable_options()->set_frames_alone(true);
  for (const v1::SubmitJobRequest& other : {other_priority, other_spec}) {
    const absl::Status status = client_->Submit(other).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kAlreadyExists) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("idempotency_key"));
  }
  EXPECT_EQ(CountJobs(), 1u);
}

TEST_F(RepeatedRequests, AtTheSameTimeMakeOneJob) {
  StartDaemon();
  std::vector<std::string> ids(8);
  std::vector<std::jthread> clients;
  const v1::SubmitJobRequest request = KeyedRequest();
  for (std::string& id : ids) {
    clients.emplace_back([&] {
      const auto job = client_->Submit(request);
      id = job.ok() ? job->id() : job.status().ToString();
    });
  }
  clients.clear();
  for (const std::string& id : ids) EXPECT_EQ(id, kKey);
  EXPECT_EQ(CountJobs(), 1u);
}

TEST_F(RepeatedRequests, KeepNoOtherRequestWaiting) {
  std::promise<void> other_came;
  options_.load_inputs = [&, other = other_came.get_future().share()](const v1::RegistrationSpec& spec) {
    if (spec.dump().ends_with("other.take")) other_came.set_value();
    EXPECT_EQ(other.wait_for(std::chrono::seconds(20)), std::future_status::ready);
    return LoadActingInputs(spec);
  };
  StartDaemon();
  std::vector<std::jthread> clients;
  for (int k = 0; k < 2; ++k)
    clients.emplace_back([&] { EXPECT_EQ(client_->Submit(KeyedRequest())->id(), kKey); });
  EXPECT_TRUE(client_->Submit(MakeRequest({"a"}, "other")).ok());
  clients.clear();
  EXPECT_EQ(CountJobs(), 2u);
}

TEST_F(RepeatedRequests, AreSentByTheClientWhenTheAnswerIsLost) {
  StartDaemon();
  CuttingProxy proxy(daemon_->address());
  const auto remote = RegistrationClient::Connect(proxy.address());
  ASSERT_TRUE(remote.ok()) << remote.status();
  proxy.Hold(true);
  absl::StatusOr<v1::Job> job = absl::UnknownError("");
  std::jthread submitting([&] { job = (*remote)->Submit(KeyedRequest()); });
  for (int k = 0; k < 500 && CountJobs() == 0; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  proxy.Hold(false);
  proxy.Cut();
  submitting.join();
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->id(), kKey);
  EXPECT_GE(proxy.connections(), 2);
  EXPECT_EQ(CountJobs(), 1u);
}

TEST_F(RepeatedRequests, GoOnWhereATransferBrokeOff) {
  StartDaemon();
  const std::string id = Submit({"a"});
  WaitForEnd(id);
  const std::string mesh = SomeBytes(6 << 20);
  WriteBytes(folder_ / "out/a/mesh.ply", mesh);
  CuttingProxy proxy(daemon_->address());
  const auto remote = RegistrationClient::Connect(proxy.address());
  ASSERT_TRUE(remote.ok()) << remote.status();
  proxy.CutAfter(2 << 20);
  const absl::Status status = (*remote)->Fetch(id, "a", v1::RESULT_KIND_MESH, folder_ / "mesh.ply");
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(ReadBytes(folder_ / "mesh.ply"), mesh);
  EXPECT_GE(proxy.connections(), 3);
  // What was under way when a connection broke is sent twice, the rest once.
  EXPECT_LT(proxy.bytes_from_server(), 12 << 20);
}

TEST_F(RepeatedRequests, GiveUpOnADaemonThatStaysAway) {
  StartDaemon();
  const std::string id = Submit({"a"});
  WaitForEnd(id);
  daemon_.reset();
  EXPECT_EQ(client_->Fetch(id, "a", v1::RESULT_KIND_MESH, folder_ / "mesh.ply").code(),
            absl::StatusCode::kUnavailable);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "mesh.ply"));
}

class StreamedFile : public ::testing::Test {
 protected:
  StreamedFile() { WriteBytes(path_, content_); }

  // The bytes that arrive.
  absl::StatusOr<std::string> Stream(const StreamStart& start) {
    std::string bytes;
    int64_t at = start.offset;
    const absl::StatusOr<ConfinedFolder> folder = ConfinedFolder::Open(folder_.path());
    if (!folder.ok()) return folder.status();
    absl::StatusOr<FilePieces> pieces = FilePieces::Open(*folder, "mesh.ply", start);
    if (!pieces.ok()) return pieces.status();
    for (v1::FileChunk chunk;;) {
      const absl::StatusOr<bool> next = pieces->Next(&chunk);
      if (!next.ok()) return next.status();
      if (!*next) return bytes;
      EXPECT_EQ(chunk.offset(), at);
      EXPECT_EQ(chunk.file_bytes(), static_cast<int64_t>(content_.size()));
      version_ = chunk.version();
      at += static_cast<int64_t>(chunk.data().size());
      bytes += chunk.data();
    }
  }

  TempFolder folder_;
  const std::string path_ = folder_ / "mesh.ply";
  std::string content_ = SomeBytes(700'000);
  std::string version_;
};

TEST_F(StreamedFile, BeginsAtAnyByte) {
  EXPECT_EQ(Stream({}).value(), content_);
  for (const int64_t offset : {1, 262'144, 699'999, 700'000})
    EXPECT_EQ(Stream({offset, version_}).value(), content_.substr(static_cast<size_t>(offset)));
  EXPECT_EQ(Stream({700'001, version_}).status().code(), absl::StatusCode::kOutOfRange);
}

TEST_F(StreamedFile, IsNotMixedFromTwoVersions) {
  ASSERT_TRUE(Stream({}).ok());
  ASSERT_TRUE(WriteFileAtomically(path_, content_).ok());
  EXPECT_EQ(Stream({5, version_}).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(Stream({5, ""}).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(Stream({0, "any"}).value(), content_);
}

}  // namespace
}  // namespace weft
