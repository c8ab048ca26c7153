// Notices for a server, by HTTP.
#pragma once

#include <chrono>
#include <stop_token>
#include <string>

#include "absl/status/status.h"

namespace weft {

struct NoticeServer {
  std::string url;          // https, or http to this machine (IsLoopbackHost)
  std::string secret_file;  // signs requests; closed to other users. Empty: they are not signed
  std::string authority;    // certificates that vouch for the server, PEM; empty: those of this machine
  std::chrono::milliseconds patience{std::chrono::seconds(30)};  // per request
};

// InvalidArgument names --on-end-url, --on-end-secret or --on-end-ca, and what is wrong: the URL, or a file
// that cannot be read. PermissionDenied: other users may read the secret.
absl::Status CheckNoticeServer(const NoticeServer& server);

// The URL as logs and messages show it: "https://hooks.example/[redacted]", since its path may be a secret.
std::string ShownUrl(const std::string& url);

// "sha256=" and the HMAC-SHA256 of `body` in hex: the header X-Weft-Signature.
std::string SignatureOf(const std::string& secret, const std::string& body);

// Posts the file `path` as JSON. Certificates are checked, redirects are not followed. Unavailable: no
// answer, or another one than 2xx; trying again may help, as a server or its certificate may be mended.
// Errors of CheckNoticeServer besides. Cancelled: `stop` was requested. Thread safety: any thread.
absl::Status PostNotice(const NoticeServer& server, const std::string& path, const std::stop_token& stop);

}  // namespace weft
