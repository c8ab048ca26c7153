#include "services/work/animation/avatar_goals.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/formats/verdict/verdict.h"
#include "services/work/animation/pixel_avatar_file.h"

namespace weft {
namespace {

constexpr double kMegabyte = 1e6;
// Held-out frames that sigma is fitted to: with fewer it is rough.
constexpr int kEnoughCheckFrames = 8;
constexpr char kKnown[] = "test-known", kUnseen[] = "test-unseen";

const v1::AvatarScore* FindScore(const v1::AvatarEvaluation& evaluation, const std::string& split,
                                 int cameras, const std::string& method) {
  const auto& scores = evaluation.scores();
  const auto found = std::find_if(scores.begin(), scores.end(), [&](const v1::AvatarScore& score) {
    return score.split() == split && score.cameras() == cameras && score.method() == method &&
           score.frames() > 0;
  });
  return found == scores.end() ? nullptr : &*found;
}

class Goals {
 public:
  explicit Goals(v1::AvatarEvaluation& evaluation) : evaluation_(evaluation) {}

  // A value that is to be at most `must`.
  void Add(const char* id, const std::string& what, double value, double must, double aim) {
    v1::AvatarGoal& goal = *evaluation_.add_goals();
    goal.set_id(id);
    goal.set_what(what);
    goal.set_value(value);
    goal.set_must(must);
    goal.set_aim(aim);
    goal.set_met(value <= must);
  }

  using Field = std::function<double(const v1::AvatarScore&)>;
  void OfDriven(const char* id, const std::string& what, const char* split, int cameras, const Field& field,
                double must, double aim) {
    if (const v1::AvatarScore* driven = FindScore(evaluation_, split, cameras, "driven"))
      Add(id, absl::StrCat(what, ", ", split, ", ", cameras, " cameras"), field(*driven), must, aim);
  }

  // Over another method on the same frames; `field` of both.
  void Over(const char* id, const std::string& what, const char* split, int cameras, const char* method,
            const Field& field, double must, double aim) {
    const v1::AvatarScore* driven = FindScore(evaluation_, split, cameras, "driven");
    const v1::AvatarScore* other = FindScore(evaluation_, split, cameras, method);
    if (driven == nullptr || other == nullptr || !(field(*other) > 0)) return;
    Add(id, absl::StrCat(what, ", ", split, ", ", cameras, " cameras"), field(*driven) / field(*other), must,
        aim);
  }

  // Before two cameras in other places than those of the other rows.
  void Elsewhere(const char* split) {
    const v1::AvatarScore* driven = FindScore(evaluation_, split, 2, "driven");
    const v1::AvatarScore* elsewhere = FindScore(evaluation_, split, 2, "elsewhere");
    if (driven == nullptr || elsewhere == nullptr || driven->mean_mm() == 0) return;
    Add("A7", absl::StrCat("mean of 2 cameras elsewhere over theirs, ", split),
        elsewhere->mean_mm() / driven->mean_mm(), 1.3, 1.15);
  }

  // While the first of two cameras is dark, and afterwards.
  void Dark(const char* split) {
    const v1::AvatarScore* dark = FindScore(evaluation_, split, 2, "one dark");
    const v1::AvatarScore* after = FindScore(evaluation_, split, 2, "after dark");
    const v1::AvatarScore* never = FindScore(evaluation_, split, 2, "never dark");
    if (dark != nullptr)
      Add("A10", absl::StrCat("vertices over 80 mm, one of 2 dark, ", split),
          static_cast<double>(dark->lost_vertices()), 0, 0);
    if (after == nullptr || never == nullptr || never->mean_mm() == 0) return;
    Add("A10", absl::StrCat("mean 10 frames after the dark over that without, ", split),
        after->mean_mm() / never->mean_mm(), 1.2, 1.05);
  }

  void HandBefore(const char* split) {
    if (const v1::AvatarScore* hand = FindScore(evaluation_, split, 2, "hand before"))
      Add("A10", absl::StrCat("vertices over 80 mm, a hand before the shirt, ", split),
          static_cast<double>(hand->lost_vertices()), 0, 0);
  }

