#include "services/server/catalogue/salvage.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/server/catalogue/catalogue_rows.h"
#include "services/server/catalogue/wal_file.h"

namespace weft {
namespace {

constexpr int64_t kMaxGap = 1'000'000;  // keys that are tried one by one between two damaged pages

bool HasEnded(v1::JobState state) { return state != v1::JOB_STATE_QUEUED && state != v1::JOB_STATE_RUNNING; }

// How far a job or frame has come: a later one replaces an earlier one.
int Progress(const v1::Job& job) { return HasEnded(job.state()) ? 2 : job.state() == v1::JOB_STATE_RUNNING; }

int64_t Progress(const v1::FrameInfo& info) {
  constexpr int64_t kProcessed = int64_t{1} << 40;
  const bool open = info.state() == v1::FRAME_STATE_WAITING || info.state() == v1::FRAME_STATE_RUNNING;
  return (open ? 0 : kProcessed) + info.attempts();
}

template <typename Message>
bool IsFurther(const std::optional<Message>& message, const std::optional<Message>& than) {
  return message && (!than || Progress(*message) > Progress(*than));
}

class Reader {
 public:
  Reader(Database& database, int64_t version) : database_(database), version_(version) {}

  StoredCatalogue Read() {
    ReadJobs();
    ReadFrames();
    return std::move(stored_);
  }

 private:
  using OnRow = std::function<void(const Statement&)>;

  // False: a damaged page ended it.
  bool Rows(const std::string& sql, const OnRow& on_row) {
    absl::StatusOr<Statement> select = database_.Prepare(sql);
    absl::StatusOr<bool> row = select.ok() ? select->Step() : select.status();
    for (; row.ok() && *row; row = select->Step()) on_row(*select);
    if (!row.ok()) Complain(std::string(row.status().message()));
    return row.ok();
  }

  void Complain(const std::string& what) {
    if (stored_.damage.empty()) stored_.damage = what;
  }

  void ReadJobs() {
    const std::string select = absl::StrCat("SELECT ", JobColumns(version_), " FROM jobs");
    int64_t first_gap = 0, end_gap = 0;
    const auto forward = [&](const Statement& row) { AddJob(JobRowOf(row)), first_gap = row.Int(0) + 1; };
    if (Rows(select + " ORDER BY sequence", forward)) return;
    const auto backward = [&](const Statement& row) { AddJob(JobRowOf(row)), end_gap = row.Int(0); };
    Rows(select + " ORDER BY sequence DESC", backward);
    for (int64_t s = first_gap; s < std::min(end_gap, first_gap + kMaxGap); ++s)
      Rows(absl::StrCat(select, " WHERE sequence = ", s), backward);
  }

  void ReadFrames() {
    const std::string select = absl::StrCat("SELECT ", FrameColumns(version_), " FROM frames");
    const auto add = [this](const Statement& row) { AddFrame(FrameRowOf(row)); };
    if (Rows(select + " ORDER BY job_id, position", add)) return;
    Rows(select + " ORDER BY job_id DESC, position DESC", add);
    for (auto& [id, job] : stored_.jobs) {
      const int64_t total = job.job ? job.job->frames().total() : 0;
      if (static_cast<int64_t>(job.frames.size()) == total) continue;
      for (int64_t position = 0; position < std::min(total, kMaxGap); ++position) {
        if (!job.frames.contains(position)) ReadFrame(select, id, position, add);
      }
    }
  }

  void ReadFrame(const std::string& select, const std::string& id, int64_t position, const OnRow& add) {
    absl::StatusOr<Statement> one = database_.Prepare(select + " WHERE job_id = ? AND position = ?");
    if (!one.ok()) return;
    one->BindText(1, id).Bind(2, position);
    if (const absl::StatusOr<bool> row = one->Step(); row.ok() && *row) add(*one);
  }

