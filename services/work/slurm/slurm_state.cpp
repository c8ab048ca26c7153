#include "services/work/slurm/slurm_state.h"

#include <google/protobuf/struct.pb.h>

#include <algorithm>
#include <cmath>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "base/status_macros.h"
#include "services/formats/files/json_file.h"

namespace weft {
namespace {

using google::protobuf::Struct;
using google::protobuf::Value;

constexpr int64_t kMostIndexes = 1'000'000;
constexpr double kLargest = 9e15;  // that a double has without gaps

const Value* FindField(const Struct& object, const char* name) {
  const auto found = object.fields().find(name);
  return found == object.fields().end() ? nullptr : &found->second;
}

absl::Status WrongKind(const char* field) {
  return absl::InvalidArgumentError(absl::StrCat("squeue: ", field, " has a value of an unknown kind"));
}

// None: not set. Later versions write {"set": true, "infinite": false, "number": 3}.
absl::StatusOr<std::optional<int64_t>> ReadNumber(const Struct& object, const char* name) {
  const Value* value = FindField(object, name);
  if (value != nullptr && value->has_struct_value()) {
    const Value* set = FindField(value->struct_value(), "set");
    if (set != nullptr && !set->bool_value()) return std::optional<int64_t>();
    value = FindField(value->struct_value(), "number");
  }
  if (value == nullptr || value->has_null_value()) return std::optional<int64_t>();
  if (!value->has_number_value() || !(std::abs(value->number_value()) < kLargest)) return WrongKind(name);
  return std::optional<int64_t>(static_cast<int64_t>(value->number_value()));
}

absl::Status ReadNumber(const Struct& object, const char* name, int64_t& number) {
  const absl::StatusOr<std::optional<int64_t>> read = ReadNumber(object, name);
  if (read.ok()) number = read->value_or(0);
  return read.status();
}

// The first of a list: later versions list the state and what it is in besides, e.g. COMPLETING.
absl::Status ReadWord(const Struct& object, const char* name, std::string& word) {
  const Value* value = FindField(object, name);
  if (value != nullptr && value->has_list_value()) {
    value = value->list_value().values().empty() ? nullptr : &value->list_value().values(0);
  }
  if (value == nullptr || value->has_null_value()) return absl::OkStatus();
  if (!value->has_string_value()) return WrongKind(name);
  word = value->string_value();
  return absl::OkStatus();
}

// A number of older versions; later ones write {"return_code": {...}, "signal": {"id": {...}}}.
absl::Status ReadWaitStatus(const Struct& object, int64_t& wait_status) {
  const Value* value = FindField(object, "exit_code");
  const Value* signal =
      value != nullptr && value->has_struct_value() ? FindField(value->struct_value(), "signal") : nullptr;
  if (signal == nullptr) return ReadNumber(object, "exit_code", wait_status);
  int64_t code = 0, number = 0;
  absl::Status status = ReadNumber(value->struct_value(), "return_code", code);
  if (status.ok() && signal->has_struct_value()) status = ReadNumber(signal->struct_value(), "id", number);
  wait_status = (code & 0xff) << 8 | (number & 0x7f);
  return status;
}

// The list may end in "...": Slurm prints 64 characters, unless SLURM_BITSTR_LEN says otherwise.
absl::Status ReadWaiting(absl::string_view list, SlurmRecord& record) {
  constexpr absl::string_view kCut = "...";
  list = list.substr(0, list.find('%'));
  if (absl::ConsumeSuffix(&list, kCut)) {
    record.waiting_is_cut = true;
    // The last number may have lost digits.
    const size_t comma = list.rfind(',');
    list = list.substr(0, comma == absl::string_view::npos ? 0 : comma);
    if (list.empty()) return absl::OkStatus();
  }
  absl::StatusOr<std::vector<int64_t>> indexes = ParseArrayIndexes({list.data(), list.size()});
  if (indexes.ok()) record.waiting = *std::move(indexes);
  return indexes.status();
}

absl::Status ReadRecord(const Struct& object, SlurmRecord& record) {
  std::string waiting;
  absl::Status status = ReadNumber(object, "job_id", record.job_id);
  status.Update(ReadNumber(object, "array_job_id", record.array_id));
  status.Update(ReadWord(object, "array_task_string", waiting));
  status.Update(ReadWord(object, "job_state", record.state));
  status.Update(ReadWord(object, "state_reason", record.reason));
  status.Update(ReadWord(object, "batch_host", record.node));
  status.Update(ReadWord(object, "comment", record.comment));
  status.Update(ReadWord(object, "name", record.name));
  status.Update(ReadWaitStatus(object, record.wait_status));
  status.Update(ReadNumber(object, "submit_time", record.submit_unix_s));
  status.Update(ReadNumber(object, "start_time", record.start_unix_s));
  status.Update(ReadNumber(object, "end_time", record.end_unix_s));
  const absl::StatusOr<std::optional<int64_t>> index = ReadNumber(object, "array_task_id");
  status.Update(index.status());
  if (index.ok() && record.array_id > 0) record.index = *index;
  if (!status.ok()) return status;
  if (record.job_id <= 0 || record.state.empty())
    return absl::InvalidArgumentError("squeue: a job without job_id or job_state");
  return waiting.empty() || record.index ? absl::OkStatus() : ReadWaiting(waiting, record);
}

// The errors that the controller's plugin reports; the JSON has no jobs then.
absl::Status ErrorsOf(const Struct& object) {
  const Value* errors = FindField(object, "errors");
  if (errors == nullptr || errors->list_value().values().empty()) return absl::OkStatus();
  std::string words;
  const absl::Status status = ReadWord(errors->list_value().values(0).struct_value(), "description", words);
  return status.ok() ? absl::UnavailableError(absl::StrCat("squeue: ", words.empty() ? "an error" : words))
                     : status;
}

// One word "Name=value" of scontrol.
absl::Status TakeScontrolWord(absl::string_view name, absl::string_view value, SlurmRecord& record) {
  const auto number = [&](int64_t& into) {
    return absl::SimpleAtoi(value, &into)
               ? absl::OkStatus()
               : absl::InvalidArgumentError(absl::StrCat("scontrol: ", name, "=", value, " is no number"));
  };
  if (name == "ArrayJobId") return number(record.array_id);
  if (name == "JobState") record.state = std::string(value);
  if (name == "Reason") record.reason = std::string(value);
  if (name == "BatchHost") record.node = std::string(value);
  if (name == "Comment") record.comment = std::string(value);
  if (name == "JobName") record.name = std::string(value);
  if (name == "ExitCode") {
    const std::pair<absl::string_view, absl::string_view> parts =
        absl::StrSplit(value, absl::MaxSplits(':', 1));
    int code = 0, signal = 0;
    if (!absl::SimpleAtoi(parts.first, &code) || !absl::SimpleAtoi(parts.second, &signal))
      return absl::InvalidArgumentError(absl::StrCat("scontrol: ExitCode=", value));
    record.wait_status = (code & 0xff) << 8 | (signal & 0x7f);
  }
  if (name != "ArrayTaskId") return absl::OkStatus();
  int64_t index = 0;
  if (absl::SimpleAtoi(value, &index) && index >= 0) {
    record.index = index;
    return absl::OkStatus();
  }
  return ReadWaiting(value, record);
}

}  // namespace

bool HasEnded(const std::string& slurm_state) {
  for (const char* going : {"PENDING", "CONFIGURING", "RUNNING", "COMPLETING", "SUSPENDED", "STOPPED",
                            "REQUEUED", "REQUEUE_HOLD", "RESIZING", "SIGNALING", "STAGE_OUT"}) {
    if (slurm_state == going) return false;
  }
  return true;
}

absl::StatusOr<std::vector<SlurmRecord>> ParseSqueue(std::string_view json) {
  Struct object;
  WEFT_RETURN_IF_ERROR(ParseJson(json, "squeue", object));
  WEFT_RETURN_IF_ERROR(ErrorsOf(object));
  const Value* jobs = FindField(object, "jobs");
  if (jobs == nullptr || !jobs->has_list_value())
    return absl::InvalidArgumentError("squeue: its JSON has no list \"jobs\"");
  std::vector<SlurmRecord> records;
  for (const Value& job : jobs->list_value().values()) {
    records.emplace_back();
    records.back().fault = std::string(ReadRecord(job.struct_value(), records.back()).message());
  }
  return records;
}

absl::StatusOr<std::vector<SlurmRecord>> ParseScontrolJobs(std::string_view text) {
  std::vector<SlurmRecord> records;
  for (const absl::string_view word : absl::StrSplit(absl::string_view(text.data(), text.size()),
                                                     absl::ByAnyChar(" \n"), absl::SkipEmpty())) {
    const std::pair<absl::string_view, absl::string_view> parts =
        absl::StrSplit(word, absl::MaxSplits('=', 1));
    if (parts.first == "JobId") {
      records.emplace_back();
      if (!absl::SimpleAtoi(parts.second, &records.back().job_id) || records.back().job_id <= 0)
        return absl::InvalidArgumentError(absl::StrCat("scontrol: ", word));
      continue;
    }
    if (records.empty()) break;
    if (absl::Status status = TakeScontrolWord(parts.first, parts.second, records.back()); !status.ok())
      records.back().fault = std::string(status.message());
  }
  for (SlurmRecord& record : records) {
    if (record.state.empty()) record.fault = "scontrol: a job without JobState";
    if (record.index && record.array_id <= 0) record.fault = "scontrol: ArrayTaskId without ArrayJobId";
  }
  if (records.empty() && text.find("No jobs in the system") == std::string_view::npos)
    return absl::InvalidArgumentError("scontrol: no output of `scontrol show job`");
  return records;
}

absl::StatusOr<std::vector<int64_t>> ParseArrayIndexes(std::string_view text) {
  const absl::Status wrong = absl::InvalidArgumentError(
      absl::StrCat("array indexes \"", absl::string_view(text.data(), text.size()), "\" cannot be read"));
  std::vector<int64_t> indexes;
  const absl::string_view list(text.data(), std::min(text.find('%'), text.size()));
  for (absl::string_view piece : absl::StrSplit(list, ',')) {
    const std::vector<absl::string_view> stepped = absl::StrSplit(piece, ':');
    const std::vector<absl::string_view> ends = absl::StrSplit(stepped.front(), '-');
    int64_t first = 0, last = 0, step = 1;
    if (stepped.size() > 2 || ends.size() > 2 || !absl::SimpleAtoi(ends.front(), &first) ||
        !absl::SimpleAtoi(ends.back(), &last) ||
        (stepped.size() == 2 && !absl::SimpleAtoi(stepped.back(), &step)))
      return wrong;
    if (first < 0 || last < first || step < 1 || last > INT32_MAX) return wrong;
    if (static_cast<int64_t>(indexes.size()) + (last - first) / step >= kMostIndexes) return wrong;
    for (int64_t index = first; index <= last; index += step) indexes.push_back(index);
  }
  return indexes;
}

const SlurmRecord* FindElement(const std::vector<SlurmRecord>& records, int64_t array_id, int64_t index) {
  const SlurmRecord* waits = nullptr;
  for (const SlurmRecord& record : records) {
    if (record.array_id == array_id && record.index == index) return &record;
    if (record.array_id == 0 && record.job_id == array_id && index == 0) return &record;
    if (record.array_id != array_id || record.index) continue;
    const bool is_beyond = record.waiting_is_cut && (record.waiting.empty() || index > record.waiting.back());
    if (is_beyond || std::ranges::count(record.waiting, index) > 0) waits = &record;
  }
  return waits;
}

}  // namespace weft
