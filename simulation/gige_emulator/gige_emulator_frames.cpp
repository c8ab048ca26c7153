// When the camera takes frames, what is in them, and how they leave it.
#include <arpa/inet.h>
#include <sys/socket.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "simulation/gige_emulator/gige_emulator.h"
#include "simulation/gige_emulator/gige_emulator_registers.h"

namespace weft {
namespace {

constexpr size_t kFramesToResend = 32;

}  // namespace

std::optional<int64_t> GigeEmulator::NextExposure(int64_t now_ns) {
  if (Register(kAcquisition) == 0) return std::nullopt;
  const MutexLock lock(mutex_);
  if (Register(kTriggerMode) == 1) {
    std::optional<int64_t> next_ns;
    for (const Trigger& trigger : triggers_)
      if (trigger.source == Register(kTriggerSource))
        next_ns = std::min(trigger.host_time_ns, next_ns.value_or(trigger.host_time_ns));
    return next_ns;
  }
  const double period_ns = 1e9 / FloatRegister(kFrameRate);
  if (last_exposure_ns_ == 0) last_exposure_ns_ = now_ns;
  const double phase_ns = clock_.phase_ns;
  const double count = std::floor((static_cast<double>(last_exposure_ns_) - phase_ns) / period_ns + 0.5) + 1;
  return std::llround(count * period_ns + phase_ns);
}

void GigeEmulator::Expose(int64_t host_time_ns) {
  last_exposure_ns_ = host_time_ns;
  {
    const MutexLock lock(mutex_);
    std::erase_if(triggers_, [&](const Trigger& trigger) { return trigger.host_time_ns <= host_time_ns; });
  }
  Frame frame;
  frame.id = static_cast<uint16_t>(frames_ % 65535 + 1);
  frame.device_time_ns = DeviceTime_ns(host_time_ns);
  frame.payload = Image(host_time_ns, frame.device_time_ns);
  ++frames_;
  SendPackets(frame, 0, UINT32_MAX);
  sent_.push_back(std::move(frame));
  if (sent_.size() > kFramesToResend) sent_.pop_front();
}

// Cameras of one rate show the same picture at the same time.
const std::vector<uint8_t>* GigeEmulator::PictureAt(int64_t host_time_ns) const {
  const size_t count = pictures_.images.size();
  if (count == 0 || Register(kChunkMode) == 1 || ImageBytes() != pictures_.images[0].size()) return nullptr;
  const double frames = static_cast<double>(host_time_ns) * FloatRegister(kFrameRate) / 1e9;
  return &pictures_.images[static_cast<size_t>(std::llround(frames)) % count];
}

std::vector<uint8_t> GigeEmulator::Image(int64_t host_time_ns, int64_t device_time_ns) const {
  if (const std::vector<uint8_t>* picture = PictureAt(host_time_ns)) return *picture;
  std::vector<uint8_t> bytes(ImageBytes());
  const std::array<int64_t, 4> numbers = {host_time_ns, static_cast<int64_t>(frames_), device_time_ns,
                                          ntohl(address_)};
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<uint8_t>((i * 31 + frames_ * 7) >> 3);
  std::memcpy(bytes.data(), numbers.data(), std::min(bytes.size(), sizeof numbers));
  if (Register(kChunkMode) == 1) {
    const auto image_bytes = static_cast<uint32_t>(bytes.size());
    Put(bytes, kImageChunk);
    Put(bytes, image_bytes);
    Put(bytes, device_time_ns);
    Put(bytes, kTimestampChunk);
    Put(bytes, uint32_t{8});
  }
  return bytes;
}

void GigeEmulator::SendPackets(const Frame& frame, uint32_t first, uint32_t last) {
  const size_t step = PacketBytes();
  const auto data_packets = static_cast<uint32_t>((frame.payload.size() + step - 1) / step);
  const auto payload_type = static_cast<uint16_t>(Register(kChunkMode) == 1 ? 0x4001 : 0x0001);
  for (uint32_t id = first; id <= std::min(last, data_packets + 1); ++id) {
    std::vector<uint8_t> packet;
    Put(packet, uint16_t{0});
    Put(packet, frame.id);
    const uint32_t content = id == 0 ? 1 : id == data_packets + 1 ? 2 : 3;
    Put(packet, content << 24 | id);
    if (content == 1) {
      Put(packet, uint16_t{0});
      Put(packet, payload_type);
      Put(packet, frame.device_time_ns);
      for (const uint32_t value : {Register(kPixelFormat), Register(kWidth), Register(kHeight), 0u, 0u, 0u})
        Put(packet, value);
    } else if (content == 2) {
      Put(packet, uint32_t{payload_type});
      Put(packet, Register(kHeight));
    } else {
      const auto begin = frame.payload.begin() + static_cast<ptrdiff_t>((id - 1) * step);
      const auto size = std::min<size_t>(step, static_cast<size_t>(frame.payload.end() - begin));
      packet.insert(packet.end(), begin, begin + static_cast<ptrdiff_t>(size));
    }
    Send(packet);
  }
}

void GigeEmulator::Send(const std::vector<uint8_t>& packet) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(Register(kStreamAddress));
  to.sin_port = htons(static_cast<uint16_t>(Register(kStreamPort)));
  // What the network does not take is lost, as with a camera.
  static_cast<void>(
      sendto(stream_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to));
}

void GigeEmulator::Resend(const uint8_t* data, size_t size) {
  if (size < 12 || (Register(kCapability) & kCanResend) == 0) return;
  const auto id = Get<uint16_t>(data + 2);
  for (const Frame& frame : sent_)
    if (frame.id == id)
      SendPackets(frame, Get<uint32_t>(data + 4) & 0xffffff, Get<uint32_t>(data + 8) & 0xffffff);
}

void GigeEmulator::SendTestPacket() { Send(std::vector<uint8_t>((Register(kPacketSize) & 0xffff) - 28)); }

size_t GigeEmulator::ImageBytes() const {
  return size_t{Register(kWidth)} * Register(kHeight) * (Register(kPixelFormat) >> 16 & 0xff) / 8;
}

uint32_t GigeEmulator::PacketBytes() const {
  return (Register(kPacketSize) & 0xffff) - 36;
}  // without IP, UDP and GVSP

}  // namespace weft