  void AddJob(const JobRow& row) {
    absl::StatusOr<v1::Job> job = ReadRow(row, version_);
    if (!job.ok()) Complain(std::string(job.status().message()));
    StoredJob& stored = stored_.jobs[job.ok() ? job->id() : row.id];
    stored.sequence = row.sequence;
    if (job.ok()) stored.job = *std::move(job);
  }

  void AddFrame(const FrameRow& row) {
    absl::StatusOr<v1::FrameInfo> info = ReadRow(row, version_);
    if (!info.ok()) Complain(std::string(info.status().message()));
    constexpr int64_t kMaxFrames = 1 << 24;
    if (row.position < 0 || row.position > kMaxFrames) return;
    StoredFrame& frame = stored_.jobs[row.job_id].frames[row.position];
    if (frame.info) return;  // a sound one was found already
    frame.name = IsPlainText(row.name) ? row.name : "";
    if (info.ok()) frame = {info->frame(), *std::move(info)};
  }

  Database& database_;
  const int64_t version_;
  StoredCatalogue stored_;
};

// SQLite's header, and where the tables begin: the same in every catalogue of a version.
absl::Status GraftFirstPage(const std::string& path, int64_t version) {
  const std::string donor = path + ".donor";
  const absl::Cleanup remove = [&donor] { RemoveDatabase(donor); };
  {
    WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<Database> database, Database::Open(donor));
    WEFT_RETURN_IF_ERROR(MakeTables(*database, version));
  }
  constexpr size_t kPageBytes = 4096;
  constexpr size_t kFreePages = 32, kFreePagesBytes = 8, kSizeValidFor = 92;
  std::string page(kPageBytes, '\0');
  std::ifstream(donor, std::ios::binary).read(page.data(), kPageBytes);
  // No free pages, and the size is that of the file.
  std::fill_n(page.begin() + kFreePages, kFreePagesBytes, '\0');
  page[kSizeValidFor] = static_cast<char>(~page[kSizeValidFor]);
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.write(page.data(), kPageBytes);
  file.close();
  return file.good() ? absl::OkStatus() : absl::UnavailableError(absl::StrCat(path, ": cannot be written"));
}

size_t CountIntact(const StoredCatalogue& stored) {
  size_t count = 0;
  for (const auto& [id, job] : stored.jobs) {
    count += job.job.has_value();
    for (const auto& [position, frame] : job.frames) count += frame.info.has_value();
  }
  return count;
}

StoredCatalogue ReadCopy(const std::string& path, int64_t graft_version) {
  StoredCatalogue none;
  if (graft_version != 0) {
    if (const absl::Status status = GraftFirstPage(path, graft_version); !status.ok()) {
      none.damage = std::string(status.message());
      return none;
    }
  }
  const absl::StatusOr<std::unique_ptr<Database>> database = Database::Open(path);
  if (!database.ok()) {
    none.damage = std::string(database.status().message());
    return none;
  }
  const absl::StatusOr<int64_t> version = (*database)->ReadPragma("user_version");
  return ReadStored(**database, version.ok() && *version == kFirstSchemaVersion ? *version : kSchemaVersion);
}

v1::Job MakeLostJob(const std::string& id, const std::string& remedy) {
  v1::Job job;
  job.set_id(id);
  job.set_state(v1::JOB_STATE_FAILED);
  job.set_message(
      absl::StrCat("the catalogue's entry of this job was damaged; its results are where it wrote them, "
                   "and a new job with the same inputs keeps them; ",
                   remedy));
  return job;
}

RestoredJob Restore(const std::string& id, const StoredJob& stored, const std::string& remedy) {
  RestoredJob restored{stored.job ? *stored.job : MakeLostJob(id, remedy), {}};
  v1::Job& job = restored.job;
  const bool ended = HasEnded(job.state());
  const int64_t total = std::max<int64_t>(stored.job ? job.frames().total() : 0,
                                          stored.frames.empty() ? 0 : stored.frames.rbegin()->first + 1);
  int lost = 0;
  for (int64_t position = 0; position < total; ++position) {
    const auto found = stored.frames.find(position);
    if (found != stored.frames.end() && found->second.info) {
      restored.frames.emplace_back(position, *found->second.info);
      continue;
    }
    ++lost;
    if (ended) continue;
    // Its name comes from the inputs when "" (JobQueue::Resume).
    v1::FrameInfo info;
    if (found != stored.frames.end()) info.set_frame(found->second.name);
    info.set_state(v1::FRAME_STATE_WAITING);
    restored.frames.emplace_back(position, std::move(info));
  }
  if (ended && lost > 0) {
    job.add_warnings(absl::StrCat("the catalogue's entries of ", lost,
                                  " of its frames were damaged; results are in ", job.spec().out(), "; ",
                                  remedy));
  }
  return restored;
}

}  // namespace

