#include "capture/camera/v4l2_stream.h"

#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "capture/camera/v4l2_ioctl.h"

namespace weft {
namespace {

absl::Status Broken(const char* what) {
  const std::string why = errno == ENODEV ? "the device is gone (unplugged, or without power)"
                          : errno == EIO  ? "the driver reports an error of the stream"
                                          : std::strerror(errno);
  return absl::UnavailableError(absl::StrCat(what, ": ", why));
}

v4l2_buffer Description(uint32_t index, V4l2Memory memory) {
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = memory == V4l2Memory::kMmap ? V4L2_MEMORY_MMAP : V4L2_MEMORY_USERPTR;
  return buffer;
}

uint64_t ContentBytes(const V4l2Image& image) {
  return RawBytes(image.format, image.width_px, image.height_px);
}

}  // namespace

V4l2Stream::V4l2Stream(int fd, const V4l2Image& image, V4l2Memory memory)
    : fd_(fd),
      image_(image),
      memory_(memory),
      filled_(image.buffer_bytes, 64),
      images_(std::max<uint64_t>(1, ContentBytes(image)), 64) {}

absl::StatusOr<std::unique_ptr<V4l2Stream>> V4l2Stream::Start(const V4l2Device& device,
                                                              const V4l2Image& image, V4l2Memory memory,
                                                              int buffers) {
  std::unique_ptr<V4l2Stream> stream(new V4l2Stream(device.fd(), image, memory));
  v4l2_requestbuffers request{};
  request.count = static_cast<uint32_t>(buffers);
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = Description(0, memory).memory;
  if (V4l2Ioctl(device.fd(), VIDIOC_REQBUFS, &request) != 0) {
    if (errno == EINVAL && memory == V4l2Memory::kUser)
      return absl::InvalidArgumentError("its driver takes no user buffers; leave out `user_buffers`");
    return Broken(errno == EBUSY ? "it is streaming for another program" : "it gives no buffers");
  }
  stream->buffers_.resize(request.count);
  if (memory == V4l2Memory::kMmap) WEFT_RETURN_IF_ERROR(stream->Map());
  for (uint32_t i = 0; i < request.count; ++i) {
    if (memory == V4l2Memory::kUser) stream->buffers_[i].own = stream->filled_.Take();
    WEFT_RETURN_IF_ERROR(stream->Queue(i));
  }
  v4l2_buffer first = Description(0, memory);
  if (V4l2Ioctl(device.fd(), VIDIOC_QUERYBUF, &first) == 0) {
    stream->has_times_ = (first.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    stream->has_exposure_times_ =
        stream->has_times_ && (first.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (V4l2Ioctl(device.fd(), VIDIOC_STREAMON, &type) != 0)
    return Broken(errno == ENOSPC ? "it does not start: its USB bus has no bandwidth left, use another port"
                                  : "it does not start");
  return stream;
}

absl::Status V4l2Stream::Map() {
  for (uint32_t i = 0; i < buffers_.size(); ++i) {
    v4l2_buffer description = Description(i, memory_);
    if (V4l2Ioctl(fd_, VIDIOC_QUERYBUF, &description) != 0) return Broken("its buffers cannot be asked for");
    void* mapped =
        mmap(nullptr, description.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, description.m.offset);
    if (mapped == MAP_FAILED) return Broken("its buffers cannot be mapped");
    buffers_[i].mapped = static_cast<uint8_t*>(mapped);
    buffers_[i].mapped_bytes = description.length;
  }
  return absl::OkStatus();
}

V4l2Stream::~V4l2Stream() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  V4l2Ioctl(fd_, VIDIOC_STREAMOFF, &type);
  for (const Buffer& buffer : buffers_)
    if (buffer.mapped != nullptr) munmap(buffer.mapped, buffer.mapped_bytes);
  v4l2_requestbuffers none{};
  none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  none.memory = Description(0, memory_).memory;
  V4l2Ioctl(fd_, VIDIOC_REQBUFS, &none);
}

absl::Status V4l2Stream::Queue(uint32_t index) {
  v4l2_buffer buffer = Description(index, memory_);
  if (memory_ == V4l2Memory::kUser) {
    buffer.m.userptr = reinterpret_cast<unsigned long>(buffers_[index].own->data());
    buffer.length = static_cast<uint32_t>(buffers_[index].own->size());
  }
  if (V4l2Ioctl(fd_, VIDIOC_QBUF, &buffer) != 0) return Broken("it takes no buffer");
  return absl::OkStatus();
}

std::string V4l2Stream::FaultOf(uint32_t flags, uint64_t used, const uint8_t* data) const {
  if ((flags & V4L2_BUF_FLAG_ERROR) != 0) return "torn: the driver marks the image as damaged";
  if (image_.format == RawFormat::kMotionJpeg)
    return WholeJpegBytes(data, used) > 0 ? "" : "torn: the JPEG has no beginning or no end";
  const uint64_t line_bytes = ContentBytes(image_) / static_cast<uint64_t>(image_.height_px);
  const uint64_t expected =
      std::max(image_.line_bytes, line_bytes) * static_cast<uint64_t>(image_.height_px - 1) + line_bytes;
  if (used >= expected) return "";
  return absl::StrCat("torn: ", used, " of ", expected, " bytes arrived");
}

std::shared_ptr<AlignedBuffer> V4l2Stream::Content(Buffer& buffer, uint64_t used) {
  const uint8_t* data = buffer.own ? buffer.own->data() : buffer.mapped;
  if (image_.format == RawFormat::kMotionJpeg) {
    const uint64_t size = WholeJpegBytes(data, used);
    auto jpeg = std::make_shared<AlignedBuffer>(size);
    std::memcpy(jpeg->data(), data, size);
    return jpeg;
  }
  const uint64_t bytes = ContentBytes(image_);
  if (buffer.own && buffer.own->size() == bytes) return std::exchange(buffer.own, filled_.Take());
  const uint64_t line_bytes = bytes / static_cast<uint64_t>(image_.height_px);
  std::shared_ptr<AlignedBuffer> image = images_.Take();
  CopyLines(data, std::max(image_.line_bytes, line_bytes), image_.height_px, line_bytes, image->data());
  return image;
}

absl::StatusOr<V4l2Filled> V4l2Stream::Next() {
  if (!queueing_.ok()) return queueing_;
  v4l2_buffer buffer = Description(0, memory_);
  if (V4l2Ioctl(fd_, VIDIOC_DQBUF, &buffer) != 0) {
    if (errno == EAGAIN) return absl::DeadlineExceededError("no frame");
    return Broken("it gives no frame");
  }
  V4l2Filled filled;
  filled.sequence = buffer.sequence;
  // No frame was taken after it arrived, though some drivers date them ahead.
  filled.monotonic_ns = MonotonicTime_ns();
  if (has_times_)
    filled.monotonic_ns = std::min<int64_t>(
        filled.monotonic_ns, buffer.timestamp.tv_sec * 1'000'000'000 + buffer.timestamp.tv_usec * 1000);
  Buffer& at = buffers_[buffer.index];
  filled.fault = FaultOf(buffer.flags, buffer.bytesused, at.own ? at.own->data() : at.mapped);
  if (filled.fault.empty()) filled.bytes = Content(at, buffer.bytesused);
  queueing_ =
      Queue(buffer.index);  // this frame is whole, so the stream says at the next one that it is broken
  return filled;
}

uint64_t WholeJpegBytes(const uint8_t* data, uint64_t size) {
  while (size > 0 && data[size - 1] == 0) --size;
  const bool is_whole =
      size >= 4 && data[0] == 0xff && data[1] == 0xd8 && data[size - 2] == 0xff && data[size - 1] == 0xd9;
  return is_whole ? size : 0;
}

void CopyLines(const uint8_t* from, uint64_t from_line_bytes, int lines, uint64_t line_bytes, uint8_t* to) {
  for (int line = 0; line < lines; ++line)
    std::memcpy(to + static_cast<uint64_t>(line) * line_bytes,
                from + static_cast<uint64_t>(line) * from_line_bytes, line_bytes);
}

}  // namespace weft
