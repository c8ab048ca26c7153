// echo_server SERVER JOB CERTIFICATE KEY STATE: what gRPC alone costs. Asks the daemon at SERVER for a job
// once, and answers GetJob with it from then on, with TLS and the daemon's tokens and nothing else. Prints
// its address; ends with its standard input.
#include <grpcpp/grpcpp.h>
#include <grpcpp/security/auth_metadata_processor.h>

#include <cstdio>
#include <memory>

#include "services/formats/files/atomic_file.h"
#include "services/server/access/access_control.h"
#include "services/server/access/access_list.h"
#include "services/tools/client/channel.h"
#include "weft/v1/jobs.grpc.pb.h"

namespace weft {
namespace {

class TokenCheck final : public grpc::AuthMetadataProcessor {
 public:
  explicit TokenCheck(const std::string& list) : access_(list, [](const std::string&) {}) {}
  bool IsBlocking() const override { return false; }
  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext*, OutputMetadata*,
                       OutputMetadata*) override {
    constexpr size_t kSchemeBytes = 7;  // "Bearer "
    const auto shown = metadata.find("authorization");
    if (shown == metadata.end() || shown->second.size() < kSchemeBytes)
      return {grpc::StatusCode::UNAUTHENTICATED, "no token"};
    const std::string token(shown->second.data() + kSchemeBytes, shown->second.size() - kSchemeBytes);
    return access_.Identify({"", token, ""}).ok()
               ? grpc::Status::OK
               : grpc::Status(grpc::StatusCode::UNAUTHENTICATED, "unknown");
  }

 private:
  AccessControl access_;
};

class EchoService final : public v1::Jobs::Service {
 public:
  explicit EchoService(v1::Job job) : job_(std::move(job)) {}
  grpc::Status GetJob(grpc::ServerContext*, const v1::GetJobRequest*, v1::Job* job) override {
    *job = job_;
    return grpc::Status::OK;
  }

 private:
  const v1::Job job_;
};

int Serve(char** argv) {
  const auto channel = OpenChannel(argv[1], ClientIdentity::FromEnvironment()).value();
  grpc::ClientContext context;
  v1::GetJobRequest request;
  request.set_job_id(argv[2]);
  v1::Job job;
  const grpc::Status asked = v1::Jobs::NewStub(channel)->GetJob(&context, request, &job);
  if (!asked.ok()) {
    std::fprintf(stderr, "echo_server: %s\n", asked.error_message().c_str());
    return 1;
  }
  grpc::SslServerCredentialsOptions tls;
  tls.pem_key_cert_pairs.push_back({ReadWholeFile(argv[4]).value(), ReadWholeFile(argv[3]).value()});
  const auto credentials = grpc::SslServerCredentials(tls);
  credentials->SetAuthMetadataProcessor(std::make_shared<TokenCheck>(AccessListFile(argv[5])));
  EchoService service(job);
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", credentials, &port);
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  std::printf("127.0.0.1:%d\n", port);
  std::fflush(stdout);
  while (std::getchar() != EOF) {
  }
  server->Shutdown(std::chrono::system_clock::now());
  return 0;
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) { return argc == 6 ? weft::Serve(argv) : 2; }
