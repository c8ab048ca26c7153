// A server that answers as a test tells it to: what a real daemon does only when it is broken off, or is of
// another version.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/tools/client/registration_client.h"
#include "weft/v1/jobs.grpc.pb.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {

template <typename Request, typename Answer>
using AnswerFunction = std::function<grpc::Status(const Request&, Answer*)>;
template <typename Request, typename Message>
using StreamFunction = std::function<grpc::Status(const Request&, grpc::ServerWriter<Message>*)>;

// `answer` where there is one.
template <typename Function, typename Request, typename Answer>
grpc::Status AnswerBy(const Function& answer, const Request& request, Answer* out) {
  if (!answer) return grpc::Status(grpc::StatusCode::UNIMPLEMENTED, "the test has no answer");
  return answer(request, out);
}

inline v1::FileChunk Chunk(const std::string& data, int64_t offset, int64_t file_bytes,
                           const std::string& version) {
  v1::FileChunk chunk;
  chunk.set_data(data);
  chunk.set_offset(offset);
  chunk.set_file_bytes(file_bytes);
  chunk.set_version(version);
  return chunk;
}

inline grpc::Status BrokenOff() { return {grpc::StatusCode::UNAVAILABLE, "the daemon is shutting down"}; }

class AnsweringServer final : public v1::Server::Service {
 public:
  AnswerFunction<v1::DrainRequest, v1::DrainProgress> drain;
  AnswerFunction<v1::RehearseRetentionRequest, v1::RetentionRehearsal> rehearse;
  std::string authorization;  // of the last call
  v1::ServerInfo told;        // version 7.8.9 where it says none
  grpc::Status knows_client;

 private:
  grpc::Status GetServerInfo(grpc::ServerContext* context, const v1::GetServerInfoRequest*,
                             v1::ServerInfo* info) override {
    const auto found = context->client_metadata().find("authorization");
    authorization = found == context->client_metadata().end()
                        ? ""
                        : std::string(found->second.data(), found->second.size());
    *info = told;
    if (told.version().empty()) info->set_version("7.8.9");
    return knows_client;
  }
  grpc::Status Drain(grpc::ServerContext*, const v1::DrainRequest* request,
                     v1::DrainProgress* answer) override {
    return AnswerBy(drain, *request, answer);
  }
  grpc::Status RehearseRetention(grpc::ServerContext*, const v1::RehearseRetentionRequest* request,
                                 v1::RetentionRehearsal* answer) override {
    return AnswerBy(rehearse, *request, answer);
  }
};

class AnsweringJobs final : public v1::Jobs::Service {
 public:
  AnswerFunction<v1::SubmitJobRequest, v1::Job> submit;
  AnswerFunction<v1::GetJobRequest, v1::Job> get;
  AnswerFunction<v1::CancelJobRequest, v1::Job> cancel;
  AnswerFunction<v1::RetryJobRequest, v1::Job> retry;
  AnswerFunction<v1::ListJobsRequest, v1::ListJobsResponse> list;
  AnswerFunction<v1::ListFramesRequest, v1::ListFramesResponse> frames;
  StreamFunction<v1::WatchJobRequest, v1::JobUpdate> watch;
  StreamFunction<v1::FetchResultRequest, v1::FileChunk> fetch;

 private:
  using Context = grpc::ServerContext;
  grpc::Status SubmitJob(Context*, const v1::SubmitJobRequest* request, v1::Job* job) override {
    return AnswerBy(submit, *request, job);
  }
  grpc::Status GetJob(Context*, const v1::GetJobRequest* request, v1::Job* job) override {
    return AnswerBy(get, *request, job);
  }
  grpc::Status CancelJob(Context*, const v1::CancelJobRequest* request, v1::Job* job) override {
    return AnswerBy(cancel, *request, job);
  }
  grpc::Status RetryJob(Context*, const v1::RetryJobRequest* request, v1::Job* job) override {
    return AnswerBy(retry, *request, job);
  }
  grpc::Status ListJobs(Context*, const v1::ListJobsRequest* request, v1::ListJobsResponse* out) override {
    return AnswerBy(list, *request, out);
  }
  grpc::Status ListFrames(Context*, const v1::ListFramesRequest* request,
                          v1::ListFramesResponse* out) override {
    return AnswerBy(frames, *request, out);
  }
  grpc::Status WatchJob(Context*, const v1::WatchJobRequest* request,
                        grpc::ServerWriter<v1::JobUpdate>* out) override {
    return AnswerBy(watch, *request, out);
  }
  grpc::Status FetchResult(Context*, const v1::FetchResultRequest* request,
                           grpc::ServerWriter<v1::FileChunk>* out) override {
    return AnswerBy(fetch, *request, out);
  }
};

// Serves on a port of its own, and has a client.
class AnsweringDaemon {
 public:
  AnsweringServer info;
  AnsweringJobs jobs;

  // `others`: services besides.
  explicit AnsweringDaemon(const std::vector<grpc::Service*>& others = {}) {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.SetMaxReceiveMessageSize(-1);
    builder.RegisterService(&info);
    builder.RegisterService(&jobs);
    for (grpc::Service* service : others) builder.RegisterService(service);
    server_ = builder.BuildAndStart();
    EXPECT_NE(server_, nullptr);
    address_ = absl::StrCat("127.0.0.1:", port);
    auto client = RegistrationClient::Connect(address_);
    EXPECT_TRUE(client.ok()) << client.status();
    if (client.ok()) client_ = *std::move(client);
  }
  ~AnsweringDaemon() { server_->Shutdown(std::chrono::system_clock::now()); }
  AnsweringDaemon(const AnsweringDaemon&) = delete;
  AnsweringDaemon& operator=(const AnsweringDaemon&) = delete;

  const std::string& address() const { return address_; }
  RegistrationClient& client() const { return *client_; }

 private:
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
  std::unique_ptr<RegistrationClient> client_;
};

}  // namespace weft
