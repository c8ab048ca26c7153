#include "services/formats/figure/bvh_file.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/angles.h"
#include "base/status_macros.h"
#include "services/formats/figure/bvh_hierarchy.h"
#include "services/formats/figure/bvh_text.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

// Poses times joints, of which each takes 32 bytes and more: an hour of 75 joints at 120 poses a second.
constexpr size_t kMostRotations = size_t{1} << 25;

struct BvhRows {
  double frame_s = 0;
  std::vector<double> values;  // [rows x numbers]
};

// "Frames: 30" and "Frame Time: 0.0333", with or without blanks around the colon.
absl::Status ReadHead(BvhText& text, double& frames, double& frame_s) {
  WEFT_RETURN_IF_ERROR(text.Expect("frames"));
  text.Take(":");
  WEFT_ASSIGN_OR_RETURN(frames, text.Number("the number of frames"));
  if (!text.Take("frametime")) {
    WEFT_RETURN_IF_ERROR(text.Expect("frame"));
    WEFT_RETURN_IF_ERROR(text.Expect("time"));
  }
  text.Take(":");
  WEFT_ASSIGN_OR_RETURN(frame_s, text.Number("the frame time"));
  if (frame_s > 0) return absl::OkStatus();
  return text.ErrorBefore(absl::StrCat(
      "Frame Time is ", frame_s, ", expected the seconds between two frames, 0.0333333 at 30 a second"));
}

// A row ends where a line does, so that a number too many or too few shifts no other row.
absl::Status ReadRow(BvhText& text, size_t numbers, std::vector<double>& values) {
  const size_t line = text.Line();
  size_t in_first_line = 0;
  for (size_t k = 0; k < numbers; ++k) {
    in_first_line += text.Line() == line ? 1 : 0;
    WEFT_ASSIGN_OR_RETURN(const double value, text.Number("the value of a channel"));
    values.push_back(value);
    if (k + 1 < numbers || text.AtEnd() || text.Line() != text.LineBefore()) continue;
    if (in_first_line < numbers)
      return absl::InvalidArgumentError(absl::StrCat("is damaged: line ", line, ": a row of ", in_first_line,
                                                     " numbers, expected one for each of ", numbers,
                                                     " channels"));
    return text.Error(absl::StrCat("a row of more numbers than the ", numbers, " channels"));
  }
  return absl::OkStatus();
}

absl::StatusOr<BvhRows> ReadRows(BvhText& text, BvhHierarchy& hierarchy) {
  BvhRows out;
  double frames = 0;
  WEFT_RETURN_IF_ERROR(ReadHead(text, frames, out.frame_s));
  if (hierarchy.numbers == 0) return text.Error("no joint has channels, so nothing moves");
  const size_t most = kMostRotations / hierarchy.joints.size() * hierarchy.numbers;
  while (!text.AtEnd()) {
    WEFT_RETURN_IF_ERROR(ReadRow(text, hierarchy.numbers, out.values));
    if (out.values.size() > most) return text.Error("more poses than are read; cut the file into parts");
  }
  const auto rows = static_cast<double>(out.values.size() / hierarchy.numbers);
  if (rows < frames || rows < 1)
    return absl::InvalidArgumentError(absl::StrCat("is too short for the number of its frames: it says ",
                                                   frames, " and has ", rows, "; was the file truncated?"));
  if (rows > frames)
    hierarchy.notes.push_back(
        absl::StrCat("Frames says ", frames, ", the file has ", rows, "; all were read"));
  return out;
}

bool IsPosition(BvhChannel channel) { return channel <= BvhChannel::kZPosition; }
bool IsScale(BvhChannel channel) { return channel >= BvhChannel::kXScale; }

class MotionBuilder {
 public:
  MotionBuilder(BvhHierarchy hierarchy, const BvhRows& rows, double rad_per_unit)
      : hierarchy_(std::move(hierarchy)),
        rows_(rows),
        rad_per_unit_(rad_per_unit),
        count_(rows.values.size() / hierarchy_.numbers) {
    size_t at = 0;
    for (const std::vector<BvhChannel>& channels : hierarchy_.channels) {
      first_.push_back(at);
      at += channels.size();
    }
  }

  absl::StatusOr<ForeignMotion> Build() {
    WEFT_RETURN_IF_ERROR(FindScales());
    const bool is_added = PositionsAreAdded();
    out_.fps = 1 / rows_.frame_s;
    out_.joints = std::move(hierarchy_.joints);
    out_.notes = std::move(hierarchy_.notes);
    if (is_added)
      out_.notes.push_back("positions of joints were added to their offsets, as they are near zero");
    int places = 0;
    for (size_t j = 0; j < out_.joints.size(); ++j)
      if (HasPosition(j)) out_.joints[j].place = places++;
    out_.poses.resize(count_);
    for (size_t row = 0; row < count_; ++row) FillPose(row, is_added, out_.poses[row]);
    for (size_t j = 0; j < out_.joints.size(); ++j) out_.joints[j].offset *= ScaleAbove(j);
    return std::move(out_);
  }

 private:
  double Value(size_t row, size_t joint, size_t channel) const {
    return rows_.values[row * hierarchy_.numbers + first_[joint] + channel];
  }

  bool HasPosition(size_t joint) const { return std::ranges::any_of(hierarchy_.channels[joint], IsPosition); }

  Eigen::Vector3d PositionAt(size_t row, size_t joint, const Eigen::Vector3d& otherwise) const {
    Eigen::Vector3d out = otherwise;
    for (size_t c = 0; c < hierarchy_.channels[joint].size(); ++c)
      if (IsPosition(hierarchy_.channels[joint][c]))
        out[static_cast<int>(hierarchy_.channels[joint][c])] = Value(row, joint, c);
    return out;
  }

