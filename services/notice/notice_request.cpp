#include "services/notice/notice_request.h"

#include <curl/curl.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <sys/stat.h>

#include <cctype>
#include <memory>
#include <string_view>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/files/atomic_file.h"

namespace weft {
namespace {

constexpr uint64_t kMaxSecretBytes = 4096;
constexpr size_t kLeastSecretBytes = 16;

// Once per process, and before the first request.
void BeginCurl() { [[maybe_unused]] static const CURLcode begun = curl_global_init(CURL_GLOBAL_DEFAULT); }

absl::Status BadOption(const char* option, const std::string& what, const std::string& remedy) {
  return absl::InvalidArgumentError(absl::StrCat(option, ": ", what, "; ", remedy));
}

std::string PartOfUrl(CURLU* url, CURLUPart part) {
  char* text = nullptr;
  if (curl_url_get(url, part, &text, 0) != CURLUE_OK) return "";
  std::string copy = text;
  curl_free(text);
  return copy;
}

absl::Status CheckUrl(const std::string& text) {
  const std::unique_ptr<CURLU, void (*)(CURLU*)> url(curl_url(), curl_url_cleanup);
  if (curl_url_set(url.get(), CURLUPART_URL, text.c_str(), 0) != CURLUE_OK)
    return BadOption("--on-end-url", absl::StrCat("\"", text, "\" is no URL"),
                     "for example https://studio.example/weft");
  const std::string scheme = PartOfUrl(url.get(), CURLUPART_SCHEME);
  const std::string host = PartOfUrl(url.get(), CURLUPART_HOST);
  const bool is_here = host == "localhost" || host == "[::1]" || absl::StartsWith(host, "127.");
  if (!PartOfUrl(url.get(), CURLUPART_USER).empty())
    return BadOption("--on-end-url", "has a user's name", "show who asks by --on-end-secret");
  if (scheme == "https" || (scheme == "http" && is_here)) return absl::OkStatus();
  return BadOption("--on-end-url", absl::StrCat("\"", text, "\" would send notices for everybody to read"),
                   "use https; http is for servers of this machine");
}

// Without the line end of an editor.
absl::StatusOr<std::string> ReadSecret(const std::string& path) {
  if (path.empty()) return "";
  absl::StatusOr<std::string> text = ReadWholeFile(path, kMaxSecretBytes);
  if (!text.ok()) return BadOption("--on-end-secret", std::string(text.status().message()), "name a file");
  struct stat file = {};
  if (stat(path.c_str(), &file) == 0 && (file.st_mode & 077) != 0) {
    return absl::PermissionDeniedError(absl::StrCat(
        "--on-end-secret: ", path, ": other users may read it; close it by `chmod go-rwx ", path, "`"));
  }
  std::string secret(absl::StripAsciiWhitespace(*text));
  if (secret.size() >= kLeastSecretBytes) return secret;
  return BadOption("--on-end-secret", absl::StrCat(path, " has less than ", kLeastSecretBytes, " characters"),
                   "`openssl rand -hex 32` makes one");
}

size_t KeepAnswer(char* bytes, size_t size, size_t count, void* answer) {
  constexpr size_t kShownAnswer = 200;
  auto& text = *static_cast<std::string*>(answer);
  if (text.size() < kShownAnswer) text.append(bytes, std::min(size * count, kShownAnswer - text.size()));
  return size * count;
}

int IsStopped(void* stop, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<const std::stop_token*>(stop)->stop_requested() ? 1 : 0;
}

using Request = std::unique_ptr<CURL, void (*)(CURL*)>;
using Headers = std::unique_ptr<curl_slist, void (*)(curl_slist*)>;

void AddHeader(Headers& headers, const std::string& line) {
  headers.reset(curl_slist_append(headers.release(), line.c_str()));
}

void SetUpRequest(CURL* request, const NoticeServer& server) {
  curl_easy_setopt(request, CURLOPT_URL, server.url.c_str());
  curl_easy_setopt(request, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(request, CURLOPT_FOLLOWLOCATION, 0L);
  curl_easy_setopt(request, CURLOPT_SSL_VERIFYPEER, 1L);
  curl_easy_setopt(request, CURLOPT_SSL_VERIFYHOST, 2L);
  if (!server.authority.empty()) curl_easy_setopt(request, CURLOPT_CAINFO, server.authority.c_str());
  curl_easy_setopt(request, CURLOPT_TIMEOUT_MS, static_cast<long>(server.patience.count()));
  curl_easy_setopt(request, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(request, CURLOPT_WRITEFUNCTION, KeepAnswer);
  curl_easy_setopt(request, CURLOPT_XFERINFOFUNCTION, IsStopped);
  curl_easy_setopt(request, CURLOPT_NOPROGRESS, 0L);
}

}  // namespace

absl::Status CheckNoticeServer(const NoticeServer& server) {
  if (server.url.empty()) return absl::OkStatus();
  if (absl::Status status = CheckUrl(server.url); !status.ok()) return status;
  if (!server.authority.empty()) {
    const absl::StatusOr<std::string> text = ReadWholeFile(server.authority, uint64_t{1} << 20);
    if (!text.ok()) return BadOption("--on-end-ca", std::string(text.status().message()), "name a PEM file");
  }
  return ReadSecret(server.secret_file).status();
}

std::string SignatureOf(const std::string& secret, const std::string& body) {
  unsigned char hash[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()),
       reinterpret_cast<const unsigned char*>(body.data()), body.size(), hash, &size);
  return "sha256=" + absl::BytesToHexString(absl::string_view(reinterpret_cast<const char*>(hash), size));
}

absl::Status PostNotice(const NoticeServer& server, const std::string& path, const std::stop_token& stop) {
  BeginCurl();
  if (absl::Status status = CheckUrl(server.url); !status.ok()) return status;
  const absl::StatusOr<std::string> body = ReadWholeFile(path);
  if (!body.ok()) return body.status();
  const absl::StatusOr<std::string> secret = ReadSecret(server.secret_file);
  if (!secret.ok()) return absl::UnavailableError(secret.status().message());  // may be mended
  const Request request(curl_easy_init(), curl_easy_cleanup);
  Headers headers(nullptr, curl_slist_free_all);
  AddHeader(headers, "Content-Type: application/json");
  AddHeader(headers, "User-Agent: weftd/" WEFT_VERSION);
  AddHeader(headers, "Expect:");
  if (!secret->empty()) AddHeader(headers, "X-Weft-Signature: " + SignatureOf(*secret, *body));
  SetUpRequest(request.get(), server);
  std::string answer;
  char problem[CURL_ERROR_SIZE] = "";
  curl_easy_setopt(request.get(), CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(request.get(), CURLOPT_POSTFIELDS, body->data());
  curl_easy_setopt(request.get(), CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body->size()));
  curl_easy_setopt(request.get(), CURLOPT_WRITEDATA, &answer);
  curl_easy_setopt(request.get(), CURLOPT_XFERINFODATA, &stop);
  curl_easy_setopt(request.get(), CURLOPT_ERRORBUFFER, problem);
  const CURLcode code = curl_easy_perform(request.get());
  if (stop.stop_requested()) return absl::CancelledError("the daemon stops");
  if (code != CURLE_OK) {
    return absl::UnavailableError(
        absl::StrCat(server.url, ": ", problem[0] != '\0' ? problem : curl_easy_strerror(code)));
  }
  long status = 0;
  curl_easy_getinfo(request.get(), CURLINFO_RESPONSE_CODE, &status);
  if (status >= 200 && status < 300) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(server.url, ": answers ", status,
                                             status / 100 == 3 ? ", and redirects are not followed" : "",
                                             answer.empty() ? "" : ": ", answer));
}

}  // namespace weft
