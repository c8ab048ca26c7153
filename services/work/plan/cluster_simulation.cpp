#include "services/work/plan/cluster_simulation.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <set>

#include "absl/strings/str_cat.h"
#include "base/random.h"

namespace weft {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kHour_s = 3600;
constexpr int kMostRepeats = 100;  // of a task in the mean

// A task that waits or runs. Its work is measured in seconds of a file system that nobody else uses.
struct SimulatedTask {
  int frames = 0;
  double work_s = 0;
  double ends_at_work = 0;  // of all tasks' common clock of work
  double began_s = 0;
  int node = 0;
};

class Simulation {
 public:
  Simulation(const ClusterModel& cluster, const JobModel& job, uint64_t seed)
      : cluster_(cluster),
        job_(job),
        random_(seed),
        free_(cluster.nodes, cluster.tasks_per_node),
        back_at_s_(cluster.nodes, 0) {
    for (int left = job.frames; left > 0; left -= job.frames_per_task)
      Enqueue(std::min(left, job.frames_per_task));
    double mean_s = 0;
    for (const double s : job.frame_s) mean_s += s / static_cast<double>(job.frame_s.size());
    demand_mib_per_s_ = mean_s > 0 ? job.mib_per_frame / mean_s : 0;
    next_loss_s_ = DrawLoss();
  }

  SimulatedJob Play() {
    const int most_tasks = kMostRepeats * static_cast<int>(waiting_.size());
    while (!waiting_.empty() || !running_.empty() || !returning_.empty()) {
      if (result_.tasks > most_tasks) {
        result_.wall_s = kNever;
        return result_;
      }
      Step();
    }
    result_.wall_s = now_s_;
    result_.slots_used =
        now_s_ > 0 ? result_.busy_s / (now_s_ * cluster_.nodes * cluster_.tasks_per_node) : 0;
    return result_;
  }

 private:
  struct Sooner {
    bool operator()(const SimulatedTask& a, const SimulatedTask& b) const {
      return a.ends_at_work < b.ends_at_work;
    }
  };
  struct Returning {
    double at_s;
    int frames;
  };

  double Uniform() { return (static_cast<double>(random_.Next() >> 11) + 0.5) / 9007199254740992.0; }

  double DrawLoss() {
    if (cluster_.hours_between_losses <= 0) return kNever;
    return now_s_ - std::log(Uniform()) * cluster_.hours_between_losses * kHour_s / cluster_.nodes;
  }

  void Enqueue(int frames) {
    SimulatedTask task;
    task.frames = frames;
    task.work_s = job_.startup_s;
    for (int i = 0; i < frames; ++i)
      task.work_s += job_.frame_s[random_.Below(static_cast<uint32_t>(job_.frame_s.size()))];
    waiting_.push_back(task);
  }

  // How much longer everything takes since the file system is shared.
  double Stretch() const {
    if (cluster_.shared_mib_per_s <= 0) return 1;
    return std::max(1.0,
                    static_cast<double>(running_.size()) * demand_mib_per_s_ / cluster_.shared_mib_per_s);
  }

  // When the first waiting task can start, and on which node.
  double NextStart(int& node) const {
    if (waiting_.empty()) return kNever;
    double soonest_s = kNever;
    for (int i = 0; i < cluster_.nodes; ++i) {
      if (free_[i] == 0 || back_at_s_[i] >= soonest_s) continue;
      soonest_s = std::max(back_at_s_[i], 0.0);
      node = i;
      if (soonest_s <= now_s_) break;
    }
    return std::max({soonest_s, now_s_, next_start_s_});
  }

  void Step() {
    int node = 0;
    const double start_s = NextStart(node);
    const double end_s =
        running_.empty() ? kNever : now_s_ + (running_.begin()->ends_at_work - work_) * Stretch();
    const double return_s = returning_.empty() ? kNever : returning_.front().at_s;
    const double next_s = std::min({start_s, end_s, return_s, next_loss_s_});
    work_ += (next_s - now_s_) / Stretch();
    now_s_ = next_s;
    if (next_s == end_s) {
      End();
    } else if (next_s == return_s) {
      Enqueue(returning_.front().frames);
      returning_.pop_front();
    } else if (next_s == start_s) {
      StartOn(node);
    } else {
      LoseNode();
    }
  }

  void StartOn(int node) {
    SimulatedTask task = waiting_.front();
    waiting_.pop_front();
    task.node = node;
    task.began_s = now_s_;
    task.ends_at_work = work_ + task.work_s;
    running_.insert(task);
    --free_[node];
    next_start_s_ = now_s_ + (cluster_.starts_per_s > 0 ? 1 / cluster_.starts_per_s : 0);
    ++result_.tasks;
  }

  void End() {
    const SimulatedTask task = *running_.begin();
    running_.erase(running_.begin());
    ++free_[task.node];
    result_.busy_s += now_s_ - task.began_s;
  }

  void LoseNode() {
    const int node = static_cast<int>(random_.Below(static_cast<uint32_t>(cluster_.nodes)));
    next_loss_s_ = DrawLoss();
    if (back_at_s_[node] > now_s_) return;
    ++result_.losses;
    back_at_s_[node] = now_s_ + cluster_.repair_s;
    for (auto it = running_.begin(); it != running_.end();) {
      if (it->node != node) {
        ++it;
        continue;
      }
      const double of_frames_s = it->work_s - job_.startup_s;
      const double done_s = std::max(0.0, it->work_s - (it->ends_at_work - work_) - job_.startup_s);
      const double share = of_frames_s > 0 ? done_s / of_frames_s : 0;
      const int finished = std::min(it->frames - 1, static_cast<int>(share * it->frames));
      const double spent_s = now_s_ - it->began_s;
      result_.busy_s += spent_s;
      result_.lost_s += spent_s - of_frames_s * finished / it->frames;
      returning_.push_back({now_s_ + cluster_.notice_s, it->frames - finished});
      ++free_[node];
      it = running_.erase(it);
    }
  }

  const ClusterModel& cluster_;
  const JobModel& job_;
  Random random_;
  double demand_mib_per_s_ = 0;
  std::deque<SimulatedTask> waiting_;
  std::multiset<SimulatedTask, Sooner> running_;
  std::deque<Returning> returning_;  // in the order of their times
  std::vector<int> free_;            // [nodes] slots
  std::vector<double> back_at_s_;    // [nodes]
  double now_s_ = 0, work_ = 0, next_start_s_ = 0, next_loss_s_ = kNever;
  SimulatedJob result_;
};

}  // namespace

absl::Status ClusterModel::Validate() const {
  const auto wrong = [](const char* field, double value) {
    return absl::InvalidArgumentError(absl::StrCat(field, ": ", value, " is out of range"));
  };
  if (nodes < 1 || nodes > 100000) return wrong("nodes", nodes);
  if (tasks_per_node < 1 || tasks_per_node > 1024) return wrong("tasks_per_node", tasks_per_node);
  for (const auto& [name, value] : {std::pair<const char*, double>{"starts_per_s", starts_per_s},
                                    {"shared_mib_per_s", shared_mib_per_s},
                                    {"hours_between_losses", hours_between_losses},
                                    {"repair_s", repair_s},
                                    {"notice_s", notice_s}}) {
    if (!(value >= 0) || !std::isfinite(value)) return wrong(name, value);
  }
  return absl::OkStatus();
}

SimulatedJob SimulateJob(const ClusterModel& cluster, const JobModel& job, uint64_t seed) {
  return Simulation(cluster, job, seed).Play();
}

}  // namespace weft
