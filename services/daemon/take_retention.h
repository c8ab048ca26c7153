// Which takes a daemon clears away, and for how long it remembers jobs.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace weft {

struct RetentionRules {
  double keep_jobs_days = 0;   // ended ones are forgotten later, with results in the state folder; 0: never
  double keep_takes_days = 0;  // older ones go to the trash; 0: any age is kept
  double keep_trash_days = 7;  // then they are removed for good
  double takes_quota_gib = 0;  // takes and trash together; 0: no limit
  double least_free_gib = 0;   // of the disk; 0: nothing is cleared for its sake
};

struct KeptTake {
  std::string id;
  int64_t ended_unix_ns = 0;
  int64_t deleted_unix_ns = 0;  // 0: not in the trash
  uint64_t bytes = 0;
  bool kept = false;  // pinned, being recorded, or read by a job
};

struct RetentionStep {
  std::string id;
  bool remove = false;  // from the trash, for good; otherwise into it
  std::string because;
};

// What is due, in order. Where bytes must go, the trash is emptied first, and then the oldest takes go for
// good.
std::vector<RetentionStep> PlanRetention(const RetentionRules& rules, std::vector<KeptTake> takes,
                                         uint64_t free_bytes, int64_t now_ns);

}  // namespace weft