StoredCatalogue ReadStored(Database& database, int64_t version) { return Reader(database, version).Read(); }

absl::StatusOr<StoredCatalogue> SalvageFile(const std::string& path, const std::string& scratch) {
  const absl::Cleanup remove = [&scratch] { RemoveDatabase(scratch); };
  StoredCatalogue best;
  for (const int64_t graft_version : {int64_t{0}, kSchemaVersion, kFirstSchemaVersion}) {
    RemoveDatabase(scratch);
    std::error_code error;
    std::filesystem::copy_file(path, scratch, error);
    if (error == std::errc::no_space_on_device) {
      return absl::ResourceExhaustedError(absl::StrCat(
          path,
          ": damaged, and there is no room to restore it; make room on the disk and start weftd again"));
    }
    if (const absl::StatusOr<WalFile> wal = ReadWalFile(path + "-wal"); wal.ok()) {
      WEFT_RETURN_IF_ERROR(ApplyWal(*wal, scratch));
    }
    if (FileBytes(scratch) == 0) break;
    StoredCatalogue found = ReadCopy(scratch, graft_version);
    const bool whole = found.damage.empty() && !found.jobs.empty();
    const size_t intact = CountIntact(found);
    if (intact > CountIntact(best)) best = std::move(found);
    if (whole || (graft_version != 0 && intact > 0)) break;
  }
  return best;
}

int Complete(StoredCatalogue& stored, const StoredCatalogue& other) {
  std::erase_if(stored.jobs, [&other](const auto& entry) {
    const bool intact = entry.second.job || std::ranges::any_of(entry.second.frames, [](const auto& frame) {
                          return frame.second.info.has_value();
                        });
    return !intact && !other.jobs.contains(entry.first);
  });
  int added = 0;
  for (const auto& [id, theirs] : other.jobs) {
    const auto [found, is_new] = stored.jobs.emplace(id, theirs);
    added += is_new;
    StoredJob& ours = found->second;
    if (is_new) continue;
    if (IsFurther(theirs.job, ours.job)) ours.job = theirs.job;
    if (ours.sequence == 0) ours.sequence = theirs.sequence;
    for (const auto& [position, frame] : theirs.frames) {
      StoredFrame& own = ours.frames[position];
      if (IsFurther(frame.info, own.info) || (!own.info && own.name.empty())) own = frame;
    }
  }
  return added;
}

bool IsBehind(const StoredCatalogue& stored, const StoredCatalogue& other) {
  for (const auto& [id, theirs] : other.jobs) {
    const auto ours = stored.jobs.find(id);
    if (ours == stored.jobs.end() || IsFurther(theirs.job, ours->second.job)) return true;
  }
  return false;
}

std::vector<RestoredJob> RestoreJobs(const StoredCatalogue& stored, const std::string& remedy) {
  std::vector<std::pair<int64_t, std::string>> order;
  for (const auto& [id, job] : stored.jobs) {
    // An id that is none belongs to a damaged row that nothing else tells of.
    if (job.job || (!id.empty() && IsPlainText(id))) order.emplace_back(job.sequence, id);
  }
  std::ranges::sort(order);
  std::vector<RestoredJob> jobs;
  for (const auto& [sequence, id] : order) jobs.push_back(Restore(id, stored.jobs.at(id), remedy));
  return jobs;
}

}  // namespace weft