  void AtSeams(const char* split) {
    const v1::AvatarScore* driven = FindScore(evaluation_, split, 2, "driven");
    if (driven != nullptr && driven->at_seams_mm() > 0 && driven->off_seams_mm() > 0)
      Add("X3", absl::StrCat("mean at seams over that elsewhere, ", split, ", 2 cameras"),
          driven->at_seams_mm() / driven->off_seams_mm(), 1.3, 1);
  }

  // The largest number of cameras that was registered, too.
  void FromRegistered(const char* split) {
    const v1::AvatarScore* most = nullptr;
    for (const v1::AvatarScore& score : evaluation_.scores())
      if (score.split() == split && score.method() == "driven" && score.has_from_registered_mm() &&
          (most == nullptr || score.cameras() > most->cameras()))
        most = &score;
    if (most != nullptr)
      Add("A8", absl::StrCat("mm from the registration, where it has points, ", split, ", ", most->cameras()),
          most->from_registered_mm(), 0.3, 0.15);
  }

  // The error falls from each number of cameras to the next.
  void Falls(const char* split) {
    std::vector<const v1::AvatarScore*> driven;
    for (const v1::AvatarScore& score : evaluation_.scores())
      if (score.split() == split && score.method() == "driven" && score.frames() > 0)
        driven.push_back(&score);
    std::sort(driven.begin(), driven.end(),
              [](const auto* a, const auto* b) { return a->cameras() < b->cameras(); });
    double worst = 0;
    for (size_t k = 0; k + 1 < driven.size(); ++k)
      worst = std::max(worst, driven[k + 1]->mean_mm() / driven[k]->mean_mm());
    if (worst > 0)
      Add("A8", absl::StrCat("mean over that of one number of cameras less, the worst, ", split), worst, 1,
          0.8);
  }

