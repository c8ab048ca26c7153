#include "services/work/kinds/unit_kind.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/work/pipeline/register_frame.h"
#include "services/work/pipeline/results_check.h"
#include "services/work/pipeline/stage_keys.h"

namespace weft {
namespace {

template <typename Named>
auto FindNamed(const Named& list, std::string_view name) {
  return std::find_if(list.begin(), list.end(), [name](const auto& one) { return one.name() == name; });
}

StageKeys KeysOfUnits(const std::vector<WorkStage>& stages, const v1::InputHashes& hashes,
                      const WorkArguments& arguments) {
  std::string inputs;
  for (const v1::NamedValue& hash : hashes.work())
    absl::StrAppend(&inputs, hash.name(), " ", hash.value(), "\n");
  StageKeys keys;
  for (const WorkStage& stage : stages) {
    v1::StageKey& key = *keys.Add();
    key.set_stage(stage.name);
    key.set_version(stage.version);
    key.set_inputs(HashOf(inputs));
    key.set_options(HashOf(arguments.OptionsText()));
  }
  return keys;
}

class UnitWork : public Work {
 public:
  UnitWork(WorkKind::Order order, std::unique_ptr<Units> units, std::vector<size_t> range,
           LoadedInputs loaded, StageKeys keys)
      : in_sequence_(order == WorkKind::Order::kInSequence),
        units_(std::move(units)),
        range_(std::move(range)),
        loaded_(std::move(loaded)),
        keys_(std::move(keys)) {}

  const LoadedInputs& inputs() const override { return loaded_; }