  // Bones keep their lengths: positions below the root are near the offsets in files that give the whole
  // position, as most programs do, and near zero in files that give what is added.
  bool PositionsAreAdded() const {
    double to_offset = 0, to_zero = 0;
    for (size_t j = 0; j < hierarchy_.joints.size(); ++j) {
      const ForeignMotion::Joint& joint = hierarchy_.joints[j];
      // What hangs on a root that is no part of the body moves freely.
      if (joint.parent < 0 || hierarchy_.joints[static_cast<size_t>(joint.parent)].parent < 0 ||
          !HasPosition(j))
        continue;
      for (size_t row = 0; row < count_; ++row) {
        const Eigen::Vector3d at = PositionAt(row, j, joint.offset);
        to_offset += (at - joint.offset).norm();
        to_zero += at.norm();
      }
    }
    return to_zero < to_offset;
  }

  // Sizes that differ from 1 make all longer that hangs on a joint.
  absl::Status FindScales() {
    scale_.assign(hierarchy_.joints.size(), 1);
    for (size_t j = 0; j < hierarchy_.joints.size(); ++j) {
      std::vector<double> values;
      for (size_t c = 0; c < hierarchy_.channels[j].size(); ++c)
        if (IsScale(hierarchy_.channels[j][c]))
          for (size_t row = 0; row < count_; ++row) values.push_back(Value(row, j, c));
      if (values.empty()) continue;
      const auto [low, high] = std::ranges::minmax_element(values);
      constexpr double kSame = 1e-3;
      if (!(*low > 0) || *high - *low > kSame * *high)
        return absl::InvalidArgumentError(
            absl::StrCat("\"", hierarchy_.joints[j].name, "\" has scale channels from ", *low, " to ", *high,
                         ", expected one size above zero; export it without scale"));
      scale_[j] = *low;
    }
    return absl::OkStatus();
  }

  double ScaleAbove(size_t joint) const {
    const std::vector<ForeignMotion::Joint>& joints = out_.joints;
    double out = 1;
    for (int k = joints[joint].parent; k >= 0; k = joints[static_cast<size_t>(k)].parent)
      out *= scale_[static_cast<size_t>(k)];
    return out;
  }

  void FillPose(size_t row, bool is_added, ForeignMotion::Pose& pose) const {
    for (size_t j = 0; j < out_.joints.size(); ++j) {
      const ForeignMotion::Joint& joint = out_.joints[j];
      if (joint.place >= 0) {
        // The root's is where it is in the world, in either kind of file.
        const bool adds = is_added && joint.parent >= 0;
        const Eigen::Vector3d at = PositionAt(row, j, adds ? Eigen::Vector3d(0, 0, 0) : joint.offset);
        pose.place.push_back(ScaleAbove(j) * (adds ? Eigen::Vector3d(at + joint.offset) : at));
      }
      Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
      for (size_t c = 0; c < hierarchy_.channels[j].size(); ++c) {
        const auto axis =
            static_cast<int>(hierarchy_.channels[j][c]) - static_cast<int>(BvhChannel::kXRotation);
        if (axis < 0 || axis > 2) continue;
        turn = turn * Eigen::AngleAxisd(rad_per_unit_ * Value(row, j, c), Eigen::Vector3d::Unit(axis));
      }
      pose.rotation.push_back(turn.normalized());
    }
  }

  BvhHierarchy hierarchy_;
  const BvhRows& rows_;
  double rad_per_unit_;  // of rotations
  size_t count_;
  std::vector<size_t> first_;  // of each joint's numbers in a row
  std::vector<double> scale_;
  ForeignMotion out_;
};

absl::StatusOr<ForeignMotion> Parse(std::string_view bytes, BvhAngles angles) {
  if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff"))
    return absl::InvalidArgumentError("is text in UTF-16; save it as UTF-8");
  BvhText text(bytes);
  WEFT_ASSIGN_OR_RETURN(BvhHierarchy hierarchy, ReadBvhHierarchy(text));
  if (text.AtEnd()) return absl::InvalidArgumentError("has no motion; the part MOTION is missing");
  WEFT_ASSIGN_OR_RETURN(const BvhRows rows, ReadRows(text, hierarchy));
  bool are_radians = angles == BvhAngles::kRadians;
  if (angles == BvhAngles::kAuto) {
    const AngleJudgement judgement = JudgeBvhAngles(hierarchy, rows.values);
    are_radians = judgement.are_radians;
    if (!judgement.note.empty()) hierarchy.notes.push_back(judgement.note);
  }
  return MotionBuilder(std::move(hierarchy), rows, are_radians ? 1 : kRadPerDeg).Build();
}

}  // namespace

bool IsBvh(std::string_view bytes) {
  constexpr size_t kLongestBeginning = 64;
  BvhText text(bytes.substr(0, kLongestBeginning));
  return text.Take("hierarchy");
}

absl::StatusOr<ForeignMotion> ParseBvh(std::string_view bytes, const std::string& source_name,
                                       BvhAngles angles) {
  absl::StatusOr<ForeignMotion> out = Parse(bytes, angles);
  if (out.ok()) return out;
  return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", std::string(out.status().message())));
}

absl::StatusOr<ForeignMotion> ReadBvh(const std::string& path, BvhAngles angles) {
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path, kMaxBvhBytes));
  return ParseBvh(bytes, path, angles);
}

}  // namespace weft
