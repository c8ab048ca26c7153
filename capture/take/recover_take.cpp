#include "capture/take/recover_take.h"

#include <fcntl.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/take/stream_repair.h"
#include "capture/take/take_files.h"
#include "capture/take/take_scan.h"
#include "capture/take/take_writer.h"

namespace weft {
namespace {

constexpr const char* kUnfinished = "lost: not on the disk when the recorder ended";

std::string WhereGone(const ScannedStream& stream, uint64_t set) {
  if (!stream.reader) return "lost: the stream is gone";
  const IndexRecord* indexed = stream.Indexed(set);
  const std::vector<IndexRecord>& intact = stream.scan.records;
  const bool is_beyond =
      indexed ? indexed->offset_bytes + kBlockBytes + indexed->payload_bytes > stream.scan.file_bytes
              : intact.empty() || set > intact.back().set;
  return is_beyond ? "lost: the stream ends before it" : "lost: damaged in the stream";
}

// The take as it is, and as it will be.
class Recovery {
 public:
  Recovery(std::string folder, const TakeRecoveryOptions& options, std::vector<ScannedStream> streams,
           absl::StatusOr<ParsedLedger> ledger)
      : folder_(std::move(folder)),
        options_(options),
        streams_(std::move(streams)),
        parsed_(std::move(ledger)),
        aside_(folder_) {
    if (parsed_.ok()) ledger_ = SummaryOf(parsed_->entries);
    sets_ = SetsOf(streams_, ledger_);
    for (const ScannedStream& stream : streams_) {
      if (!stream.reader) continue;
      for (const IndexRecord& record : stream.reader->records()) indexed_.insert(record.set);
    }
  }

  absl::Status Plan();
  absl::Status Apply(PosixFile& ledger);
  TakeRecovery Result() && { return std::move(result_); }

 private:
  StreamHeader HeaderFor(const ScannedStream& stream) const;
  absl::Status PlanOf(const ScannedStream& stream);
  void NoteLost(const ScannedStream& stream, const std::map<std::string, std::vector<uint64_t>>& lost);
  void PlanLedger();
  void PlanDropped();
  absl::Status WriteLedger(PosixFile& file);
  absl::Status ReadMissingReasons();
  // The camera's frame was on the disk. An index is written after its own stream was flushed, maybe before
  // others.
  bool WasOnDisk(const ScannedStream& stream, uint64_t set) const {
    return ledger_.recorded.contains(set) || stream.Indexed(set) || (!parsed_.ok() && indexed_.contains(set));
  }
  TakeEnd End() const;

