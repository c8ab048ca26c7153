// What an operator sees of a running job, wherever it runs.
#pragma once

#include <map>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "services/tools/cli/progress.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Draws a progress bar with the remaining time and prints a line per finished frame, on stderr. A failed
// frame gets a second line when it is bridged. Why results of an earlier run are computed again is printed
// once.
class JobView {
 public:
  // `label` of the bar: the kind of work.
  explicit JobView(bool quiet, const std::string& label = "register");

  void Show(const v1::JobUpdate& update);

 private:
  void Announce(const v1::FrameInfo& info);

  const bool quiet_;
  bool has_coverage_ = true;
  Progress progress_;
  std::map<std::string, double> share_of_running_;
  std::set<std::string> redone_;  // what was told of earlier results
};

// "queued", "running" ...; of operations too.
const char* JobStateWord(v1::JobState state);

// "0007  degraded  93.2 % of the cells  1.8 s  (2 of 24 cameras have no usable image)"; without the cells
// of kinds of which they say nothing (WorkKind::has_coverage).
std::string FrameLine(const v1::FrameInfo& info, bool has_coverage);

// "10 of 12 frames registered (2 with cameras missing), 1 bridged, 1 failed". A bridged frame is no failed
// one here: it failed, and has a mesh from the frames around it. Other kinds of jobs have their own word.
std::string JobText(const v1::Job& job);

// What decides the exit status: the verdict, or that it was cancelled.
absl::Status OutcomeOf(const v1::Job& job);

}  // namespace weft
