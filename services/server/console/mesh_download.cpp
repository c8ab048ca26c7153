#include "services/server/console/mesh_download.h"

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "services/formats/files/frame_meshes.h"
#include "services/server/console/error_reply.h"
#include "services/server/console/json_messages.h"
#include "services/server/console/quantized_mesh.h"
#include "services/server/rpc/service_files.h"
#include "weft/v1/jobs.pb.h"
#include "weft/v1/transfer.pb.h"

namespace weft {
namespace {

namespace asio = boost::asio;

constexpr int64_t kMostHeld_bytes = 512 << 20;
constexpr std::chrono::minutes kSendTimeout{5};  // with the bytes of a mesh

// Bytes that count as held while this lives.
class Held {
 public:
  explicit Held(std::atomic<int64_t>& all) : all_(all) {}
  ~Held() { all_ -= bytes_; }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;

  // False: that is too much.
  bool Take(int64_t bytes) {
    bytes_ += bytes;
    return (all_ += bytes) <= kMostHeld_bytes;
  }

 private:
  std::atomic<int64_t>& all_;
  int64_t bytes_ = 0;
};

// What the coroutines of one download share.
struct Mesh {
  Mesh(std::atomic<int64_t>& all, bool its_faces, std::string its_name)
      : held(all), with_faces(its_faces), name(std::move(its_name)) {}

  Held held;
  const bool with_faces;
  const std::string name;  // for messages
  std::string ply;
  absl::StatusOr<std::string> quantized = absl::InternalError("not encoded");
};

absl::Status Unreadable(const absl::Status& status) {
  return absl::DataLossError(
      absl::StrCat(std::string(status.message()), "; register the frame again to replace its mesh"));
}

// As much of the file as is asked for: without faces it may end with the vertices.
asio::awaitable<absl::Status> Read(DaemonCalls::Call& call, Mesh& mesh) {
  std::optional<size_t> wanted;
  std::string bytes;
  v1::FileChunk chunk;
  while (!wanted || mesh.ply.size() < *wanted) {
    const bool is_there = co_await call.Read(bytes);
    if (!is_there || !chunk.ParseFromString(bytes)) break;
    mesh.ply += chunk.data();
    if (wanted) continue;
    if (mesh.with_faces) {
      wanted = static_cast<size_t>(chunk.file_bytes());
    } else {
      const absl::StatusOr<std::optional<size_t>> end = EndOfVertices(mesh.ply, mesh.name);
      if (!end.ok()) co_return Unreadable(end.status());
      wanted = *end;
    }
    if (wanted && !mesh.held.Take(static_cast<int64_t>(*wanted)))
      co_return absl::ResourceExhaustedError("the daemon is sending other meshes; ask again in a second");
  }
  absl::Status status = co_await call.Finish();
  // Whoever has enough hangs up.
  if (wanted && mesh.ply.size() >= *wanted) status = absl::OkStatus();
  if (status.ok() && !wanted) status = absl::DataLossError(absl::StrCat(mesh.name, ": it is cut off"));
  co_return status;
}

asio::awaitable<void> Encode(std::shared_ptr<Mesh> mesh) {
  mesh->quantized = QuantizedMesh(mesh->ply, mesh->with_faces, mesh->name);
  if (!mesh->quantized.ok()) mesh->quantized = Unreadable(mesh->quantized.status());
  co_return;
}

// Of the query; empty where it has none.
std::string ValueOf(const std::vector<std::pair<std::string, std::string>>& query, std::string_view name) {
  const auto found =
      std::ranges::find(query, name, [](const auto& one) { return std::string_view(one.first); });
  return found == query.end() ? "" : found->second;
}

absl::StatusOr<std::string> RequestOf(const std::string& job_and_frame, const std::string& mesh) {
  const size_t slash = job_and_frame.find('/');
  if (slash == std::string::npos || job_and_frame.find('/', slash + 1) != std::string::npos)
    return absl::NotFoundError("a mesh is at /mesh/JOB/FRAME");
  v1::FetchResultRequest request;
  request.set_job_id(job_and_frame.substr(0, slash));
  request.set_frame(job_and_frame.substr(slash + 1));
  request.set_kind(v1::RESULT_KIND_MESH);
  request.set_mesh(mesh);
  return request.SerializeAsString();
}

}  // namespace

void MeshDownloads::Stop() {
  encoder_.stop();
  encoder_.join();
}

asio::awaitable<void> MeshDownloads::Send(HttpExchange& exchange, std::string job_and_frame, CallFor caller,
                                          DaemonCalls& calls) {
  const auto& query = exchange.target.query;
  const std::string name = ValueOf(query, "mesh");
  const auto mesh = std::make_shared<Mesh>(
      held_bytes_, ValueOf(query, "faces") == "1",
      absl::StrCat(MeshFileName(name.empty() ? kGarmentMesh : name), " of ", job_and_frame));
  const absl::StatusOr<std::string> request = RequestOf(job_and_frame, name);
  const std::string path = PathOf(*FindMethod("Jobs/FetchResult"));
  const absl::StatusOr<std::shared_ptr<DaemonCalls::Call>> call =
      calls.Begin(caller, path, request, kSendTimeout);
  absl::Status status = call.status();
  if (status.ok()) status = co_await Read(**call, *mesh);
  if (status.ok()) {
    co_await asio::co_spawn(encoder_, Encode(mesh), asio::use_awaitable);
    status = mesh->quantized.status();
  }
  HttpReply reply = ErrorReply(status);
  if (status.ok()) {
    reply = {};
    reply.type = "application/octet-stream";
    reply.body = *std::move(mesh->quantized);
  }
  co_await exchange.Send(std::move(reply));
}

}  // namespace weft
