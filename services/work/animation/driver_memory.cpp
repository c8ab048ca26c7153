#include "services/work/animation/driver_memory.h"

#include <cstdint>

#include "absl/strings/str_format.h"
#include "capture/file/checksum.h"
#include "services/formats/files/little_endian.h"

namespace weft {
namespace {

constexpr int64_t kLargest = 1'000'000;  // numbers of a table
constexpr size_t kWordBytes = 8;

template <typename Table>
void PutAll(const Table& table, std::string& out) {
  for (Eigen::Index i = 0; i < table.size(); ++i) PutLittleEndian(table.data()[i], out);
}

// Precondition: there are so many words.
template <typename Table>
void TakeAll(std::string_view& bytes, Table& table) {
  for (Eigen::Index i = 0; i < table.size(); ++i) table.data()[i] = TakeLittleEndian<double>(bytes);
}

}  // namespace

std::string EncodeMemory(const DriverMemory& memory) {
  std::string out;
  if (!memory.last_ns) return out;
  const TrackMemory& track = memory.drive.track;
  PutLittleEndian(*memory.last_ns, out);
  PutLittleEndian(int64_t{track.known}, out);
  if (track.known == 0) return out;
  const ShapeState& state = track.state;
  for (const Eigen::Index size : {state.z.size(), state.local.rows(), state.local.cols()})
    PutLittleEndian(static_cast<int64_t>(size), out);
  const Eigen::Matrix4d root = state.root.matrix();
  PutAll(root, out);
  PutAll(state.z, out);
  PutAll(track.z_before, out);
  PutAll(state.local, out);
  return out;
}

absl::StatusOr<DriverMemory> DecodeMemory(std::string_view bytes) {
  const absl::Status bad = absl::InvalidArgumentError("what the driver knew is damaged");
  DriverMemory memory;
  if (bytes.empty()) return memory;
  if (bytes.size() < 2 * kWordBytes) return bad;
  memory.last_ns = TakeLittleEndian<int64_t>(bytes);
  const auto known = TakeLittleEndian<int64_t>(bytes);
  if (known == 0 && bytes.empty()) return memory;
  if (known < 1 || known > 2 || bytes.size() < 3 * kWordBytes) return bad;
  int64_t sizes[3];
  for (int64_t& size : sizes) {
    size = TakeLittleEndian<int64_t>(bytes);
    if (size < 0 || size > kLargest) return bad;
  }
  const auto& [components, regions, of_region] = sizes;
  Eigen::Matrix4d root;
  const int64_t words = root.size() + 2 * components + regions * of_region;
  if (bytes.size() != static_cast<uint64_t>(words) * kWordBytes) return bad;
  TrackMemory& track = memory.drive.track;
  track.known = static_cast<int>(known);
  track.state.z.resize(components), track.z_before.resize(components);
  track.state.local.resize(regions, of_region);
  TakeAll(bytes, root);
  track.state.root.matrix() = root;
  TakeAll(bytes, track.state.z);
  TakeAll(bytes, track.z_before);
  TakeAll(bytes, track.state.local);
  return memory;
}

std::string MemoryChecksum(std::string_view bytes) {
  return absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size()));
}

}  // namespace weft