  absl::Status Run(const std::vector<size_t>& frames, const WorkPlace& place,
                   const RegistrationEvents& events, const std::stop_token& stop) override {
    std::vector<size_t> asked = frames;
    std::sort(asked.begin(), asked.end());
    std::vector<size_t> todo = asked;
    // Each follows the one before it, which may be read again, or is computed again.
    if (in_sequence_ && !asked.empty()) {
      todo.resize(asked.back() + 1);
      for (size_t i = 0; i < todo.size(); ++i) todo[i] = i;
    }
    std::string state;
    for (const size_t at : todo) {
      if (stop.stop_requested()) return absl::CancelledError("the work was cancelled");
      const bool is_asked = std::binary_search(asked.begin(), asked.end(), at);
      const bool is_quarantined = !is_asked && WasQuarantined(place.out, at);
      if (is_quarantined) continue;
      WEFT_RETURN_IF_ERROR(RunOne(at, place, is_asked ? events : RegistrationEvents{}, stop, state));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<std::vector<IncompleteFrame>> FindIncomplete(
      const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const override {
    const absl::StatusOr<ConfinedFolder> base = ConfinedFolder::Open(job.spec().out());
    if (!base.ok() && !absl::IsNotFound(base.status())) return base.status();
    std::map<std::string, size_t> place_of;
    for (size_t at = 0; at < loaded_.frames.size(); ++at) place_of.emplace(loaded_.frames[at], at);
    std::vector<IncompleteFrame> incomplete;
    std::optional<std::string> state = "";  // none: unknown
    for (size_t i = 0; i < frames.size(); ++i) {
      const auto found = place_of.find(frames[i].frame());
      if (!HasResult(frames[i].state()) || found == place_of.end()) {
        state.reset();
        continue;
      }
      const absl::StatusOr<v1::FrameReport> there = ReportOf(job.spec().out(), found->second);
      if (there.ok() && there->set_aside()) continue;
      const std::string fingerprint = FingerprintOf(found->second);
      const auto cached = Cached(job.spec().out(), found->second, fingerprint, state);
      if (!cached) {
        const bool has_changed = there.ok() && fingerprint != there->images_fingerprint();
        incomplete.push_back({i, "is not as this job wrote it", has_changed});
        state.reset();
        continue;
      }
      if ((cached->state() == v1::FRAME_STATE_FAILED) != (frames[i].state() == v1::FRAME_STATE_FAILED))
        incomplete.push_back({i, "is in another state than its report says", false});
      state = cached->unit().state();
    }
    if (base.ok()) WEFT_RETURN_IF_ERROR(base->Sync());
    return incomplete;
  }

 private:
  // Empty where what it reads cannot be read.
  std::string FingerprintOf(size_t at) const { return units_->Fingerprint(range_[at]).value_or(""); }

  absl::StatusOr<v1::FrameReport> ReportOf(const std::string& out, size_t at) const {
    WEFT_ASSIGN_OR_RETURN(const FrameFolder folder,
                          FrameFolder::Open(out, loaded_.frames[at], ConfinedFolder::IfMissing::kFail));
    return folder.Report();
  }

  bool WasQuarantined(const std::string& out, size_t at) const {
    const absl::StatusOr<v1::FrameReport> report = ReportOf(out, at);
    return report.ok() && report->set_aside();
  }

  // The report of a complete unit that was computed from the same; `state`: of the unit before, where that is
  // known.
  std::optional<v1::FrameReport> Cached(const std::string& out, size_t at, const std::string& fingerprint,
                                        const std::optional<std::string>& state) const {
    const auto folder = FrameFolder::Open(out, loaded_.frames[at], ConfinedFolder::IfMissing::kFail);
    if (!folder.ok()) return std::nullopt;
    absl::StatusOr<v1::FrameReport> report = folder->Report();
    if (!report.ok() || report->frame() != loaded_.frames[at] || !AreEqual(report->keys(), keys_) ||
        report->images_fingerprint() != fingerprint || !folder->CheckAll(*report).empty())
      return std::nullopt;
    if (in_sequence_ && state && report->unit().follows() != HashOf(*state)) return std::nullopt;
    if (!folder->Sync().ok()) return std::nullopt;
    return *std::move(report);
  }

  absl::Status RunOne(size_t at, const WorkPlace& place, const RegistrationEvents& events,
                      const std::stop_token& stop, std::string& state) {
    // Taken first: what changes while it is read must not look like what was read.
    const std::string fingerprint = FingerprintOf(at);
    if (const auto cached = Cached(place.out, at, fingerprint, state)) {
      state = cached->unit().state();
      if (events.finished) events.finished(SummaryOf(*cached, /*reused=*/true));
      return absl::OkStatus();
    }
    const std::string& name = loaded_.frames[at];
    if (events.started) events.started(name);
    const Stopwatch watch;
    WEFT_ASSIGN_OR_RETURN(const FrameFolder folder,
                          FrameFolder::Open(place.out, name, ConfinedFolder::IfMissing::kMake));
    WEFT_RETURN_IF_ERROR(folder.Clear());
    v1::FrameReport report;
    report.set_frame(name);
    report.set_state(v1::FRAME_STATE_DONE);
    *report.mutable_inputs() = loaded_.hashes;
    report.set_weft_version(WEFT_VERSION);
    *report.mutable_keys() = keys_;
    report.set_threads(place.limits.threads);
    report.set_images_fingerprint(fingerprint);
    if (in_sequence_) report.mutable_unit()->set_follows(HashOf(state));
    const auto advance = [&](double share) {
      if (events.advanced) events.advanced(name, share);
    };
    WEFT_RETURN_IF_ERROR(units_->Compute(range_[at], {folder, report, state, advance, stop}));
    if (in_sequence_) report.mutable_unit()->set_state(state);
    report.set_total_ms(watch.Ms());
    WEFT_RETURN_IF_ERROR(folder.Commit(report));
    WEFT_RETURN_IF_ERROR(folder.Sync());
    if (events.finished) events.finished(SummaryOf(report, /*reused=*/false));
    return absl::OkStatus();
  }

  const bool in_sequence_;
  const std::unique_ptr<Units> units_;
  const std::vector<size_t> range_;  // of Units, those that the job asks for
  const LoadedInputs loaded_;
  const StageKeys keys_;
};

absl::Status CheckExpected(const v1::InputHashes& expected, const v1::InputHashes& found) {
  for (const v1::NamedValue& hash : expected.work()) {
    const auto now = FindNamed(found.work(), hash.name());
    if (now != found.work().end() && now->value() == hash.value()) continue;
    return absl::FailedPreconditionError(absl::StrCat("spec.expected.work: ", hash.name(), " has hash ",
                                                      now == found.work().end() ? "none" : now->value(),
                                                      ", expected ", hash.value()));
  }
  return absl::OkStatus();
}

}  // namespace

std::string WorkArguments::Input(std::string_view name) const {
  const auto found = FindNamed(work_.inputs(), name);
  return found == work_.inputs().end() ? "" : found->value();
}

std::string WorkArguments::Text(std::string_view name) const {
  if (const auto found = FindNamed(work_.options(), name); found != work_.options().end())
    return found->value();
  const auto known = FindNamed(info_.options(), name);
  return known == info_.options().end() ? "" : known->preset();
}

double WorkArguments::Number(std::string_view name) const {
  double number = 0;
  return absl::SimpleAtod(Text(name), &number) ? number : 0;
}

bool WorkArguments::Has(std::string_view name) const {
  return FindNamed(work_.options(), name) != work_.options().end();
}

std::string WorkArguments::OptionsText() const {
  std::string text;
  for (const v1::WorkOptionInfo& option : info_.options()) {
    std::vector<std::string> values;
    for (const v1::NamedValue& given : work_.options()) {
      if (given.name() == option.name()) values.push_back(given.value());
    }
    if (values.empty() && !option.preset().empty()) values.push_back(option.preset());
    for (const std::string& value : values) absl::StrAppend(&text, option.name(), "=", value, "\n");
  }
  return text;
}

UnitKind::UnitKind(v1::WorkKindInfo info, Order order, std::vector<WorkStage> stages)
    : info_(std::move(info)), order_(order), stages_(std::move(stages)) {
  const bool all_count = std::all_of(stages_.begin(), stages_.end(), [](const WorkStage& stage) {
    return !stage.name.empty() && stage.version > 0;
  });
  if (stages_.empty() || !all_count) std::abort();
}

std::optional<SpecFault> UnitKind::FaultOf(const v1::RegistrationSpec& spec) const {
  return FaultOfWork(info_, spec.work(), "spec.work");
}

absl::StatusOr<v1::RegistrationOptions> UnitKind::Effective(const v1::RegistrationOptions&) const {
  return v1::RegistrationOptions();
}

absl::StatusOr<std::unique_ptr<Work>> UnitKind::Load(const v1::RegistrationSpec& spec, LoadFor) const {
  if (const auto fault = FaultOf(spec)) {
    return absl::InvalidArgumentError(
        absl::StrCat(fault->field, ": ", fault->why, fault->remedy.empty() ? "" : "; ", fault->remedy));
  }
  const WorkArguments arguments(info_, spec.work());
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<Units> units, Open(arguments));
  const std::vector<std::string> names = units->Names();
  if (names.empty()) return absl::NotFoundError(absl::StrCat(info_.name(), ": its inputs hold no unit"));
  WEFT_ASSIGN_OR_RETURN(std::vector<size_t> range, FramesInRange(spec, names));
  LoadedInputs loaded;
  for (const size_t unit : range) loaded.frames.push_back(names[unit]);
  for (v1::NamedValue& hash : units->Hashes()) *loaded.hashes.add_work() = std::move(hash);
  loaded.warnings = units->Warnings();
  WEFT_RETURN_IF_ERROR(CheckExpected(spec.expected(), loaded.hashes));
  StageKeys keys = KeysOfUnits(stages_, loaded.hashes, arguments);
  return std::make_unique<UnitWork>(order_, std::move(units), std::move(range), std::move(loaded),
                                    std::move(keys));
}

absl::StatusOr<std::vector<IncompleteFrame>> UnitKind::FindIncomplete(
    const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<Work> work, Load(job.spec(), LoadFor::kListing));
  return work->FindIncomplete(job, frames);
}

}  // namespace weft
