#include "services/recording/take_file.h"

#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <random>
#include <regex>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/recorded_take.h"
#include "services/files/json_file.h"
#include "services/recording/clock_log.h"
#include "services/recording/common_times.h"

namespace weft {
namespace {

// A cause of the ledger, or several that differ in their numbers alone.
struct Cause {
  std::string text;
  uint64_t count = 0;
};

void DescribeCauses(const RecordedTake& take, v1::TakeInfo& info) {
  const std::regex number("[0-9]+([.][0-9]+)?");
  std::map<std::pair<std::string, std::string>, Cause> causes;
  const auto add = [&](const std::string& camera_id, const std::string& text, uint64_t count) {
    const std::string without_numbers = std::regex_replace(text, number, "*");
    Cause& cause = causes[{camera_id, without_numbers}];
    cause.text = cause.count == 0 || cause.text == text ? text : without_numbers;
    cause.count += count;
  };
  for (const LedgerEntry& entry : take.ledger()) {
    if (entry.event == LedgerEvent::kMissing) add(entry.camera_id, entry.cause, 1);
    if (entry.event == LedgerEvent::kDropped) add("", entry.cause, entry.last_set - entry.first_set + 1);
    if (entry.event == LedgerEvent::kNote)
      info.add_notes(entry.camera_id.empty() ? entry.cause
                                             : absl::StrCat("camera ", entry.camera_id, ": ", entry.cause));
  }
  for (const auto& [key, found] : causes) {
    v1::TakeCause& cause = *info.add_causes();
    cause.set_camera(key.first);
    cause.set_cause(found.text);
    cause.set_count(found.count);
  }
}

}  // namespace

std::string TakeJsonFile(const std::string& take) {
  return (std::filesystem::path(take) / "take.json").string();
}

v1::Take NewTake(const std::string& origin) {
  std::random_device random;
  const uint64_t number = (uint64_t{random()} << 32 | random()) | 1;
  v1::Take take;
  take.set_id(absl::StrFormat("%016x", number));
  take.set_state(v1::TAKE_STATE_RECORDING);
  take.set_started_host_time_ns(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                    std::chrono::system_clock::now().time_since_epoch())
                                    .count());
  take.set_weft_version(WEFT_VERSION);
  take.set_origin(origin);
  return take;
}

uint64_t TakeNumber(const v1::Take& take) {
  uint64_t number = 0;
  return absl::SimpleHexAtoi(take.id(), &number) ? number : 0;
}

absl::Status WriteTakeFile(const std::string& folder, const v1::Take& take) {
  return WriteJsonFile(TakeJsonFile(folder), take, JsonZeros::kOmitted);
}

absl::StatusOr<v1::Take> ReadTakeFile(const std::string& folder) {
  v1::Take take;
  const absl::Status status = ReadJsonFile(TakeJsonFile(folder), take);
  if (status.ok()) return take;
  if (!absl::IsNotFound(status)) return status;
  const absl::StatusOr<std::unique_ptr<RecordedTake>> streams = RecordedTake::Open(folder);
  if (!streams.ok()) return streams.status();
  take.set_id(absl::StrFormat("%016x", (*streams)->take()));
  take.set_state(v1::TAKE_STATE_RECORDING);
  for (const std::string& id : (*streams)->camera_ids()) take.add_cameras()->set_id(id);
  return take;
}

absl::StatusOr<v1::TakeInfo> DescribeTake(const std::string& folder) {
  const absl::StatusOr<std::unique_ptr<RecordedTake>> streams = RecordedTake::Open(folder);
  if (!streams.ok()) return streams.status();
  absl::StatusOr<v1::Take> take = ReadTakeFile(folder);
  if (!take.ok()) return take.status();
  v1::TakeInfo info;
  info.set_path(folder);
  *info.mutable_take() = *std::move(take);
  info.set_sets((*streams)->sets().size());
  uint64_t bytes = 0;
  for (size_t camera = 0; camera < (*streams)->camera_ids().size(); ++camera)
    for (const IndexRecord& record : (*streams)->stream(camera).records())
      bytes += kBlockBytes + PaddedBytes(record.payload_bytes);
  info.set_bytes(bytes);
  const absl::StatusOr<std::vector<LoggedReading>> readings = ReadClockLog(folder);
  const CommonTimes times(**streams, readings.value_or(std::vector<LoggedReading>{}), info.take());
  DescribeTiming(**streams, times, info);
  DescribeCauses(**streams, info);
  for (const std::string& warning : (*streams)->warnings()) info.add_warnings(warning);
  if (info.take().state() == v1::TAKE_STATE_RECORDING) {
    info.add_warnings(
        absl::StrCat("the take was not closed: it is being recorded, or its recorder crashed; then run "
                     "`weft take recover ",
                     folder, "`"));
  }
  return info;
}

}  // namespace weft
