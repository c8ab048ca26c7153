#include "services/formats/synthetic/frames_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "services/formats/files/little_endian.h"

namespace weft {
namespace {

constexpr std::string_view kFramesMagic = "weftseq1";
constexpr double kFinestMm = 1.0 / 64;
constexpr double kMostSteps = 32767;
constexpr uint32_t kMostVertices = 50'000'000;
constexpr size_t kPoseBytes = sizeof(float) * (3 + 4 * kJoints);
constexpr size_t kHeadBytes = 8 + 1 + 4 + 8 + 1 + 8;  // without the hash: magic, its length, ..., checksum

}  // namespace

size_t FramesHeadBytes(const FramesHead& head) { return kHeadBytes + head.template_hash.size(); }

std::string EncodeFramesHead(const FramesHead& head) {
  std::string out(kFramesMagic);
  PutLittleEndian(static_cast<uint8_t>(head.template_hash.size()), out);
  out += head.template_hash;
  PutLittleEndian(head.vertices, out);
  PutLittleEndian(head.fps, out);
  PutLittleEndian(static_cast<uint8_t>(head.has_pose ? 1 : 0), out);
  PutLittleEndian(Checksum(out.data(), out.size()), out);
  return out;
}

absl::StatusOr<FramesHead> DecodeFramesHead(std::string_view bytes, const std::string& source_name) {
  const auto bad = [&](std::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", std::string(what)));
  };
  if (!bytes.starts_with(kFramesMagic))
    return bad("holds no frames of cloth; it does not begin with weftseq1");
  std::string_view rest = bytes.substr(kFramesMagic.size());
  if (bytes.size() < kHeadBytes) return bad("ends within its head; was the file truncated?");
  FramesHead out;
  const auto length = TakeLittleEndian<uint8_t>(rest);
  if (bytes.size() < kHeadBytes + length) return bad("ends within its head; was the file truncated?");
  out.template_hash = rest.substr(0, length);
  rest.remove_prefix(length);
  out.vertices = TakeLittleEndian<uint32_t>(rest);
  out.fps = TakeLittleEndian<double>(rest);
  const auto has_pose = TakeLittleEndian<uint8_t>(rest);
  out.has_pose = has_pose == 1;
  if (TakeLittleEndian<uint64_t>(rest) != Checksum(bytes.data(), FramesHeadBytes(out) - sizeof(uint64_t)))
    return bad("the head does not match its checksum; the file is damaged");
  if (out.vertices == 0 || out.vertices > kMostVertices || has_pose > 1 || !(out.fps > 0 && out.fps <= 1000))
    return bad("the head cannot be: vertices, fps or flags are out of range");
  return out;
}

size_t ClothFrameBytes(const FramesHead& head) {
  // Time, middle, exponent, pose, vertices, checksum.
  return 8 + 3 * 8 + 1 + (head.has_pose ? kPoseBytes : 0) + size_t{6} * head.vertices + 8;
}

std::string EncodeClothFrame(const FramesHead& head, const ClothFrame& frame) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : frame.vertices_mm) box.extend(v);
  const Eigen::Vector3d middle = box.center();
  uint8_t doublings = 0;
  double step = kFinestMm;
  while (0.5 * box.sizes().maxCoeff() > kMostSteps * step && doublings < 40) step *= 2, ++doublings;
  std::string out;
  out.reserve(ClothFrameBytes(head));
  PutLittleEndian(frame.time_ns, out);
  for (int k = 0; k < 3; ++k) PutLittleEndian(middle[k], out);
  PutLittleEndian(doublings, out);
  if (head.has_pose) {
    const FigurePose pose = frame.pose.value_or(FigurePose());
    for (int k = 0; k < 3; ++k) PutLittleEndian(static_cast<float>(pose.root_mm[k]), out);
    for (const Eigen::Quaterniond& q : pose.rotation)
      for (int k = 0; k < 4; ++k) PutLittleEndian(static_cast<float>(q.coeffs()[k]), out);
  }
  for (const Eigen::Vector3d& v : frame.vertices_mm)
    for (int k = 0; k < 3; ++k) {
      const double steps = std::clamp(std::round((v[k] - middle[k]) / step), -kMostSteps, kMostSteps);
      PutLittleEndian(static_cast<int16_t>(steps), out);
    }
  PutLittleEndian(Checksum(out.data(), out.size()), out);
  return out;
}

