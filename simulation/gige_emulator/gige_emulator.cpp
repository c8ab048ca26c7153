#include "simulation/gige_emulator/gige_emulator.h"

#include <arpa/inet.h>
#include <arv.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "base/host_clock.h"
#include "simulation/gige_emulator/gige_emulator_features.h"
#include "simulation/gige_emulator/gige_emulator_registers.h"

namespace weft {
namespace {

constexpr uint16_t kControlPort = 3956;
constexpr int64_t kPtpLock_ns = 300'000'000;

[[noreturn]] void Die(const std::string& what) {
  std::fprintf(stderr, "%s: %s\n", what.c_str(), std::strerror(errno));
  std::exit(1);
}

int BoundSocket(in_addr_t address, uint16_t port) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = address;
  to.sin_port = htons(port);
  if (fd < 0 || bind(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0)
    Die("GigE emulator: no socket");
  return fd;
}

uint64_t PeerOf(const sockaddr_in& from) { return uint64_t{from.sin_addr.s_addr} << 16 | from.sin_port; }

}  // namespace

bool IsFreeForGigeEmulator(const std::string& address) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(kControlPort);
  if (inet_pton(AF_INET, address.c_str(), &to.sin_addr) != 1) return false;
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool is_free = fd >= 0 && bind(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  if (fd >= 0) close(fd);
  return is_free;
}

GigeEmulator::GigeEmulator(const std::string& serial, const std::string& address, GigeEmulatorImages pictures)
    : pictures_(std::move(pictures)) {
  // Aravis wants a file.
  const int features = memfd_create("gige_emulator.xml", MFD_CLOEXEC);
  const std::string_view xml = kGigeEmulatorFeatures;
  if (features < 0 || write(features, xml.data(), xml.size()) != static_cast<ssize_t>(xml.size()))
    Die("GigE emulator: no memory for its features");
  registers_ =
      arv_fake_camera_new_full(serial.c_str(), ("/proc/self/fd/" + std::to_string(features)).c_str());
  close(features);
  if (registers_ == nullptr) Die("GigE emulator: no registers");
  address_ = inet_addr(address.c_str());
  arv_fake_camera_write_memory(registers_, 0x24, 4, &address_);
  arv_fake_camera_write_memory(registers_, kVendor, 5, "Weft");
  arv_fake_camera_write_memory(registers_, kModel, 13, "GigeEmulator");
  SetResend(true);
  for (const auto& [where, value] : {std::pair<uint32_t, uint32_t>{kWidth, 512},
                                     {kHeight, 256},
                                     {kPixelFormat, 0x01080001},
                                     {kDeviceMode, 1u << 31},
                                     {kHeartbeat, 3000},
                                     {kPacketSize, 1400},
                                     {kActionSelector, 1},
                                     {kFrameRate, std::bit_cast<uint32_t>(10.0f)},
                                     {kExposure, std::bit_cast<uint32_t>(1000.0f)}})
    SetRegister(where, value);
  if (!pictures_.images.empty()) {
    SetRegister(kWidth, pictures_.width_px);
    SetRegister(kHeight, pictures_.height_px);
    SetRegister(kPixelFormat, pictures_.pixel_format);
    SetRegister(kFrameRate, std::bit_cast<uint32_t>(static_cast<float>(pictures_.fps)));
  }
  control_ = BoundSocket(address_, kControlPort);
  broadcast_ = BoundSocket(INADDR_BROADCAST, kControlPort);
  stream_ = BoundSocket(address_, 0);
  const int no_fragments = IP_PMTUDISC_DO;
  setsockopt(stream_, IPPROTO_IP, IP_MTU_DISCOVER, &no_fragments, sizeof no_fragments);
  sockaddr_in bound{};
  socklen_t length = sizeof bound;
  if (getsockname(stream_, reinterpret_cast<sockaddr*>(&bound), &length) != 0)
    Die("GigE emulator: no stream");
  SetRegister(kStreamSource, ntohs(bound.sin_port));
  wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  clock_.host_start_ns = HostTime_ns();
  thread_ = std::thread([this] { Run(); });
}

GigeEmulator::~GigeEmulator() {
  is_over_ = true;
  Wake();
  thread_.join();
  for (const int fd : {control_, broadcast_, stream_, wake_}) close(fd);
  g_object_unref(registers_);
}

void GigeEmulator::Wake() const {
  const uint64_t one = 1;
  if (write(wake_, &one, sizeof one) < 0) Die("GigE emulator: no wake-up");
}

void GigeEmulator::SetResend(bool resend) {
  SetRegister(kCapability, kCanWriteMemory | kCanAct | (resend ? kCanResend : 0));
}

void GigeEmulator::SetClock(const std::string& field, double value) {
  const MutexLock lock(mutex_);
  const std::map<std::string, double*> fields = {{"offset_ns", &clock_.offset_ns},
                                                 {"drift_ppm", &clock_.drift_ppm},
                                                 {"jump_ns", &clock_.jump_ns},
                                                 {"ptp_error_ns", &clock_.ptp_error_ns},
                                                 {"phase_ns", &clock_.phase_ns},
                                                 {"latch_error_ns", &clock_.latch_error_ns},
                                                 {"latch_is_zero", &clock_.latch_is_zero},
                                                 {"latch_is_stuck", &clock_.latch_is_stuck}};
  const auto found = fields.find(field);
  if (found == fields.end()) Die("GigE emulator: unknown field " + field);
  *found->second = value;
}

void GigeEmulator::AddTrigger(int64_t host_time_ns, uint32_t source) {
  const MutexLock lock(mutex_);
  triggers_.push_back({host_time_ns, source});
}

void GigeEmulator::PulseLine(int64_t host_time_ns) {
  AddTrigger(host_time_ns, kFromLine);
  Wake();
}

uint32_t GigeEmulator::Register(uint32_t address) const {
  uint32_t value = 0;
  arv_fake_camera_read_register(registers_, address, &value);
  return value;
}

void GigeEmulator::SetRegister(uint32_t address, uint32_t value) {
  arv_fake_camera_write_register(registers_, address, value);
}

float GigeEmulator::FloatRegister(uint32_t address) const { return std::bit_cast<float>(Register(address)); }

int64_t GigeEmulator::DeviceTime_ns(int64_t host_time_ns) const {
  const MutexLock lock(mutex_);
  const double own =
      clock_.offset_ns + 1e-6 * clock_.drift_ppm * static_cast<double>(host_time_ns - clock_.host_start_ns);
  return host_time_ns + std::llround((Register(kPtpEnable) ? clock_.ptp_error_ns : own) + clock_.jump_ns);
}

int64_t GigeEmulator::HostTimeOf_ns(int64_t device_time_ns) const {
  return device_time_ns - (DeviceTime_ns(device_time_ns) - device_time_ns);
}

void GigeEmulator::Run() {
  std::array<pollfd, 3> sockets = {pollfd{control_, POLLIN, 0}, {broadcast_, POLLIN, 0}, {wake_, POLLIN, 0}};
  std::array<uint8_t, 2048> data{};
  while (!is_over_) {
    const int64_t now_ns = HostTime_ns();
    if (controller_ && now_ns - controller_seen_ns_ > int64_t{Register(kHeartbeat)} * 1'000'000) {
      controller_.reset();
      SetRegister(kPrivilege, 0);
      SetRegister(kAcquisition, 0);
    }
    const std::optional<int64_t> next_ns = NextExposure(now_ns);
    if (next_ns && *next_ns <= now_ns) {
      Expose(*next_ns);
      continue;
    }
    const int64_t wait_ns = std::min<int64_t>(next_ns ? *next_ns - now_ns : 100'000'000, 100'000'000);
    const timespec timeout{wait_ns / 1'000'000'000, wait_ns % 1'000'000'000};
    if (ppoll(sockets.data(), sockets.size(), &timeout, nullptr) <= 0) continue;
    uint64_t count = 0;
    if (sockets[2].revents != 0 && read(wake_, &count, sizeof count) < 0) continue;
    for (size_t i = 0; i < 2; ++i) {
      sockaddr_in from{};
      socklen_t length = sizeof from;
      const ssize_t size =
          recvfrom(sockets[i].fd, data.data(), data.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
      if (size >= 8) HandleControl(data.data(), static_cast<size_t>(size), from, control_);
    }
  }
}

void GigeEmulator::Action(const uint8_t* data, size_t size, bool is_scheduled) {
  if (size < (is_scheduled ? 20u : 12u) || Register(kTriggerMode) != 1 ||
      Register(kTriggerSource) != kFromAction)
    return;
  if (Get<uint32_t>(data) != Register(kDeviceKey) || Get<uint32_t>(data + 4) != Register(kGroupKey)) return;
  if ((Get<uint32_t>(data + 8) & Register(kGroupMask)) == 0) return;
  AddTrigger(is_scheduled ? HostTimeOf_ns(Get<int64_t>(data + 12)) : HostTime_ns(), kFromAction);
}

void GigeEmulator::RefreshRegisters() {
  const int64_t now_ns = HostTime_ns();
  const bool ptp = Register(kPtpEnable) == 1;
  SetRegister(kPtpStatus, !ptp ? 0 : now_ns - ptp_since_ns_ < kPtpLock_ns ? 1 : 2);
  const int64_t offset_ns = ptp ? DeviceTime_ns(now_ns) - now_ns : 0;
  SetRegister(kPtpOffset, static_cast<uint32_t>(static_cast<uint64_t>(offset_ns) >> 32));
  SetRegister(kPtpOffset + 4, static_cast<uint32_t>(offset_ns));
  SetRegister(kPayload, static_cast<uint32_t>(ImageBytes() + (Register(kChunkMode) == 1 ? kChunkBytes : 0)));
}

void GigeEmulator::Latch(int64_t device_ns) {
  const MutexLock lock(mutex_);
  const bool is_stuck = clock_.latch_is_stuck != 0 && Register(kTimestampLow) != 0;
  if (is_stuck) return;
  const int64_t said_ns = clock_.latch_is_zero != 0 ? 0 : device_ns + std::llround(clock_.latch_error_ns);
  SetRegister(kTimestampHigh, static_cast<uint32_t>(static_cast<uint64_t>(said_ns) >> 32));
  SetRegister(kTimestampLow, static_cast<uint32_t>(said_ns));
}

void GigeEmulator::Written(uint32_t address, uint32_t value) {
  const int64_t now_ns = HostTime_ns();
  if (address == kTimestampControl && (value & 2) != 0) {
    Latch(DeviceTime_ns(now_ns));
  } else if (address == kPtpEnable) {
    ptp_since_ns_ = now_ns;
  } else if (address == kPacketSize && (value & kFireTestPacket) != 0) {
    SetRegister(kPacketSize, value & ~kFireTestPacket);
    SendTestPacket();
  } else if (address == kAcquisition) {
    frames_ = 0;
    last_exposure_ns_ = 0;
    const MutexLock lock(mutex_);
    triggers_.clear();
  } else if (address == kTriggerSoftware && Register(kTriggerMode) == 1 &&
             Register(kTriggerSource) == kFromSoftware) {
    AddTrigger(now_ns, kFromSoftware);
  }
}

std::vector<uint8_t> GigeEmulator::Answer(uint16_t command, const uint8_t* data, size_t size, uint8_t flags) {
  std::vector<uint8_t> answer;
  const uint32_t address = size >= 4 ? Get<uint32_t>(data) : 0;
  RefreshRegisters();
  if (command == kDiscovery) {
    answer.resize(0xf8);
    arv_fake_camera_read_memory(registers_, 0, 0xf8, answer.data());
  } else if (command == kReadRegister && size >= 4) {
    Put(answer, Register(address));
  } else if (command == kWriteRegister && size >= 8) {
    SetRegister(address, Get<uint32_t>(data + 4));
    Written(address, Get<uint32_t>(data + 4));
    Put(answer, uint32_t{1});
  } else if (command == kReadMemory && size >= 8) {
    Put(answer, address);
    const size_t bytes = Get<uint32_t>(data + 4) & 0xffff;
    answer.resize(4 + bytes);
    if (bytes > 0)
      arv_fake_camera_read_memory(registers_, address, static_cast<guint32>(bytes), answer.data() + 4);
  } else if (command == kWriteMemory && size > 4) {
    arv_fake_camera_write_memory(registers_, address, static_cast<guint32>(size - 4), data + 4);
    if (size >= 8) Written(address, Get<uint32_t>(data + 4));
    Put(answer, address);
  } else if (command == kResend) {
    Resend(data, size);
  } else if (command == kAction) {
    Action(data, size, (flags & 0x80) != 0);
  }
  return answer;
}

void GigeEmulator::HandleControl(const uint8_t* data, size_t size, const sockaddr_in& from, int socket) {
  if (data[0] != 0x42) return;
  const auto command = Get<uint16_t>(data + 2);
  const std::pair request(PeerOf(from), Get<uint16_t>(data + 6));
  const auto send = [&] {
    static_cast<void>(sendto(socket, answer_.data(), answer_.size(), 0,
                             reinterpret_cast<const sockaddr*>(&from), sizeof from));
  };
  const bool wants_answer = (data[1] & 1) != 0;
  if (wants_answer && request == answered_) return send();  // asked again before the answer came: done once
  const bool writes = command == kWriteRegister || command == kWriteMemory;
  if (writes && controller_ && *controller_ != PeerOf(from)) return;
  const std::vector<uint8_t> answer = Answer(command, data + 8, size - 8, data[1]);
  if (writes && Register(kPrivilege) == 0) controller_.reset();
  if (writes && Register(kPrivilege) != 0) controller_ = PeerOf(from);
  if (controller_ == PeerOf(from)) controller_seen_ns_ = HostTime_ns();
  if (!wants_answer) return;
  answer_.clear();
  Put(answer_, uint16_t{0});
  Put(answer_, static_cast<uint16_t>(command + 1));
  Put(answer_, static_cast<uint16_t>(answer.size()));
  Put(answer_, request.second);
  answer_.insert(answer_.end(), answer.begin(), answer.end());
  answered_ = request;
  send();
}

}  // namespace weft
