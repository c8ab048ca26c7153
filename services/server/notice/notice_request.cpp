#include "services/server/notice/notice_request.h"

#include <curl/curl.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <sys/stat.h>

#include <algorithm>
#include <memory>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/loopback.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"

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

constexpr char kRedacted[] = "[redacted]";

// What lies between the scheme and the path, as it is written. The library would take 0x7f000001 for
// 127.0.0.1.
std::string AuthorityOf(const std::string& url) {
  const size_t scheme = url.find("://");
  const size_t begin = scheme == std::string::npos ? 0 : scheme + 3;
  return url.substr(begin, std::min(url.find_first_of("/?#", begin), url.size()) - begin);
}

// Without its port.
std::string HostOf(const std::string& authority) {
  const size_t bracket = authority.find(']');
  return authority.substr(0, authority.find(':', bracket == std::string::npos ? 0 : bracket));
}

bool IsToThisMachine(const std::string& url) {
  return IsLoopbackHost(absl::AsciiStrToLower(HostOf(AuthorityOf(url))));
}

// Whether every character may stand in a URL (RFC 3986).
bool IsPlain(const std::string& text) {
  return std::ranges::all_of(text, [](unsigned char c) { return c > ' ' && c < 0x7f; }) &&
         text.find_first_of("\\\"<>^`{|}") == std::string::npos;
}

// What a server answers may hold parts of what it was asked.
std::string WithoutPathOf(const std::string& url, const std::string& text) {
  constexpr size_t kLeastSecret = 6;
  const size_t scheme = url.find("://");
  const size_t path = url.find_first_of("/?#", scheme == std::string::npos ? 0 : scheme + 3);
  const std::string secret = path == std::string::npos ? "" : url.substr(path + 1);
  std::string shown;
  for (size_t at = 0; at < text.size();) {
    size_t same = 0;  // characters from here on that stand in the secret as well
    while (at + same < text.size() && secret.find(text.substr(at, same + 1)) != std::string::npos) ++same;
    shown += same >= kLeastSecret ? kRedacted : text.substr(at, 1);
    at += same >= kLeastSecret ? same : 1;
  }
  return shown;
}

absl::Status CheckUrl(const std::string& text) {
  const std::unique_ptr<CURLU, void (*)(CURLU*)> url(curl_url(), curl_url_cleanup);
  if (!IsPlain(text) || curl_url_set(url.get(), CURLUPART_URL, text.c_str(), 0) != CURLUE_OK)
    return BadOption("--on-end-url", absl::StrCat("\"", ShownUrl(text), "\" is no URL"),
                     "for example https://studio.example/weft");
  const std::string scheme = PartOfUrl(url.get(), CURLUPART_SCHEME);
  // The user's name may be a secret, too.
  if (absl::StrContains(AuthorityOf(text), '@'))
    return BadOption("--on-end-url", "has a user's name", "show who asks by --on-end-secret");
  // Read by two, so that both mean the same host.
  const bool is_here =
      IsToThisMachine(text) && IsLoopbackHost(absl::AsciiStrToLower(PartOfUrl(url.get(), CURLUPART_HOST)));
  if (scheme == "https" || (scheme == "http" && is_here)) return absl::OkStatus();
  return BadOption("--on-end-url",
                   absl::StrCat("\"", ShownUrl(text), "\" would send notices for everybody to read"),
                   "use https; http is for servers of this machine: localhost, 127.0.0.1 or [::1]");
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
  // A proxy of the environment would carry off what is for this machine.
  if (IsToThisMachine(server.url)) curl_easy_setopt(request, CURLOPT_NOPROXY, "*");
  curl_easy_setopt(request, CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
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
  WEFT_RETURN_IF_ERROR(CheckUrl(server.url));
  if (!server.authority.empty()) {
    const absl::StatusOr<std::string> text = ReadWholeFile(server.authority, uint64_t{1} << 20);
    if (!text.ok()) return BadOption("--on-end-ca", std::string(text.status().message()), "name a PEM file");
  }
  return ReadSecret(server.secret_file).status();
}

std::string ShownUrl(const std::string& url) {
  const size_t scheme = url.find("://");
  if (scheme == std::string::npos) return kRedacted;
  std::string authority = AuthorityOf(url);
  const std::string rest = url.substr(scheme + 3 + authority.size());
  if (const size_t user = authority.rfind('@'); user != std::string::npos)
    authority = absl::StrCat(kRedacted, authority.substr(user));
  return absl::StrCat(url.substr(0, scheme + 3), authority,
                      rest.size() > 1 ? absl::StrCat("/", kRedacted) : rest);
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
  WEFT_RETURN_IF_ERROR(CheckUrl(server.url));
  WEFT_ASSIGN_OR_RETURN(const std::string body, ReadWholeFile(path));
  const absl::StatusOr<std::string> secret = ReadSecret(server.secret_file);
  if (!secret.ok()) return absl::UnavailableError(secret.status().message());  // may be mended
  const Request request(curl_easy_init(), curl_easy_cleanup);
  Headers headers(nullptr, curl_slist_free_all);
  AddHeader(headers, "Content-Type: application/json");
  AddHeader(headers, "User-Agent: weftd/" WEFT_VERSION);
  AddHeader(headers, "Expect:");
  if (!secret->empty()) AddHeader(headers, "X-Weft-Signature: " + SignatureOf(*secret, body));
  SetUpRequest(request.get(), server);
  std::string answer;
  char problem[CURL_ERROR_SIZE] = "";
  curl_easy_setopt(request.get(), CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(request.get(), CURLOPT_POSTFIELDS, body.data());
  curl_easy_setopt(request.get(), CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body.size()));
  curl_easy_setopt(request.get(), CURLOPT_WRITEDATA, &answer);
  curl_easy_setopt(request.get(), CURLOPT_XFERINFODATA, &stop);
  curl_easy_setopt(request.get(), CURLOPT_ERRORBUFFER, problem);
  const CURLcode code = curl_easy_perform(request.get());
  if (stop.stop_requested()) return absl::CancelledError("the daemon stops");
  if (code != CURLE_OK) {
    return absl::UnavailableError(
        absl::StrCat(ShownUrl(server.url), ": ",
                     WithoutPathOf(server.url, problem[0] != '\0' ? problem : curl_easy_strerror(code))));
  }
  long status = 0;
  curl_easy_getinfo(request.get(), CURLINFO_RESPONSE_CODE, &status);
  if (status >= 200 && status < 300) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(ShownUrl(server.url), ": answers ", status,
                                             status / 100 == 3 ? ", and redirects are not followed" : "",
                                             answer.empty() ? "" : ": ", WithoutPathOf(server.url, answer)));
}

}  // namespace weft
