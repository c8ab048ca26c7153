// Where the frames of a GigE Vision camera arrive.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "capture/image/aligned_buffer.h"

struct _ArvBuffer;
struct _ArvCamera;
struct _ArvStream;

namespace weft {

struct GigeStreamOptions {
  bool resend = true;      // ask for lost packets
  int retention_ms = 200;  // how long a frame waits for its packets
  int buffers = 16;        // frames that Aravis may fill before anybody takes them
};

struct GigeStreamCounters {
  uint64_t packets_received = 0;
  uint64_t packets_resent = 0;
  uint64_t packets_missing = 0;
};

// An open stream of Aravis with buffers of ours. Thread safety: none.
class GigeStream {
 public:
  // `error`: why there is none, in Aravis's words.
  static std::unique_ptr<GigeStream> Open(_ArvCamera* camera, const GigeStreamOptions& options,
                                          std::string& error);
  ~GigeStream();
  GigeStream(const GigeStream&) = delete;
  GigeStream& operator=(const GigeStream&) = delete;

  struct ReleaseBuffer {
    void operator()(_ArvBuffer* buffer) const;
  };
  using Buffer = std::unique_ptr<_ArvBuffer, ReleaseBuffer>;

  // The next frame, whole or not; null where none came within the time.
  Buffer Pop(std::chrono::milliseconds timeout);
  GigeStreamCounters counters() const;

 private:
  GigeStream(_ArvStream* stream, size_t frame_bytes, const GigeStreamOptions& options);

  _ArvStream* stream_;
  BufferPool pool_;
};

// The bytes of a buffer that Pop returned, which may outlive it.
std::shared_ptr<AlignedBuffer> MemoryOf(const _ArvBuffer* buffer);

// Why a buffer holds no whole frame. `status`: of Aravis.
std::string LossCause(int status, uint64_t missing_packets, bool can_resend, bool resend);

}  // namespace weft