  const std::string folder_;
  const TakeRecoveryOptions& options_;
  const std::vector<ScannedStream> streams_;
  const absl::StatusOr<ParsedLedger> parsed_;
  SetLedger ledger_;
  std::map<uint64_t, int64_t> sets_;
  std::set<uint64_t> indexed_;  // by any index
  std::vector<StreamPlan> plans_;
  std::map<std::pair<uint64_t, std::string>, std::string> reasons_;  // of every gap of the new streams
  std::vector<LedgerEntry> entries_;
  bool rewrites_ledger_ = false;
  KeptAside aside_;
  TakeRecovery result_;
};

StreamHeader Recovery::HeaderFor(const ScannedStream& stream) const {
  if (stream.file_damage().empty()) return stream.reader->header();
  StreamHeader header{TakeOf(streams_), stream.camera_id, "", kStreamVersion};
  if (header.take == 0) header.take = options_.take;
  for (const ScannedStream& other : streams_)
    if (other.file_damage().empty()) header.version = other.reader->header().version;
  const auto description = options_.descriptions.find(stream.camera_id);
  if (header.version > 1 && description != options_.descriptions.end())
    header.description = description->second;
  return header;
}

// Of frames that the cameras did not deliver: the streams know why.
absl::Status Recovery::ReadMissingReasons() {
  for (const ScannedStream& stream : streams_)
    for (const IndexRecord& record : stream.scan.records) {
      if (!record.is_missing) continue;
      WEFT_ASSIGN_OR_RETURN(const ChunkHeader header, stream.reader->ReadHeader(record));
      reasons_[{record.set, stream.camera_id}] = header.reason;
    }
  return absl::OkStatus();
}

absl::Status Recovery::PlanOf(const ScannedStream& stream) {
  std::vector<PlannedChunk> chunks;
  std::map<std::string, std::vector<uint64_t>> lost;  // by why
  for (const auto& [set, time_ns] : sets_) {
    PlannedChunk& chunk = chunks.emplace_back();
    chunk.set = set;
    chunk.intact = stream.Intact(set);
    result_.frames_missing += !chunk.intact || chunk.intact->is_missing;
    if (chunk.intact) continue;
    const IndexRecord* indexed = stream.Indexed(set);
    chunk.device_time_ns = indexed ? indexed->device_time_ns : time_ns;
    chunk.host_time_ns = indexed ? indexed->host_time_ns : 0;
    const auto known = ledger_.missing.find({set, stream.camera_id});
    if (known != ledger_.missing.end()) {
      chunk.reason = known->second;  // it never was there
    } else if (WasOnDisk(stream, set)) {
      chunk.reason = WhereGone(stream, set);
      ++result_.frames_lost;
      lost[chunk.reason].push_back(set);
    } else {
      chunk.reason = kUnfinished;
      ++result_.frames_unfinished;
    }
    reasons_[{set, stream.camera_id}] = chunk.reason;
  }
  NoteLost(stream, lost);
  WEFT_ASSIGN_OR_RETURN(StreamPlan plan, PlanStream(folder_, stream, HeaderFor(stream), std::move(chunks)));
  result_.cut_bytes += plan.cut_bytes;
  const std::string name = absl::StrCat("streams/", stream.camera_id, ".stream: ");
  if (plan.is_rewritten) {
    result_.changes.push_back(name +
                              (stream.reader ? "written anew, the old one is kept aside" : "made, of gaps"));
  } else if (plan.has_changes()) {
    result_.changes.push_back(absl::StrCat(name, plan.chunks.size() - plan.first_appended, " gaps appended, ",
                                           plan.cut_bytes, " bytes cut and kept aside, ",
                                           plan.needs_index ? "index completed" : "index unchanged"));
  }
  plans_.push_back(std::move(plan));
  return absl::OkStatus();
}

void Recovery::NoteLost(const ScannedStream& stream,
                        const std::map<std::string, std::vector<uint64_t>>& lost) {
  const std::string camera = absl::StrCat("camera ", stream.camera_id, ": ");
  if (stream.reader && !stream.reader->header_damage().empty())
    result_.damage.push_back(camera + stream.reader->header_damage());
  for (const StreamDamage& damage : stream.scan.damage)
    result_.damage.push_back(
        absl::StrCat("camera ", stream.camera_id, ", byte ", damage.offset_bytes, ": ", damage.what));
  for (const auto& [why, sets] : lost)
    result_.damage.push_back(absl::StrCat(camera, sets.size(), sets.size() == 1 ? " frame " : " frames ", why,
                                          " (set ", RangesText(sets), ")"));
}

// Numbers that no set has, where damage to the ledger took lines that said why.
void Recovery::PlanDropped() {
  if (parsed_.ok() && parsed_->damaged_lines == 0) return;
  uint64_t untold = options_.sets_dropped > result_.dropped ? options_.sets_dropped - result_.dropped : 0;
  std::map<uint64_t, uint64_t> known;  // first to last of each line
  for (const LedgerEntry& entry : ledger_.dropped) known[entry.first_set] = entry.last_set;
  uint64_t next = sets_.empty() ? 0 : sets_.begin()->first;
  for (const auto& [set, time_ns] : sets_) {
    for (; next < set && untold > 0; ++next) {
      const auto line = known.upper_bound(next);
      if (line != known.begin() && std::prev(line)->second >= next) continue;
      const bool goes_on = !entries_.empty() && entries_.back().event == LedgerEvent::kDropped &&
                           entries_.back().last_set + 1 == next;
      if (goes_on) entries_.back().last_set = next;
      if (!goes_on)
        entries_.push_back({LedgerEvent::kDropped, next, next, 0, 0, "",
                            "the line of the ledger that said why is damaged or gone"});
      --untold;
      ++result_.dropped;
    }
    next = set + 1;
  }
}

void Recovery::PlanLedger() {
  for (const auto& [set, time_ns] : sets_) {
    if (!ledger_.recorded.contains(set))
      entries_.push_back({LedgerEvent::kRecorded, set, set, time_ns, 0, "", ""});
    for (const ScannedStream& stream : streams_) {
      const auto reason = reasons_.find({set, stream.camera_id});
      if (reason != reasons_.end() && !ledger_.missing.contains(reason->first))
        entries_.push_back({LedgerEvent::kMissing, set, set, time_ns, 0, stream.camera_id, reason->second});
    }
  }
  PlanDropped();
  result_.entries_added = entries_.size();
  rewrites_ledger_ = !parsed_.ok() || parsed_->damaged_lines > 0;
  if (!parsed_.ok()) {
    result_.damage.push_back(
        absl::StrCat("ledger.csv: ", parsed_.status().message(), "; notes and the causes of drops are lost"));
  } else if (parsed_->damaged_lines > 0) {
    result_.damage.push_back(
        absl::StrCat("ledger.csv: ", parsed_->damage, ", ", parsed_->damaged_lines,
                     " in all; what they said of recorded sets is known from the streams"));
  }
  const bool has_v2 = std::any_of(plans_.begin(), plans_.end(),
                                  [](const StreamPlan& plan) { return plan.header.version > 1; });
  const bool lacks_end = has_v2 && !ledger_.has_end;
  if (entries_.empty() && !rewrites_ledger_ && !lacks_end && result_.changes.empty()) return;
  // An older ledger gets the checksums of this version.
  rewrites_ledger_ = rewrites_ledger_ || !parsed_->has_checksums;
  result_.changes.push_back(
      absl::StrCat("ledger.csv: ", rewrites_ledger_ ? "written anew, the old one is kept aside, " : "",
                   entries_.size(), " lines about sets added"));
  entries_.push_back({LedgerEvent::kNote, 0, 0, 0, 0, "",
                      absl::StrCat("recovered: ", result_.brought_back, " frame sets brought back, ",
                                   result_.frames_lost, " acknowledged frames lost, ",
                                   result_.frames_unfinished, " frames of unfinished sets not there")});
  entries_.push_back(
      EndEntry(End(), sets_.empty() ? std::nullopt : std::optional<uint64_t>(sets_.rbegin()->first)));
}

TakeEnd Recovery::End() const {
  TakeEnd end;
  end.outcome = TakeOutcome::kRecovered;
  end.ended_host_time_ns = result_.ended_host_time_ns;
  end.sets_recorded = result_.sets;
  end.sets_dropped = result_.dropped;
  end.frames_missing = result_.frames_missing;
  return end;
}

absl::Status Recovery::Plan() {
  result_.sets = sets_.size();
  result_.dropped = CountDropped(ledger_, sets_);
  for (const auto& [set, time_ns] : sets_) result_.brought_back += !indexed_.contains(set);
  for (const ScannedStream& stream : streams_) {
    for (const IndexRecord& record : stream.scan.records)
      result_.ended_host_time_ns = std::max(result_.ended_host_time_ns, record.host_time_ns);
    if (stream.scan.end)
      result_.ended_host_time_ns = std::max(result_.ended_host_time_ns, stream.scan.end->ended_host_time_ns);
  }
  WEFT_RETURN_IF_ERROR(ReadMissingReasons());
  for (const ScannedStream& stream : streams_) WEFT_RETURN_IF_ERROR(PlanOf(stream));
  PlanLedger();
  return absl::OkStatus();
}

absl::Status Recovery::WriteLedger(PosixFile& file) {
  if (entries_.empty()) return absl::OkStatus();
  uint64_t checksum = parsed_.ok() ? parsed_->checksum : 0;
  std::string text;
  if (rewrites_ledger_) {
    text = LedgerHeading();
    checksum = LedgerStart();
    if (parsed_.ok())
      for (const LedgerEntry& entry : parsed_->entries) text += ToCsvLine(entry, checksum);
  }
  for (const LedgerEntry& entry : entries_) text += ToCsvLine(entry, checksum);
  if (!rewrites_ledger_) {
    WEFT_ASSIGN_OR_RETURN(const uint64_t size, file.Size());
    WEFT_RETURN_IF_ERROR(file.WriteAt(text.data(), text.size(), size));
    return file.SyncData();
  }
  WEFT_RETURN_IF_ERROR(aside_.Keep(LedgerFile(folder_)));
  return ReplaceFile(LedgerFile(folder_), text);
}

absl::Status Recovery::Apply(PosixFile& ledger) {
  const TakeEnd how = End();
  StreamEnd end;
  end.outcome = how.outcome;
  end.ended_host_time_ns = how.ended_host_time_ns;
  end.sets_recorded = how.sets_recorded;
  end.sets_dropped = how.sets_dropped;
  end.frames_missing = how.frames_missing;
  for (const std::string& name : options_.keep) WEFT_RETURN_IF_ERROR(aside_.Keep(folder_ + "/" + name));
  for (const StreamPlan& plan : plans_) WEFT_RETURN_IF_ERROR(ApplyPlan(folder_, plan, end, aside_));
  WEFT_RETURN_IF_ERROR(WriteLedger(ledger));
  result_.kept_aside = aside_.folder();
  return SyncFolder(folder_);
}

}  // namespace

absl::StatusOr<TakeRecovery> RecoverTake(const std::string& folder, const TakeRecoveryOptions& options) {
  if (!IsRecordedTake(folder)) return absl::NotFoundError(absl::StrCat(folder, ": no recorded take"));
  absl::StatusOr<PosixFile> ledger = OpenLockedLedger(folder, options.dry_run ? O_RDONLY : O_RDWR | O_CREAT);
  if (!ledger.ok() && !(options.dry_run && absl::IsNotFound(ledger.status()))) return ledger.status();
  absl::StatusOr<ParsedLedger> parsed = absl::NotFoundError("the file is gone");
  if (ledger.ok()) {
    WEFT_ASSIGN_OR_RETURN(const std::string text, ledger->ReadAll());
    parsed = ParseLedger(text);
    if (text.empty()) parsed = absl::DataLossError("the file is gone or empty");
  }
  WEFT_ASSIGN_OR_RETURN(std::vector<ScannedStream> streams,
                        ScanStreams(folder, options.cameras, options.take));
  Recovery recovery(folder, options, std::move(streams), std::move(parsed));
  WEFT_RETURN_IF_ERROR(recovery.Plan());
  if (!options.dry_run) WEFT_RETURN_IF_ERROR(recovery.Apply(*ledger));
  return std::move(recovery).Result();
}

}  // namespace weft