absl::StatusOr<ClothFrame> DecodeClothFrame(const FramesHead& head, std::string_view bytes,
                                            const std::string& source_name) {
  if (bytes.size() != ClothFrameBytes(head))
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": a frame of ", bytes.size(), " bytes, expected ", ClothFrameBytes(head)));
  std::string_view rest = bytes;
  ClothFrame out;
  out.time_ns = TakeLittleEndian<int64_t>(rest);
  Eigen::Vector3d middle;
  for (int k = 0; k < 3; ++k) middle[k] = TakeLittleEndian<double>(rest);
  const auto doublings = TakeLittleEndian<uint8_t>(rest);
  if (head.has_pose) {
    FigurePose pose;
    for (int k = 0; k < 3; ++k) pose.root_mm[k] = TakeLittleEndian<float>(rest);
    for (Eigen::Quaterniond& q : pose.rotation) {
      for (int k = 0; k < 4; ++k) q.coeffs()[k] = TakeLittleEndian<float>(rest);
      q.normalize();
    }
    out.pose = pose;
  }
  const double step = std::ldexp(kFinestMm, doublings);
  out.vertices_mm.resize(head.vertices);
  for (Eigen::Vector3d& v : out.vertices_mm)
    for (int k = 0; k < 3; ++k) v[k] = middle[k] + step * TakeLittleEndian<int16_t>(rest);
  if (TakeLittleEndian<uint64_t>(rest) != Checksum(bytes.data(), bytes.size() - sizeof(uint64_t)))
    return absl::DataLossError(
        absl::StrCat(source_name, ": does not match its checksum; the file is damaged, make the take again"));
  return out;
}

absl::StatusOr<FramesReader> FramesReader::Open(const std::string& path, bool unfinished) {
  FramesReader out;
  out.path_ = path;
  out.file_.open(path, std::ios::binary);
  if (!out.file_)
    return absl::NotFoundError(absl::StrCat(path, ": cannot be opened; is it a take's frames.bin?"));
  std::string start(kHeadBytes + 255, '\0');
  out.file_.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<size_t>(out.file_.gcount()));
  out.file_.clear();
  WEFT_ASSIGN_OR_RETURN(out.head_, DecodeFramesHead(start, path));
  std::error_code error;
  const uintmax_t bytes = std::filesystem::file_size(path, error) - FramesHeadBytes(out.head_);
  const size_t each = ClothFrameBytes(out.head_);
  if (!unfinished && bytes % each != 0)
    return absl::InvalidArgumentError(absl::StrCat(path, ": ends within frame ", bytes / each, " (",
                                                   bytes % each, " of ", each,
                                                   " bytes); was the file truncated?"));
  out.frames_ = static_cast<int>(std::min<uintmax_t>(bytes / each, 1'000'000'000));
  return out;
}

absl::StatusOr<ClothFrame> FramesReader::Read(int frame) {
  if (frame < 0 || frame >= frames_)
    return absl::OutOfRangeError(absl::StrCat(path_, ": holds frames 0 to ", frames_ - 1, ", not ", frame));
  std::string bytes(ClothFrameBytes(head_), '\0');
  file_.clear();
  file_.seekg(
      static_cast<std::streamoff>(FramesHeadBytes(head_) + bytes.size() * static_cast<size_t>(frame)));
  file_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (file_.gcount() != static_cast<std::streamsize>(bytes.size()))
    return absl::DataLossError(absl::StrCat(path_, ": frame ", frame, " cannot be read"));
  return DecodeClothFrame(head_, bytes, absl::StrCat(path_, ": frame ", frame));
}

}  // namespace weft
