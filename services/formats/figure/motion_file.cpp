#include "services/formats/figure/motion_file.h"

#include <cstdint>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "services/formats/figure/bvh_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/little_endian.h"

namespace weft {
namespace {

constexpr std::string_view kMotionMagic = "weftmot1";
constexpr size_t kPoseBytes = sizeof(float) * (3 + 4 * kJoints);
constexpr size_t kHeadBytes = 8 + sizeof(uint64_t) + sizeof(double) + sizeof(uint64_t);

// Of the joints' names and order: motions of other skeletons mean something else.
uint64_t SkeletonKey() {
  std::string text;
  for (int j = 0; j < kJoints; ++j) {
    const auto joint = static_cast<Joint>(j);
    text.append(NameOf(joint)).append("<").append(NameOf(ParentOf(joint))).append("\n");
  }
  return Checksum(text.data(), text.size());
}

}  // namespace

std::string EncodeMotion(const Motion& motion) {
  std::string out(kMotionMagic);
  out.reserve(kHeadBytes + kPoseBytes * motion.poses.size() + sizeof(uint64_t));
  PutLittleEndian(SkeletonKey(), out);
  PutLittleEndian(motion.fps, out);
  PutLittleEndian(static_cast<uint64_t>(motion.poses.size()), out);
  for (const FigurePose& pose : motion.poses) {
    for (int k = 0; k < 3; ++k) PutLittleEndian(static_cast<float>(pose.root_mm[k]), out);
    for (const Eigen::Quaterniond& q : pose.rotation)
      for (int k = 0; k < 4; ++k) PutLittleEndian(static_cast<float>(q.coeffs()[k]), out);
  }
  PutLittleEndian(Checksum(out.data(), out.size()), out);
  return out;
}

absl::StatusOr<Motion> DecodeMotion(std::string_view bytes, const std::string& source_name) {
  const auto bad = [&](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", what));
  };
  if (IsBvh(bytes))
    return bad("is not a motion but BVH; import it with `weft motion import FILE.bvh --out FILE.motion`");
  if (!bytes.starts_with(kMotionMagic))
    return bad("is not a motion; it does not begin with weftmot1 (make one with `weft motion make`)");
  if (bytes.size() < kHeadBytes) return bad("ends within its head; was the file truncated?");
  std::string_view rest = bytes.substr(kMotionMagic.size());
  if (TakeLittleEndian<uint64_t>(rest) != SkeletonKey())
    return bad("is a motion of another skeleton; make or import it again with this version of weft");
  Motion out;
  out.fps = TakeLittleEndian<double>(rest);
  const auto count = TakeLittleEndian<uint64_t>(rest);
  if (count > rest.size() / kPoseBytes || rest.size() != count * kPoseBytes + sizeof(uint64_t))
    return bad(absl::StrCat("holds ", rest.size(), " bytes for ", count, " poses, expected ", kPoseBytes,
                            " each and 8 more; was the file truncated?"));
  out.poses.resize(count);
  for (FigurePose& pose : out.poses) {
    for (int k = 0; k < 3; ++k) pose.root_mm[k] = TakeLittleEndian<float>(rest);
    for (Eigen::Quaterniond& q : pose.rotation)
      for (int k = 0; k < 4; ++k) q.coeffs()[k] = TakeLittleEndian<float>(rest);
  }
  if (TakeLittleEndian<uint64_t>(rest) != Checksum(bytes.data(), bytes.size() - sizeof(uint64_t)))
    return bad("does not match its checksum; the file is damaged, make it again");
  if (absl::Status status = out.Validate(); !status.ok()) return bad(std::string(status.message()));
  for (FigurePose& pose : out.poses)
    for (Eigen::Quaterniond& q : pose.rotation) q.normalize();
  return out;
}

absl::StatusOr<Motion> ReadMotion(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path, kMaxMotionBytes));
  return DecodeMotion(bytes, path);
}

std::string MotionHash(const Motion& motion) {
  const std::string bytes = EncodeMotion(motion);
  return absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size()));
}

absl::Status WriteMotion(const std::string& path, const Motion& motion) {
  return WriteFileAtomically(path, EncodeMotion(motion));
}

}  // namespace weft
