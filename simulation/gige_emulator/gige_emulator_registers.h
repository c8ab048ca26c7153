// Registers and messages of a camera's end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace weft {

// Registers of GigE Vision.
inline constexpr uint32_t kDeviceMode = 0x4, kVendor = 0x48, kModel = 0x68, kCapability = 0x934,
                          kTimestampControl = 0x944, kTimestampHigh = 0x948, kTimestampLow = 0x94c,
                          kPrivilege = 0xa00, kHeartbeat = 0x938, kStreamPort = 0xd00, kPacketSize = 0xd04,
                          kStreamAddress = 0xd18, kStreamSource = 0xd1c;
inline constexpr uint32_t kCanWriteMemory = 1u << 1, kCanResend = 1u << 2, kCanAct = 1u << 6,
                          kFireTestPacket = 1u << 31;
// Registers of gige_emulator.xml.
inline constexpr uint32_t kWidth = 0x8000, kHeight = 0x8004, kPixelFormat = 0x8008, kAcquisition = 0x800c,
                          kFrameRate = 0x8010, kExposure = 0x8014, kTriggerMode = 0x8020,
                          kTriggerSource = 0x8024, kTriggerSoftware = 0x8028, kDeviceKey = 0x8030,
                          kGroupKey = 0x8034, kGroupMask = 0x8038, kActionSelector = 0x803c,
                          kPtpEnable = 0x8040, kPtpStatus = 0x8048, kPtpOffset = 0x8050, kChunkMode = 0x8060,
                          kPayload = 0x8070;
inline constexpr uint32_t kFromSoftware = 0, kFromLine = 1, kFromAction = 2;
inline constexpr uint16_t kDiscovery = 0x0002, kResend = 0x0040, kReadRegister = 0x0080,
                          kWriteRegister = 0x0082, kReadMemory = 0x0084, kWriteMemory = 0x0086,
                          kAction = 0x0100;
inline constexpr uint32_t kImageChunk = 0x5fffffff, kTimestampChunk = 0x4001;
inline constexpr size_t kChunkBytes = 8 + 8 + 8;  // heading of the image's chunk; timestamp with heading

// Numbers in network order.
template <typename T>
void Put(std::vector<uint8_t>& bytes, T value) {
  for (int shift = 8 * (static_cast<int>(sizeof(T)) - 1); shift >= 0; shift -= 8)
    bytes.push_back(static_cast<uint8_t>(static_cast<uint64_t>(value) >> shift));
}

template <typename T>
T Get(const uint8_t* bytes) {
  uint64_t value = 0;
  for (size_t i = 0; i < sizeof(T); ++i) value = value << 8 | bytes[i];
  return static_cast<T>(value);
}

}  // namespace weft
