// A small HTTP server for pages and numbers of a daemon.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/callers/door.h"

namespace weft {

struct HttpRequest {
  std::string path;   // "/metrics", without the query
  std::string token;  // of "Authorization: Bearer"; empty: none
  std::string peer;   // "10.0.0.5", or a network (network.h)
};

struct HttpAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
};

struct HttpServerOptions {
  // Names besides localhost, addresses and those of the certificate under which browsers may ask: others may
  // be a foreign site's, which points its name at this machine.
  std::vector<std::string> host_names;
  std::string certificate_pem, key_pem;  // both, or neither: plain HTTP
  int connections = 64,
      connections_of_one_address = 16;  // half of them for those that showed a token (door.h)
  std::chrono::seconds patience{
      10};  // with a connection that says nothing, or no whole request of a stranger
};

// Answers GET and HEAD in one thread of its own. Who got an answer of status 200 with a token is no stranger.
// Refused without asking `answer`: other methods, requests with a body, an Origin that is not the server's
// own, and a Host that is none of ours from whoever shows no token, which no foreign site can. Thread safety:
// any thread.
class HttpServer {
 public:
  using Answer = std::function<HttpAnswer(const HttpRequest& request)>;

  // `socket` listens already. InvalidArgument: certificate or key are none, or do not belong together.
  static absl::StatusOr<std::unique_ptr<HttpServer>> Start(UniqueFd socket, HttpServerOptions options,
                                                           Answer answer);
  ~HttpServer();

  // Connections from now on get another certificate; those that are open end. InvalidArgument: the old one
  // stays.
  absl::Status ChangeCertificate(const std::string& certificate_pem, const std::string& key_pem);

 private:
  struct Running;
  HttpServer(UniqueFd socket, HttpServerOptions options, Answer answer);
  absl::StatusOr<std::unique_ptr<Running>> Run(const HttpServerOptions& options);

  // A connection came or went, or showed a token; by MHD's threads.
  void Enter(void** guest, int socket, const std::string& peer);
  void Recognize(void* guest, const std::string& token);
  void Leave(void** guest);

  const UniqueFd socket_;
  HttpServerOptions options_;
  Mutex mutex_;
  Door door_ ABSL_GUARDED_BY(mutex_);
  struct Stranger {
    int socket = -1;
    Door::Time came;
  };
  std::map<uint64_t, Stranger> strangers_ ABSL_GUARDED_BY(mutex_);  // by their places
  const Answer answer_;
  std::unique_ptr<Running> running_;
};

// Whether a browser may ask under this "Host": localhost, an address, or one of the names, with any port.
// "*.studio.example" stands for every name with one step more (RFC 6125, 6.4.3).
bool IsHostOfOurs(const std::string& host, const std::vector<std::string>& names);

}  // namespace weft
