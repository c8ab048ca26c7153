#include "services/studio/recording/take_verdict.h"

#include <fcntl.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "capture/take/take_writer.h"
#include "services/formats/verdict/verdict.h"
#include "services/studio/recording/loss_verdict.h"

namespace weft {
namespace {

void CountSets(const RecordedTake& take, v1::TakeInfo& info) {
  uint64_t complete = 0, dropped = 0;
  for (size_t set = 0; set < take.sets().size(); ++set) {
    size_t frames = 0;
    for (size_t camera = 0; camera < take.camera_ids().size(); ++camera) {
      const IndexRecord* record = take.Record(set, camera);
      frames += record != nullptr && !record->is_missing;
    }
    complete += frames == take.camera_ids().size();
  }
  for (const LedgerEntry& entry : take.ledger())
    if (entry.event == LedgerEvent::kDropped) dropped += entry.last_set - entry.first_set + 1;
  info.set_sets_complete(complete);
  info.set_sets_dropped(dropped);
}

void AssessState(const std::string& folder, const v1::Take& take, v1::Verdict& verdict) {
  const std::string cause = take.stop_cause().empty() ? "" : absl::StrCat(": ", take.stop_cause());
  if (take.state() == v1::TAKE_STATE_RECORDING && IsBeingRecorded(folder)) {
    AddFinding(verdict, v1::GRADE_USABLE, "the take is being recorded", "wait for its end");
  } else if (take.state() == v1::TAKE_STATE_RECORDING) {
    AddFinding(verdict, v1::GRADE_BAD, "the take was not closed: its recorder ended in the middle",
               RecoverRemedy(folder, false));
  } else if (take.state() == v1::TAKE_STATE_STOPPED) {
    AddFinding(verdict, v1::GRADE_USABLE, absl::StrCat("the recording stopped early", cause),
               "acknowledged frames are intact; fix the cause and record the rest again");
  } else if (take.frames_lost() > 0) {
    AddFinding(verdict, v1::GRADE_USABLE,
               absl::StrCat(take.frames_lost(), " frames were lost to damage and replaced by gaps"),
               "copy the take's files again from where they are whole, or use the take as it is");
  }
}

bool HasEnd(const RecordedTake& streams) {
  for (size_t i = 0; i < streams.camera_ids().size(); ++i)
    if (streams.stream(i).header().version == 1 || streams.stream(i).end()) return true;
  return false;
}

void AssessStreams(const RecordedTake& streams, v1::TakeInfo& info) {
  v1::Verdict& verdict = *info.mutable_verdict();
  const bool is_closed = info.take().state() != v1::TAKE_STATE_RECORDING;
  const std::vector<std::string>& ids = streams.camera_ids();
  for (const v1::TakeCamera& camera : info.take().cameras()) {
    if (std::ranges::find(ids, camera.id()) != ids.end()) continue;
    AddFinding(verdict, v1::GRADE_BAD, absl::StrCat("camera ", camera.id(), ": its stream is gone"),
               absl::StrCat("copy it again from an intact copy, or replace it by gaps: ",
                            RecoverRemedy(info.path(), is_closed)));
  }
  if (info.take().state() == v1::TAKE_STATE_STOPPED && !HasEnd(streams)) {
    AddFinding(verdict, v1::GRADE_BAD,
               absl::StrCat("the recording stopped early: ", info.take().stop_cause(),
                            "; the disk did not take the end of the streams either"),
               absl::StrCat("make room, and ", RecoverRemedy(info.path(), false)));
    return;
  }
  for (size_t i = 0; is_closed && i < ids.size(); ++i) {
    if (streams.stream(i).header().version == 1 || streams.stream(i).end()) continue;
    AddFinding(verdict, v1::GRADE_BAD, absl::StrCat("camera ", ids[i], ": its stream was cut"),
               absl::StrCat("copy it again from an intact copy, or replace it by gaps: ",
                            RecoverRemedy(info.path(), true)));
  }
  if (is_closed && !streams.warnings().empty())
    AddFinding(verdict, v1::GRADE_BAD, streams.warnings().front(), RecoverRemedy(info.path(), true));
}

}  // namespace

std::string RecoverRemedy(const std::string& folder, bool force) {
  return absl::StrCat("run `weft take recover ", force ? "--force " : "", folder,
                      "`; with --dry-run it only says what it would do");
}

bool IsBeingRecorded(const std::string& folder) {
  return absl::IsFailedPrecondition(OpenLockedLedger(folder, O_RDONLY).status());
}

void AssessTake(const RecordedTake& take, v1::TakeInfo& info) {
  v1::Verdict& verdict = *info.mutable_verdict();
  AssessState(info.path(), info.take(), verdict);
  AssessStreams(take, info);
  CountSets(take, info);
  AssessLosses(info);
}

void AssessCheck(v1::TakeCheckReport& report, bool is_closed) {
  v1::Verdict& verdict = *report.mutable_verdict();
  const int problems = report.problems_size();
  if (problems > 0) {
    AddFinding(
        verdict, v1::GRADE_BAD,
        absl::StrCat(report.problems(0), problems > 1 ? absl::StrCat(" (and ", problems - 1, " more)") : ""),
        absl::StrCat("copy the damaged files again from where they are whole, or keep what is intact: ",
                     RecoverRemedy(report.take(), is_closed)));
  } else if (report.warnings_size() > 0) {
    AddFinding(verdict, v1::GRADE_USABLE, report.warnings(0),
               "the take can be used as it is; check the disk, and the way that the take was copied: a bit "
               "that changes beside the frames may change in them next");
  } else if (report.missing() > 0) {
    AddFinding(verdict, v1::GRADE_USABLE,
               absl::StrCat("whole, and ", report.missing(), " frames are missing, each with its reason"),
               absl::StrCat("`weft take info ", report.take(), "` shows the reasons"));
  } else {
    AddFinding(verdict, v1::GRADE_GOOD, "whole: every frame is as it was recorded", "");
  }
}

void AssessRecovery(v1::TakeRecoveryReport& report) {
  v1::Verdict& verdict = *report.mutable_verdict();
  if (report.frames_lost() > 0) {
    AddFinding(verdict, v1::GRADE_USABLE,
               absl::StrCat(report.frames_lost(), " recorded frames are gone; gaps with their reason ",
                            report.dry_run() ? "would take" : "take", " their places"),
               "where the take was copied from, its files may be whole: copy them again");
  } else if (report.damage_size() > 0) {
    AddFinding(verdict, v1::GRADE_USABLE, absl::StrCat("damage, with no frame lost: ", report.damage(0)), "");
  }
  AddFinding(verdict, v1::GRADE_GOOD,
             report.changes_size() > 0 ? "every frame that was acknowledged is there" : "nothing to do", "");
}

}  // namespace weft
