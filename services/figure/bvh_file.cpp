#include "services/figure/bvh_file.h"

#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/files/atomic_file.h"

namespace weft {
namespace {

constexpr int kDeepest = 100;

bool IsSpace(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

// What the library does not refuse itself: it reads chains of joints recursively, and reserves memory for as
// many frames as the file claims to have.
absl::Status CheckBefore(std::string_view text) {
  std::string_view rest = text;
  while (!rest.empty() && IsSpace(rest.front())) rest.remove_prefix(1);
  if (!rest.starts_with("HIERARCHY"))
    return absl::InvalidArgumentError("is not BVH; it does not begin with HIERARCHY");
  int depth = 0;
  for (const char c : text) {
    depth += (c == '{') - (c == '}');
    if (depth > kDeepest)
      return absl::InvalidArgumentError(absl::StrCat("more than ", kDeepest, " joints follow one another"));
  }
  constexpr std::string_view kFrames = "Frames:";
  for (size_t at = text.find(kFrames); at != std::string_view::npos; at = text.find(kFrames, at + 1)) {
    size_t from = at + kFrames.size();
    while (from < text.size() && IsSpace(text[from])) ++from;
    uint64_t frames = 0;
    const auto [end, error] = std::from_chars(text.data() + from, text.data() + text.size(), frames);
    // A frame has a number or more, and each takes two characters.
    if (error != std::errc() || end == text.data() + from || frames > text.size() / 2)
      return absl::InvalidArgumentError("is too short for the number of its frames; was the file truncated?");
  }
  return absl::OkStatus();
}

Eigen::Vector3d ToEigen(const aiVector3D& v) { return {v.x, v.y, v.z}; }
Eigen::Quaterniond ToEigen(const aiQuaternion& q) { return {q.w, q.x, q.y, q.z}; }

// Depth first, so that parents come before their children.
absl::Status AddJoints(const aiNode& node, int parent, ForeignMotion& out,
                       std::map<std::string, size_t>& index) {
  const std::string name = node.mName.C_Str();
  if (!index.emplace(name, out.joints.size()).second)
    return absl::InvalidArgumentError(absl::StrCat("two joints are called \"", name, "\""));
  const auto me = static_cast<int>(out.joints.size());
  const aiMatrix4x4& at = node.mTransformation;
  out.joints.push_back({name, parent, {at.a4, at.b4, at.c4}});
  for (unsigned k = 0; k < node.mNumChildren; ++k)
    if (absl::Status status = AddJoints(*node.mChildren[k], me, out, index); !status.ok()) return status;
  return absl::OkStatus();
}

// The last key where there are fewer than frames.
template <typename Key>
const Key& KeyAt(const Key* keys, unsigned count, unsigned frame) {
  return keys[std::min(frame, count - 1)];
}

absl::Status AddPoses(const aiAnimation& animation, const std::map<std::string, size_t>& index,
                      ForeignMotion& out) {
  unsigned frames = 0;
  for (unsigned c = 0; c < animation.mNumChannels; ++c)
    frames = std::max(frames, animation.mChannels[c]->mNumRotationKeys);
  // A frame's numbers are in the file, so this is no more than some times its size.
  out.poses.resize(frames);
  for (ForeignMotion::Pose& pose : out.poses)
    pose.rotation.assign(out.joints.size(), Eigen::Quaterniond::Identity());
  for (unsigned c = 0; c < animation.mNumChannels; ++c) {
    const aiNodeAnim& channel = *animation.mChannels[c];
    const auto joint = index.find(channel.mNodeName.C_Str());
    if (joint == index.end()) continue;
    for (unsigned k = 0; k < frames; ++k) {
      if (channel.mNumRotationKeys > 0)
        out.poses[k].rotation[joint->second] =
            ToEigen(KeyAt(channel.mRotationKeys, channel.mNumRotationKeys, k).mValue);
      if (joint->second == 0 && channel.mNumPositionKeys > 0)
        out.poses[k].root = ToEigen(KeyAt(channel.mPositionKeys, channel.mNumPositionKeys, k).mValue);
    }
  }
  out.fps = animation.mTicksPerSecond;
  for (ForeignMotion::Pose& pose : out.poses) {
    bool is_finite = pose.root.allFinite();
    for (Eigen::Quaterniond& q : pose.rotation) {
      is_finite = is_finite && q.coeffs().allFinite() && q.norm() > 0.5;
      q.normalize();
    }
    if (!is_finite) return absl::InvalidArgumentError("has a channel whose value is no finite number");
  }
  return absl::OkStatus();
}

absl::StatusOr<ForeignMotion> Parse(std::string_view bytes) {
  if (absl::Status status = CheckBefore(bytes); !status.ok()) return status;
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, "bvh");
  if (!scene || !scene->mRootNode) {
    std::string what = importer.GetErrorString();
    // The library's name for bytes in memory.
    if (const size_t at = what.rfind(".bvh:"); at != std::string::npos) what = "line " + what.substr(at + 5);
    return absl::InvalidArgumentError(absl::StrCat("is damaged: ", what));
  }
  if (scene->mNumAnimations == 0 || scene->mAnimations[0]->mNumChannels == 0)
    return absl::InvalidArgumentError("has no motion; the part MOTION is missing");
  ForeignMotion out;
  std::map<std::string, size_t> index;
  absl::Status status = AddJoints(*scene->mRootNode, -1, out, index);
  if (status.ok()) status = AddPoses(*scene->mAnimations[0], index, out);
  for (const ForeignMotion::Joint& joint : out.joints)
    if (status.ok() && !joint.offset.allFinite())
      status = absl::InvalidArgumentError(absl::StrCat("the offset of ", joint.name, " is no finite number"));
  if (!status.ok()) return status;
  return out;
}

}  // namespace

absl::StatusOr<ForeignMotion> ParseBvh(std::string_view bytes, const std::string& source_name) {
  absl::StatusOr<ForeignMotion> out = Parse(bytes);
  if (out.ok()) return out;
  return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", std::string(out.status().message())));
}

absl::StatusOr<ForeignMotion> ReadBvh(const std::string& path) {
  const absl::StatusOr<std::string> bytes = ReadWholeFile(path, kMaxBvhBytes);
  if (!bytes.ok()) return bytes.status();
  return ParseBvh(*bytes, path);
}

}  // namespace weft
