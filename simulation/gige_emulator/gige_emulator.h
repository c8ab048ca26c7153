// A simulated GigE Vision camera: Aravis's public register file with our own control and stream channels
// (GVCP, GVSP). It has packet resend, PTP, triggers and a clock with configurable faults.
#pragma once

#include <netinet/in.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/mutex.h"

struct _ArvFakeCamera;

namespace weft {

// The camera's clock against the host's CLOCK_REALTIME, and when it takes frames.
struct GigeEmulatorClock {
  double offset_ns = 0;       // without PTP
  double drift_ppm = 0;       // without PTP
  double jump_ns = 0;         // with PTP as well
  double ptp_error_ns = 0;    // what PTP leaves
  double phase_ns = 0;        // free-running frames begin at multiples of the period plus this
  int64_t host_start_ns = 0;  // drift counts from here
  double latch_error_ns = 0;  // of what the camera answers when it is asked for its time
  double latch_is_zero = 0;   // other than 0: it answers 0
  double latch_is_stuck = 0;  // other than 0: it answers what it answered first
};

// What it films: the same picture again after all others. Empty: a pattern that moves.
struct GigeEmulatorImages {
  uint32_t width_px = 0, height_px = 0;
  uint32_t pixel_format = 0;  // code of GenICam's naming convention
  double fps = 10;            // when it is switched on
  std::vector<std::vector<uint8_t>> images;
};

// Answers on `address`, port 3956, while it lives. Without given images the first 32 bytes of every image
// are numbers, little-endian: the true host time of its exposure, the frame counter, the device time, the
// address. The rest is a pattern derived from them.
class GigeEmulator {
 public:
  // Ends the process with a message where the address cannot be used (see IsFreeForGigeEmulator).
  GigeEmulator(const std::string& serial, const std::string& address, GigeEmulatorImages pictures = {});

  ~GigeEmulator();
  GigeEmulator(const GigeEmulator&) = delete;
  GigeEmulator& operator=(const GigeEmulator&) = delete;

  void SetClock(const std::string& field, double value);  // a field of GigeEmulatorClock by name
  void SetResend(bool resend);                            // whether the camera can; before it is opened
  void PulseLine(int64_t host_time_ns);                   // an edge at its trigger input

 private:
  struct Frame {
    uint16_t id = 0;
    int64_t device_time_ns = 0;
    std::vector<uint8_t> payload;
  };

  struct Trigger {
    int64_t host_time_ns = 0;  // of the exposure, maybe to come
    uint32_t source = 0;       // as in the register TriggerSource
  };

  void Run();
  void Wake() const;
  void AddTrigger(int64_t host_time_ns, uint32_t source);
  void HandleControl(const uint8_t* data, size_t size, const sockaddr_in& from, int socket);
  std::vector<uint8_t> Answer(uint16_t command, const uint8_t* data, size_t size, uint8_t flags);
  void Latch(int64_t device_ns);
  void Written(uint32_t address, uint32_t value);
  void RefreshRegisters();
  void Action(const uint8_t* data, size_t size, bool is_scheduled);
  void Resend(const uint8_t* data, size_t size);
  std::optional<int64_t> NextExposure(int64_t now_ns);
  void Expose(int64_t host_time_ns);
  const std::vector<uint8_t>* PictureAt(int64_t host_time_ns) const;
  std::vector<uint8_t> Image(int64_t host_time_ns, int64_t device_time_ns) const;
  void SendPackets(const Frame& frame, uint32_t first, uint32_t last);
  void SendTestPacket();
  void Send(const std::vector<uint8_t>& packet);
  uint32_t Register(uint32_t address) const;
  void SetRegister(uint32_t address, uint32_t value);
  float FloatRegister(uint32_t address) const;
  int64_t DeviceTime_ns(int64_t host_time_ns) const;
  int64_t HostTimeOf_ns(int64_t device_time_ns) const;
  size_t ImageBytes() const;
  uint32_t PacketBytes() const;

  const GigeEmulatorImages pictures_;
  _ArvFakeCamera* registers_;
  uint32_t address_ = 0;  // in network order
  int control_ = -1, broadcast_ = -1, stream_ = -1, wake_ = -1;
  std::optional<uint64_t> controller_;  // address and port of who holds the camera
  int64_t controller_seen_ns_ = 0;
  std::pair<uint64_t, uint16_t> answered_;  // peer and number of the last request
  std::vector<uint8_t> answer_;
  int64_t last_exposure_ns_ = 0;
  int64_t ptp_since_ns_ = 0;
  uint64_t frames_ = 0;
  std::deque<Frame> sent_;  // what can be resent
  mutable Mutex mutex_;
  std::deque<Trigger> triggers_ ABSL_GUARDED_BY(mutex_);
  GigeEmulatorClock clock_ ABSL_GUARDED_BY(mutex_);
  std::atomic<bool> is_over_ = false;
  std::thread thread_;
};

// The address is one of this machine's, and no emulator answers there.
bool IsFreeForGigeEmulator(const std::string& address);

}  // namespace weft
