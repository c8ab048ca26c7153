#include "services/tools/client/channel.h"

#include <grpcpp/grpcpp.h>
#include <grpcpp/support/client_interceptor.h>

#include <cstdlib>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/loopback.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "services/formats/files/text_file.h"
#include "services/server/rpc/message_limit.h"

namespace weft {
namespace {

constexpr int kMaxAnswerBytes = 64 << 20;
constexpr uint64_t kLargestSecretBytes = 1 << 20;
constexpr char kUnixPrefix[] = "unix:";

// Adds the token to every call of the channel.
class TokenInterceptor final : public grpc::experimental::Interceptor {
 public:
  explicit TokenInterceptor(std::string value) : value_(std::move(value)) {}
  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(
            grpc::experimental::InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      methods->GetSendInitialMetadata()->insert({"authorization", value_});
    }
    methods->Proceed();
  }

 private:
  const std::string value_;
};

class TokenInterceptorFactory final : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit TokenInterceptorFactory(const std::string& token) : value_("Bearer " + token) {}
  grpc::experimental::Interceptor* CreateClientInterceptor(grpc::experimental::ClientRpcInfo*) override {
    return new TokenInterceptor(value_);
  }

 private:
  const std::string value_;
};

absl::StatusOr<std::string> ReadNamed(const char* variable, const std::string& path) {
  if (path.empty()) return "";
  absl::StatusOr<std::string> text = ReadTextFile(path, kLargestSecretBytes);
  if (text.ok()) return text;
  return Naming(variable, text.status());
}

// The host of HOST:PORT.
absl::StatusOr<std::string> HostOfServer(const std::string& server) {
  if (const size_t scheme = server.find("://"); scheme != std::string::npos) {
    return absl::InvalidArgumentError(
        absl::StrCat("server: \"", server, "\" is the address of a page; give \"", server.substr(scheme + 3),
                     "\" with the port of weftd --listen"));
  }
  const size_t colon = server.rfind(':');
  int port = 0;
  if (colon != std::string::npos && colon > 0 && absl::SimpleAtoi(server.substr(colon + 1), &port) &&
      port > 0 && port < 65536) {
    return server.substr(0, colon);
  }
  return absl::InvalidArgumentError(
      absl::StrCat("server: \"", server, "\" is not HOST:PORT or unix:PATH, for example 127.0.0.1:7411"));
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> TlsOf(const ClientIdentity& identity) {
  if (identity.certificate.empty() != identity.key.empty())
    return absl::InvalidArgumentError(
        "WEFT_TLS_CERT and WEFT_TLS_KEY: a certificate needs its key; set both");
  grpc::SslCredentialsOptions options;
  const std::pair<const char*, std::pair<const std::string*, std::string*>> files[] = {
      {"WEFT_TLS_CA", {&identity.authority, &options.pem_root_certs}},
      {"WEFT_TLS_CERT", {&identity.certificate, &options.pem_cert_chain}},
      {"WEFT_TLS_KEY", {&identity.key, &options.pem_private_key}}};
  for (const auto& [variable, file] : files) {
    WEFT_ASSIGN_OR_RETURN(*file.second, ReadNamed(variable, *file.first));
  }
  return grpc::SslCredentials(options);
}

grpc::ChannelArguments ChannelSettings() {
  grpc::ChannelArguments settings;
  settings.SetMaxReceiveMessageSize(kMaxAnswerBytes);
  settings.SetMaxSendMessageSize(kLargestRequest_bytes);
  settings.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  // Notices a daemon whose machine went away while a job is watched.
  settings.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 60'000);
  settings.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20'000);
  settings.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return settings;
}

std::string Variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

ClientIdentity ClientIdentity::FromEnvironment() {
  return {Variable("WEFT_TOKEN_FILE"), Variable("WEFT_TLS_CA"), Variable("WEFT_TLS_CERT"),
          Variable("WEFT_TLS_KEY")};
}

bool UsesTls(const std::string& host, const ClientIdentity& identity) {
  return !IsLoopbackHost(host) || !identity.authority.empty();
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> OpenChannel(const std::string& server,
                                                           const ClientIdentity& identity) {
  std::shared_ptr<grpc::ChannelCredentials> credentials = grpc::InsecureChannelCredentials();
  if (!absl::StartsWith(server, kUnixPrefix)) {
    WEFT_ASSIGN_OR_RETURN(const std::string host, HostOfServer(server));
    if (UsesTls(host, identity)) {
      WEFT_ASSIGN_OR_RETURN(credentials, TlsOf(identity));
    }
  }
  WEFT_ASSIGN_OR_RETURN(const std::string token, ReadNamed("WEFT_TOKEN_FILE", identity.token_file));
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> interceptors;
  const std::string text(absl::StripAsciiWhitespace(token));
  if (text.empty() && !identity.token_file.empty())
    return absl::InvalidArgumentError(absl::StrCat("WEFT_TOKEN_FILE: ", identity.token_file,
                                                   " is empty; put a token of `weft access token` there"));
  if (!text.empty()) interceptors.push_back(std::make_unique<TokenInterceptorFactory>(text));
  return grpc::experimental::CreateCustomChannelWithInterceptors(server, credentials, ChannelSettings(),
                                                                 std::move(interceptors));
}

}  // namespace weft
