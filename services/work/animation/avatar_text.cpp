#include "services/work/animation/avatar_text.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "evaluation/measures.h"
#include "services/work/animation/pixel_avatar_file.h"

namespace weft {
namespace {

constexpr double kMegabyte = 1e6;
// Held-out frames that sigma is fitted to: with fewer it is rough.
constexpr int kEnoughCheckFrames = 8;

const v1::AvatarScore* FindScore(const v1::AvatarEvaluation& evaluation, const std::string& split,
                                 int cameras, const std::string& method) {
  const auto& scores = evaluation.scores();
  const auto found = std::ranges::find_if(scores, [&](const v1::AvatarScore& score) {
    return score.split() == split && score.cameras() == cameras && score.method() == method &&
           score.frames() > 0;
  });
  return found == scores.end() ? nullptr : &*found;
}

void AppendSigma(const v1::AvatarSigmaCheck& check, const char* of, std::string& out) {
  if (check.frames() == 0) return;
  absl::StrAppendFormat(&out, "sigma      fitted to %d %s: %.0f %% of the errors below 1, %.0f %% below 2\n",
                        check.frames(), of, 100 * check.within_one(), 100 * check.within_two());
}

// What is missing for a sigma that can be trusted.
std::string SigmaRemark(const v1::Avatar& avatar) {
  if (avatar.held_out_check().frames() == 0 && avatar.left_out_check().frames() == 0)
    return "sigma      NOT fitted: too few frames are held out; typical factors stand in. Learn from longer "
           "takes, or name some with --hold-out\n";
  if (avatar.held_out_check().frames() < kEnoughCheckFrames)
    return "sigma      few frames are held out, so it is rough; name takes with --hold-out\n";
  if (avatar.left_out_check().frames() == 0)
    return "sigma      not tried on motions that were left out, as there is one alone; learn from several\n";
  return "";
}

constexpr const char* kColumns[] = {"mean_mm",
                                    "median_mm",
                                    "across_mm",
                                    "seen_mm",
                                    "crossed_mm",
                                    "unseen_mm",
                                    "chamfer_mm",
                                    "error_jitter_seen_mm",
                                    "error_jitter_unseen_mm",
                                    "share_within_sigma",
                                    "share_within_two_sigma",
                                    "lost_frames",
                                    "ms_a_frame",
                                    "from_registered_mm",
                                    "cells_a_view"};

// "-" where it was not measured.
std::string ValueText(const v1::AvatarScore& score, const Measure& measure) {
  const google::protobuf::FieldDescriptor* field = score.GetDescriptor()->FindFieldByName(measure.name);
  const google::protobuf::Reflection& read = *score.GetReflection();
  if (field->cpp_type() == field->CPPTYPE_INT32) return absl::StrCat(read.GetInt32(score, field));
  const double value = read.GetDouble(score, field);
  const bool is_rate = field->number() == v1::AvatarScore::kMsAFrameFieldNumber ||
                       field->number() == v1::AvatarScore::kCellsAViewFieldNumber;
  if ((field->has_presence() && !read.HasField(score, field)) || value < 0 || (is_rate && value == 0))
    return "-";
  return absl::StrFormat("%.*f", measure.decimals, InShownUnit(measure, value));
}

// Of its large files.
double BytesOf(const v1::Avatar& avatar) {
  return static_cast<double>(avatar.space_bytes() + avatar.net().onnx_bytes() + avatar.net().sample_bytes());
}

void AppendNet(const v1::Avatar& avatar, std::string& out) {
  if (!avatar.has_net()) {
    absl::StrAppend(&out, "net        none\n");
    return;
  }
  const v1::AvatarNet& net = avatar.net();
  const v1::AvatarNetTraining& training = net.training();
  absl::StrAppendFormat(&out, "net        %.2f MB, trained in %d of %d steps, seed %d, %d threads%s\n",
                        static_cast<double>(net.onnx_bytes()) / kMegabyte, training.steps_taken(),
                        training.steps(), training.seed(), training.threads(),
                        training.steps_taken() < training.steps() ? "; its time ended before its steps" : "");
  for (const v1::AvatarNetGain& gain : net.gain())
    absl::StrAppendFormat(
        &out, "net        %d cameras, %d held-out frames: mean error %.3f mm, without it %.3f mm\n",
        gain.cameras(), gain.frames(), gain.after_mm(), gain.before_mm());
}

void AppendSources(const v1::Avatar& avatar, std::string& out) {
  for (const v1::AvatarSource& source : avatar.sources())
    absl::StrAppendFormat(&out, "%-9s  %5d frames  %s\n", source.held_out() ? "held out" : "source",
                          source.frames(), source.name());
}

}  // namespace

std::vector<std::string> BaselineRemarks(const v1::AvatarEvaluation& evaluation) {
  std::vector<std::string> remarks;
  for (const v1::AvatarScore& elsewhere : evaluation.scores()) {
    if (elsewhere.method() != "paper elsewhere") continue;
    const v1::AvatarScore* paper = FindScore(evaluation, elsewhere.split(), 2, "paper");
    const v1::AvatarScore* ours = FindScore(evaluation, elsewhere.split(), 2, "elsewhere");
    if (paper == nullptr || ours == nullptr || elsewhere.frames() == 0) continue;
    remarks.push_back(
        absl::StrFormat("%s, 2 cameras elsewhere: the preset paper is off by %.3f mm, %.2f times as far as "
                        "before its own cameras "
                        "(%.3f mm), and %d frames are lost; ours by %.3f mm",
                        elsewhere.split(), elsewhere.mean_mm(), elsewhere.mean_mm() / paper->mean_mm(),
                        paper->mean_mm(), elsewhere.lost_frames(), ours->mean_mm()));
  }
  return remarks;
}

std::string AvatarEvaluationText(const v1::AvatarEvaluation& evaluation) {
  int columns = 5, methods = 10;
  for (const v1::AvatarScore& score : evaluation.scores()) {
    columns = std::max(columns, static_cast<int>(score.split().size()));
    methods = std::max(methods, static_cast<int>(score.method().size()));
  }
  std::string out;
  for (const char* name : kColumns) {
    const Measure& measure = MeasureNamed(name);
    absl::StrAppendFormat(&out, "%-8s %s: %s\n", measure.heading, TitleWithUnit(measure), measure.definition);
  }
  absl::StrAppendFormat(&out, "\n%-*s  %4s  %-*s  %6s", columns, "split", "cam.", methods, "method",
                        "frames");
  for (const char* name : kColumns) absl::StrAppendFormat(&out, "  %7s", MeasureNamed(name).heading);
  for (const v1::AvatarScore& score : evaluation.scores()) {
    absl::StrAppendFormat(&out, "\n%-*s  %4s  %-*s  %6d", columns, score.split(),
                          score.cameras() > 0 ? absl::StrCat(score.cameras()) : "-", methods, score.method(),
                          score.frames());
    for (const char* name : kColumns)
      absl::StrAppendFormat(&out, "  %7s", ValueText(score, MeasureNamed(name)));
  }
  out += '\n';
  if (evaluation.floor_size() > 0)
    absl::StrAppend(&out, "\nchaos floor: what a shorter time step alone changes, in mm\n");
  for (const v1::AvatarFloor& floor : evaluation.floor())
    absl::StrAppendFormat(&out, "%-28s  %4d frames  mean %.3f  median %.3f  jitter %.3f\n", floor.take(),
                          floor.frames(), floor.mean_mm(), floor.median_mm(), floor.error_jitter_mm());
  for (const std::string& remark : evaluation.remarks()) absl::StrAppend(&out, "note: ", remark, "\n");
  return out;
}

std::string AvatarText(const std::string& path, const v1::Avatar& avatar) {
  std::string out =
      absl::StrFormat("%s: %s avatar of the template \"%s\" (%s), board %s; made by %s, %.1f MB\n", path,
                      avatar.kind(), avatar.template_id(), avatar.template_hash(), avatar.board_hash(),
                      avatar.made_by(), BytesOf(avatar) / kMegabyte);
  if (avatar.kind() == kPixelKind) {
    absl::StrAppendFormat(
        &out,
        "learnt     poses of a graph by %d numbers, from %d frames; the graph misses %.3f mm (mean)\n"
        "held out   %d frames\n",
        avatar.components(), avatar.training_frames(), avatar.left_mm(), avatar.held_out_frames());
    AppendNet(avatar, out);
    AppendSources(avatar, out);
    return out;
  }
  absl::StrAppendFormat(
      &out,
      "learnt     %d shapes of %d vertices from %d frames at %g frames/s; they miss %.3f mm (rms per axis)\n"
      "held out   %d frames\n",
      avatar.components(), avatar.vertices(), avatar.training_frames(), avatar.fps(), avatar.left_mm(),
      avatar.held_out_frames());
  AppendSigma(avatar.held_out_check(), "held-out frames", out);
  AppendSigma(avatar.left_out_check(), "frames of motions left out in turn", out);
  absl::StrAppend(&out, SigmaRemark(avatar));
  AppendNet(avatar, out);
  for (int cameras = 1; cameras <= avatar.sigma_size(); ++cameras) {
    absl::StrAppendFormat(&out, "sigma      %d camera%s", cameras, cameras == 1 ? "" : "s");
    absl::StrAppend(&out, cameras == avatar.sigma_size() ? " and more" : "", ": times");
    for (const double factor : avatar.sigma(cameras - 1).of_rays())
      absl::StrAppendFormat(&out, " %.2f", factor);
    absl::StrAppend(&out, " for vertices with 0, 1, 2, 3 and more rays\n");
  }
  absl::StrAppend(
      &out,
      "sigma      fitted without pictures; before three cameras and more it may be too small by them: "
      "`weft evaluate TAKE --avatar AVATAR` of a simulated take tells (1 s %, 2 s %)\n");
  AppendSources(avatar, out);
  return out;
}

}  // namespace weft
