#include "capture/camera/gige_stream.h"

#include <arv.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/camera/glib_error.h"

namespace weft {
namespace {

constexpr guint kPacketTimeout_us = 20'000;
constexpr uint64_t kFramesInSocket = 4, kMaxSocketBuffer_bytes = uint64_t{256} << 20;

// A buffer of Aravis around memory of ours, which the frame takes along.
ArvBuffer* WrapBuffer(std::shared_ptr<AlignedBuffer> memory) {
  auto* holder = new std::shared_ptr<AlignedBuffer>(std::move(memory));
  return arv_buffer_new_full((*holder)->size(), (*holder)->data(), holder,
                             [](void* data) { delete static_cast<std::shared_ptr<AlignedBuffer>*>(data); });
}

const char* LossInWords(int status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT:
      return "packets of the frame did not arrive in time";
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets of the frame are missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "packets of the frame have wrong numbers";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "the frame is larger than the camera announced";
    case ARV_BUFFER_STATUS_ABORTED:
      return "the frame was broken off";
    default:
      return "the frame did not arrive";
  }
}

}  // namespace

std::unique_ptr<GigeStream> GigeStream::Open(_ArvCamera* camera, const GigeStreamOptions& options,
                                             std::string& error) {
  GlibError payload_error;
  const guint payload = arv_camera_get_payload(camera, payload_error.out());
  if (!payload_error.ok()) {
    error = payload_error.message();
    return nullptr;
  }
  GlibError stream_error;
  ArvStream* stream = arv_camera_create_stream(camera, nullptr, nullptr, stream_error.out());
  if (stream == nullptr) {
    error = stream_error.ok() ? "no stream" : stream_error.message();
    return nullptr;
  }
  // Aravis would ask for a quarter of a frame's packets at most; a receiver that was kept from its socket for
  // a while lacks whole frames.
  const guint retention_us = static_cast<guint>(1000 * options.retention_ms);
  g_object_set(
      stream, "packet-resend",
      options.resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
      "packet-request-ratio", 2.0, "frame-retention", retention_us, "packet-timeout",
      std::max(kPacketTimeout_us, retention_us / 20), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
      "socket-buffer-size",
      static_cast<gint>(std::min<uint64_t>(kMaxSocketBuffer_bytes, kFramesInSocket * uint64_t{payload})),
      nullptr);
  return std::unique_ptr<GigeStream>(new GigeStream(stream, payload, options));
}

GigeStream::GigeStream(_ArvStream* stream, size_t frame_bytes, const GigeStreamOptions& options)
    : stream_(stream), pool_(frame_bytes, static_cast<size_t>(4 * options.buffers)) {
  for (int i = 0; i < options.buffers; ++i) arv_stream_push_buffer(stream_, WrapBuffer(pool_.Take()));
}

GigeStream::~GigeStream() { g_object_unref(stream_); }

void GigeStream::ReleaseBuffer::operator()(_ArvBuffer* buffer) const { g_object_unref(buffer); }

GigeStream::Buffer GigeStream::Pop(std::chrono::milliseconds timeout) {
  Buffer buffer(arv_stream_timeout_pop_buffer(
      stream_, static_cast<guint64>(std::chrono::duration_cast<std::chrono::microseconds>(timeout).count())));
  if (buffer) arv_stream_push_buffer(stream_, WrapBuffer(pool_.Take()));
  return buffer;
}

GigeStreamCounters GigeStream::counters() const {
  const auto counter = [this](const char* name) { return arv_stream_get_info_uint64_by_name(stream_, name); };
  return {counter("n_received_packets"), counter("n_resent_packets"), counter("n_missing_packets")};
}

std::shared_ptr<AlignedBuffer> MemoryOf(const _ArvBuffer* buffer) {
  return *static_cast<const std::shared_ptr<AlignedBuffer>*>(
      arv_buffer_get_user_data(const_cast<_ArvBuffer*>(buffer)));
}

std::string LossCause(int status, uint64_t missing_packets, bool can_resend, bool resend) {
  std::string cause = LossInWords(status);
  if (missing_packets == 0) return cause;
  const char* asked = !can_resend ? "the camera cannot resend them"
                      : resend    ? "asked for again in vain"
                                  : "resend is off";
  absl::StrAppend(&cause, ": ", missing_packets, missing_packets == 1 ? " packet, " : " packets, ", asked);
  return cause;
}

}  // namespace weft