 private:
  v1::AvatarEvaluation& evaluation_;
};

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

std::string ShareText(double share) { return share < 0 ? "-" : absl::StrFormat("%.1f", 100 * share); }

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

// How the baseline bears cameras that it was not trained for: nobody's goal, but what ours is worth.
void AddPaperElsewhere(v1::AvatarEvaluation& evaluation) {
  for (const v1::AvatarScore& elsewhere : evaluation.scores()) {
    if (elsewhere.method() != "paper elsewhere") continue;
    const v1::AvatarScore* paper = FindScore(evaluation, elsewhere.split(), 2, "paper");
    const v1::AvatarScore* ours = FindScore(evaluation, elsewhere.split(), 2, "elsewhere");
    if (paper == nullptr || ours == nullptr || elsewhere.frames() == 0) continue;
    evaluation.add_remarks(
        absl::StrFormat("%s, 2 cameras elsewhere: the preset paper is off by %.3f mm, %.2f times as far as "
                        "before its own cameras "
                        "(%.3f mm), and %d frames are lost; ours by %.3f mm",
                        elsewhere.split(), elsewhere.mean_mm(), elsewhere.mean_mm() / paper->mean_mm(),
                        paper->mean_mm(), elsewhere.lost_frames(), ours->mean_mm()));
  }
}

// A1 to A4.
void AddErrorGoals(Goals& goals) {
  const auto mean = [](const v1::AvatarScore& s) { return s.mean_mm(); };
  const auto median = [](const v1::AvatarScore& s) { return s.median_mm(); };
  goals.OfDriven("A1", "mean mm", kKnown, 2, mean, 2.2, 1.5);
  goals.OfDriven("A1", "median mm", kKnown, 2, median, 1.6, 1.0);
  goals.OfDriven("A2", "mean mm", kUnseen, 3, mean, 2.5, 1.5);
  goals.OfDriven("A2", "median mm", kUnseen, 3, median, 1.3, 0.8);
  goals.OfDriven(
      "A3", "seen, across the ray, mean mm", kKnown, 2,
      [](const v1::AvatarScore& s) { return s.across_mm(); }, 0.3, 0.2);
  goals.OfDriven(
      "A3", "seen, mean mm", kKnown, 2, [](const v1::AvatarScore& s) { return s.seen_mm(); }, 2.0, 1.3);
  goals.OfDriven(
      "A3", "not seen, mean mm", kKnown, 2, [](const v1::AvatarScore& s) { return s.unseen_mm(); }, 3.5, 2.5);
  goals.OfDriven(
      "A4", "chamfer mm", kKnown, 2, [](const v1::AvatarScore& s) { return s.chamfer_mm(); }, 1.8, 1.3);
}

// A5 to A8: beside other methods, other cameras and the registration.
void AddComparedGoals(v1::AvatarEvaluation& evaluation, Goals& goals) {
  const auto mean = [](const v1::AvatarScore& s) { return s.mean_mm(); };
  for (const char* split : {kKnown, kUnseen}) {
    goals.Over("A5", "mean over that of the carrier", split, 2, "carrier", mean, 0.55, 0.4);
    goals.Over("A5", "mean over that without the net", split, 2, "without net", mean, 0.7, 0.5);
    goals.Over("A5", "mean over that of the preset paper", split, 2, "paper", mean, 0.9, 0.75);
    goals.Over("A6", "mean over that of a skinned carrier + rays", split, 2, "skinned + rays", mean, 1, 0.5);
  }
  goals.Elsewhere(kKnown);
  AddPaperElsewhere(evaluation);
  for (const char* split : {kKnown, kUnseen}) {
    goals.Falls(split);
    goals.FromRegistered(split);
  }
}

// A9.
void AddTremblingGoals(Goals& goals) {
  goals.OfDriven(
      "A9", "trembling, seen, mm", kKnown, 2, [](const v1::AvatarScore& s) { return s.trembling_seen_mm(); },
      0.3, 0.15);
  goals.OfDriven(
      "A9", "trembling, not seen, mm", kKnown, 2,
      [](const v1::AvatarScore& s) { return s.trembling_unseen_mm(); }, 0.6, 0.3);
  goals.Over(
      "A9", "trembling, seen, over that frame by frame", kKnown, 2, "frame by frame",
      [](const v1::AvatarScore& s) { return s.trembling_seen_mm(); }, 0.5, 0.5);
  goals.Over(
      "A9", "trembling, not seen, over that frame by frame", kKnown, 2, "frame by frame",
      [](const v1::AvatarScore& s) { return s.trembling_unseen_mm(); }, 0.5, 0.5);
}

// A10, A11 and X3: what goes wrong in a place, and what sigma says of it.
void AddTrustGoals(Goals& goals) {
  for (const char* split : {kKnown, kUnseen}) {
    goals.Dark(split);
    goals.HandBefore(split);
  }
  for (const char* split : {kKnown, kUnseen}) {
    goals.OfDriven(
        "A11", "errors below 1 sigma, off 68 %", split, 2,
        [](const v1::AvatarScore& s) { return std::abs(100 * s.share_within_sigma() - 68); }, 8, 3);
    goals.OfDriven(
        "A11", "errors below 2 sigma, off 94 %", split, 2,
        [](const v1::AvatarScore& s) { return std::abs(100 * s.share_within_two_sigma() - 94); }, 4, 2);
  }
  for (const char* split : {kKnown, kUnseen}) goals.AtSeams(split);
}

// A12 and A14.
void AddCostGoals(const v1::Avatar& avatar, v1::AvatarEvaluation& evaluation, Goals& goals) {
  // The table's time is that of one core.
  const v1::AvatarScore* timed = FindScore(evaluation, kKnown, 2, "driven");
  if (timed != nullptr && timed->threads() == 1)
    goals.Add("A12", "ms a frame without decoding, one core, 2 cameras", timed->ms_a_frame(), 80, 55);
  if (FindScore(evaluation, kKnown, 2, "driven") != nullptr &&
      FindScore(evaluation, kKnown, 2, "without net") == nullptr)
    evaluation.add_remarks("the avatar has no net, so A5 over carrier + rays + E_Dist is not measured");
  goals.Add("A14", "size of the avatar, MB", BytesOf(avatar) / kMegabyte, 10, 6);
}

}  // namespace

void AddAvatarGoals(const v1::Avatar& avatar, v1::AvatarEvaluation& evaluation) {
  Goals goals(evaluation);
  AddErrorGoals(goals);
  AddComparedGoals(evaluation, goals);
  AddTremblingGoals(goals);
  AddTrustGoals(goals);
  AddCostGoals(avatar, evaluation, goals);
}

std::string AvatarEvaluationText(const v1::AvatarEvaluation& evaluation) {
  int columns = 5, methods = 10;
  for (const v1::AvatarScore& score : evaluation.scores()) {
    columns = std::max(columns, static_cast<int>(score.split().size()));
    methods = std::max(methods, static_cast<int>(score.method().size()));
  }
  std::string out = absl::StrFormat(
      "errors in mm of the vertices; crossed: seen by two cameras and more; tremble: second difference of "
      "the error\nover three frames, of vertices that are seen and not seen; from r.: distance from the "
      "registration;\ncells: seen in a view\n"
      "%-*s  %4s  %-*s  %6s  %7s  %7s  %7s  %7s  %7s  %7s  %7s  %7s  %7s  %5s  %5s  %5s  %7s  %7s  %6s\n",
      columns, "split", "cam.", methods, "method", "frames", "mean", "median", "across", "seen", "crossed",
      "unseen", "chamfer", "tremble", "unseen", "1 s %", "2 s %", "lost", "ms", "from r.", "cells");
  for (const v1::AvatarScore& s : evaluation.scores())
    absl::StrAppendFormat(&out,
                          "%-*s  %4s  %-*s  %6d  %7.3f  %7.3f  %7.3f  %7.3f  %7.3f  %7.3f  %7.3f  %7.3f  "
                          "%7.3f  %5s  %5s  %5d  %7s  %7s  %6s\n",
                          columns, s.split(), s.cameras() > 0 ? absl::StrCat(s.cameras()) : "-", methods,
                          s.method(), s.frames(), s.mean_mm(), s.median_mm(), s.across_mm(), s.seen_mm(),
                          s.crossed_mm(), s.unseen_mm(), s.chamfer_mm(), s.trembling_seen_mm(),
                          s.trembling_unseen_mm(), ShareText(s.share_within_sigma()),
                          ShareText(s.share_within_two_sigma()), s.lost_frames(),
                          s.ms_a_frame() > 0 ? absl::StrFormat("%.1f", s.ms_a_frame()) : "-",
                          s.has_from_registered_mm() ? absl::StrFormat("%.3f", s.from_registered_mm()) : "-",
                          s.cells_a_view() > 0 ? absl::StrFormat("%.0f", s.cells_a_view()) : "-");
  if (evaluation.floor_size() > 0)
    absl::StrAppend(&out, "\nchaos floor: what a shorter time step alone changes, in mm\n");
  for (const v1::AvatarFloor& floor : evaluation.floor())
    absl::StrAppendFormat(&out, "%-28s  %4d frames  mean %.3f  median %.3f  tremble %.3f\n", floor.take(),
                          floor.frames(), floor.mean_mm(), floor.median_mm(), floor.trembling_mm());
  if (evaluation.goals_size() > 0)
    absl::StrAppendFormat(&out, "\n%-4s  %-66s  %8s  %8s  %8s\n", "goal", "what, at most", "value", "must",
                          "aim");
  for (const v1::AvatarGoal& goal : evaluation.goals())
    absl::StrAppendFormat(&out, "%-4s  %-66s  %8.3f  %8.3g  %8.3g  %s\n", goal.id(), goal.what(),
                          goal.value(), goal.must(), goal.aim(),
                          !goal.met()                  ? "missed"
                          : goal.value() <= goal.aim() ? "met, with the aim"
                                                       : "met");
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

absl::Status GoalsStatus(const v1::AvatarEvaluation& evaluation) {
  v1::Verdict verdict;
  int missed = 0;
  for (const v1::AvatarGoal& goal : evaluation.goals()) missed += goal.met() ? 0 : 1;
  if (missed == 0) return absl::OkStatus();
  AddFinding(verdict, v1::GRADE_BAD,
             absl::StrCat(missed, " of ", evaluation.goals_size(), " goals are missed"),
             "Train with more motions, or film with more cameras.");
  return VerdictStatus(verdict);
}

}  // namespace weft
