#include "services/server/console/file_download.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "services/formats/files/frame_meshes.h"
#include "services/server/console/error_reply.h"
#include "services/server/console/json_messages.h"
#include "services/server/console/page_files.h"
#include "services/server/rpc/service_files.h"
#include "weft/v1/transfer.pb.h"

namespace weft {
namespace {

namespace asio = boost::asio;

constexpr std::chrono::hours kFilePatience{6};  // with a file
// No access to the console's cookie, its API or anything else.
constexpr char kSandbox[] =
    "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; style-src "
    "'unsafe-inline'; img-src data: blob:; font-src data:; frame-ancestors 'self'";

using Query = std::vector<std::pair<std::string, std::string>>;

// What is left out of `query` has the value "".
std::string Take(Query& query, const std::string& name) {
  const auto found = std::ranges::find_if(query, [&](const auto& one) { return one.first == name; });
  if (found == query.end()) return "";
  std::string value = std::move(found->second);
  query.erase(found);
  return value;
}

// Of the file, or what its kind of result is called.
std::string NameOf(const Query& query) {
  for (const auto& [name, value] : query)
    if (name == "mesh" && CheckMeshName(value).ok()) return MeshFileName(value);
  for (const auto& [name, value] : query) {
    if (name == "path") return value.substr(value.rfind('/') + 1);
    if (name != "kind") continue;
    if (value == "RESULT_KIND_JOB_REPORT") return "report.html";
    if (value == "RESULT_KIND_FRAME_REPORT" || value == "RESULT_KIND_JOB") return "report.json";
    if (value == "RESULT_KIND_OBSERVATIONS") return "observations.csv";
    if (value == "RESULT_KIND_MESH") return "mesh.ply";
    if (value == "RESULT_KIND_CLOUD") return "cloud.ply";
  }
  return "file";
}

// Letters that need no quoting in a header.
std::string PlainName(std::string name) {
  for (char& letter : name) {
    if (!absl::ascii_isalnum(static_cast<unsigned char>(letter)) && letter != '.' && letter != '-')
      letter = '_';
  }
  return name.substr(0, 100);
}

// Of an ETag; empty for what is none, or a weak one.
std::string Unquoted(const std::string& tag) {
  const bool is_quoted = tag.size() >= 2 && tag.front() == '"' && tag.back() == '"';
  return is_quoted ? tag.substr(1, tag.size() - 2) : "";
}

struct Piece {
  int64_t begin = 0, end = 0;  // bytes of the file
};

HttpReply HeadOf(const std::string& name, const std::string& save_as, bool is_part, const Piece& piece,
                 const v1::FileChunk& chunk) {
  HttpReply head;
  head.type = ContentType(name);
  head.status = is_part ? 206 : 200;
  head.headers.emplace_back("Accept-Ranges", "bytes");
  head.headers.emplace_back("ETag", absl::StrCat("\"", chunk.version(), "\""));
  head.headers.emplace_back("Content-Security-Policy", kSandbox);
  if (is_part) {
    head.headers.emplace_back(
        "Content-Range", absl::StrCat("bytes ", piece.begin, "-", piece.end - 1, "/", chunk.file_bytes()));
  }
  if (!save_as.empty() || head.type == "application/octet-stream") {
    head.headers.emplace_back(
        "Content-Disposition",
        absl::StrCat("attachment; filename=\"", PlainName(save_as.empty() ? name : save_as), "\""));
  }
  return head;
}

}  // namespace

asio::awaitable<void> SendFile(HttpExchange& exchange, std::string name, CallFor caller, DaemonCalls& calls) {
  const google::protobuf::MethodDescriptor* method = FindMethod(name);
  if (method == nullptr || !method->server_streaming() ||
      method->output_type() != v1::FileChunk::descriptor()) {
    co_await exchange.Send(ErrorReply(absl::UnimplementedError("there is no such method that sends a file")));
    co_return;
  }
  Query query = exchange.target.query;
  const std::string save_as = Take(query, "save_as");
  const std::string file_name = NameOf(query);
  std::optional<ByteRange> range = ParseRange(exchange.Header("Range"));
  const std::string version = Unquoted(exchange.Header("If-Range"));
  // Without it nobody knows whether the rest is of the same file; such a range may be ignored (RFC
  // 9110, 14.2).
  if (range && range->first > 0 && version.empty()) range.reset();
  if (range) query.emplace_back("offset", absl::StrCat(range->first));
  if (range && range->first > 0) query.emplace_back("version", version);
  const absl::StatusOr<std::string> request = RequestOfQuery(*method->input_type(), query);
  const absl::StatusOr<std::shared_ptr<DaemonCalls::Call>> call =
      calls.Begin(caller, PathOf(*method), request, kFilePatience);
  if (!call.ok()) {
    co_await exchange.Send(ErrorReply(call.status()));
    co_return;
  }
  std::string bytes;
  v1::FileChunk chunk;
  if (!co_await (*call)->Read(bytes) || !chunk.ParseFromString(bytes)) {
    absl::Status status = co_await (*call)->Finish();
    HttpReply reply = ErrorReply(status.ok() ? absl::InternalError("the file has no bytes") : status);
    if (range && absl::IsOutOfRange(status)) reply.status = 416;
    co_await exchange.Send(std::move(reply));
    co_return;
  }
  Piece piece{chunk.offset(), chunk.file_bytes()};
  // The last byte of a range may be any number, as long as it is one.
  if (range && range->last && *range->last < piece.end) piece.end = *range->last + 1;
  bool is_open = co_await exchange.SendHead(HeadOf(file_name, save_as, range.has_value(), piece, chunk),
                                            piece.end - piece.begin);
  for (int64_t at = piece.begin; is_open && at < piece.end && exchange.method != "HEAD";) {
    const std::string_view data(chunk.data());
    const size_t wanted = static_cast<size_t>(piece.end - at);
    is_open = co_await exchange.SendPart(data.substr(0, wanted));
    at += static_cast<int64_t>(data.size());
    if (!is_open || at >= piece.end) break;
    if (!co_await (*call)->Read(bytes) || !chunk.ParseFromString(bytes)) {
      exchange.Break();  // fewer bytes than the head says: the browser must notice
      break;
    }
  }
  co_await (*call)->Finish();
}

}  // namespace weft
