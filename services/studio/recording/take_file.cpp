#include "services/studio/recording/take_file.h"

#include <filesystem>
#include <map>
#include <optional>
#include <random>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "capture/file/plain_text.h"
#include "capture/take/recorded_take.h"
#include "capture/take/take_files.h"
#include "capture/take/take_scan.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/verdict/verdict.h"
#include "services/studio/recording/clock_log.h"
#include "services/studio/recording/common_times.h"
#include "services/studio/recording/take_verdict.h"
#include "services/studio/recording/take_words.h"

namespace weft {
namespace {

constexpr std::string_view kNoChecksum = "0000000000000000";

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
  take.set_started_host_time_ns(HostTime_ns());
  take.set_weft_version(WEFT_VERSION);
  take.set_origin(origin);
  return take;
}

uint64_t TakeNumber(const v1::Take& take) {
  uint64_t number = 0;
  return absl::SimpleHexAtoi(take.id(), &number) ? number : 0;
}

absl::Status WriteTakeFile(const std::string& folder, const v1::Take& take) {
  v1::Take sealed = take;
  sealed.set_checksum(std::string(kNoChecksum));
  WEFT_ASSIGN_OR_RETURN(std::string text, ToJson(sealed, JsonZeros::kOmitted));
  const uint64_t checksum = Checksum(text.data(), text.size());
  text.replace(text.rfind(kNoChecksum), kNoChecksum.size(), absl::StrFormat("%016x", checksum));
  return WriteFileAtomically(TakeJsonFile(folder), text);
}

absl::StatusOr<TakeFile> ReadTakeFileStrictly(const std::string& folder) {
  const std::string path = TakeJsonFile(folder);
  WEFT_ASSIGN_OR_RETURN(std::string text, ReadWholeFile(path, kSmallJson.bytes));
  TakeFile file;
  if (absl::Status status = ParseJson(text, path, file.take, kSmallJson); !status.ok())
    return absl::DataLossError(absl::StrCat("damaged: ", EscapedText(std::string(status.message()))));
  const std::string printed = file.take.checksum();
  file.take.clear_checksum();
  if (printed.empty()) return file;
  file.has_checksum = true;
  const size_t place = text.rfind(printed);
  if (printed.size() == kNoChecksum.size() && place != std::string::npos) {
    text.replace(place, printed.size(), kNoChecksum);
    if (absl::StrFormat("%016x", Checksum(text.data(), text.size())) == printed) return file;
  }
  return absl::DataLossError(absl::StrCat(path, ": damaged: its text does not fit its checksum"));
}

absl::StatusOr<v1::Take> ReadTakeFile(const std::string& folder) {
  absl::StatusOr<TakeFile> file = ReadTakeFileStrictly(folder);
  if (file.ok()) return std::move(file->take);
  if (absl::IsNotFound(file.status())) return TakeFromStreams(folder);
  if (!absl::IsDataLoss(file.status())) return file.status();
  return absl::DataLossError(
      absl::StrCat(file.status().message(), "; `weft take recover --force ", folder, "` makes it anew"));
}

absl::StatusOr<v1::Take> TakeFromStreams(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> ids, CamerasWithFiles(folder));
  v1::Take take;
  std::optional<StreamEnd> end;
  std::map<std::string, v1::TakeCamera> details;
  uint64_t number = 0;
  for (const std::string& id : ids) {
    const auto stream = StreamReader::OpenDamaged(StreamFolder(folder), id, 0);
    details[id].set_id(id);
    if (absl::IsNotFound(stream.status())) continue;  // its index is there: a recovery makes a stream of gaps
    if (!stream.ok()) return stream.status();
    if (number == 0) number = (*stream)->header().take;
    if ((*stream)->end()) end = (*stream)->end();
    v1::Take own;
    if (!ParseJson((*stream)->header().description, id, own).ok()) continue;
    for (const v1::TakeCamera& camera : own.cameras())
      if (camera.id() == id) details[id] = camera;
    if (take.cameras().empty()) take = own;
  }
  for (v1::TakeCamera& camera : *take.mutable_cameras()) {
    const auto known = details.find(camera.id());
    if (known == details.end()) continue;
    camera = known->second;
    details.erase(known);
  }
  for (const auto& [id, camera] : details) *take.add_cameras() = camera;
  take.set_id(absl::StrFormat("%016x", number));
  take.set_state(v1::TAKE_STATE_RECORDING);
  if (!end) return take;
  take.set_state(end->outcome == TakeOutcome::kComplete  ? v1::TAKE_STATE_COMPLETE
                 : end->outcome == TakeOutcome::kStopped ? v1::TAKE_STATE_STOPPED
                                                         : v1::TAKE_STATE_RECOVERED);
  take.set_stop_cause(end->cause);
  take.set_ended_host_time_ns(end->ended_host_time_ns);
  take.set_sets_recorded(end->sets_recorded);
  take.set_sets_dropped(end->sets_dropped);
  take.set_frames_missing(end->frames_missing);
  return take;
}

std::string StreamDescription(const v1::Take& take, int camera) {
  v1::Take own = take;
  for (int i = 0; i < own.cameras_size(); ++i) {
    if (i == camera) continue;
    const std::string id = own.cameras(i).id();
    own.mutable_cameras(i)->Clear();
    own.mutable_cameras(i)->set_id(id);
  }
  return ToJson(own, JsonZeros::kOmitted).value_or("");
}

void DescribeStreams(const v1::Take& take, TakeWriterOptions& options) {
  options.take = TakeNumber(take);
  options.descriptions.clear();
  for (int i = 0; i < take.cameras_size(); ++i) options.descriptions.push_back(StreamDescription(take, i));
}

void SetOutcome(const RecorderCounters& counters, v1::Take& take) {
  take.set_state(counters.stop_cause.empty() ? v1::TAKE_STATE_COMPLETE : v1::TAKE_STATE_STOPPED);
  take.set_stop_cause(counters.stop_cause);
  take.set_ended_host_time_ns(HostTime_ns());
  take.set_sets_recorded(counters.sets_recorded);
  take.set_sets_dropped(counters.sets_dropped);
  take.set_frames_missing(counters.frames_missing);
}

absl::StatusOr<v1::TakeInfo> DescribeTake(const std::string& folder) {
  v1::TakeInfo info;
  info.set_path(folder);
  absl::StatusOr<v1::Take> take = ReadTakeFile(folder);
  if (absl::IsDataLoss(take.status())) {
    AddFinding(*info.mutable_verdict(), v1::GRADE_BAD, std::string(take.status().message()),
               RecoverRemedy(folder, true));
    take = TakeFromStreams(folder);
  }
  if (!take.ok()) return take.status();
  *info.mutable_take() = *std::move(take);
  const absl::StatusOr<std::unique_ptr<RecordedTake>> streams = RecordedTake::Open(folder);
  if (absl::IsNotFound(streams.status())) return streams.status();
  if (!streams.ok()) {
    AddFinding(*info.mutable_verdict(), v1::GRADE_BAD, std::string(streams.status().message()),
               RecoverRemedy(folder, true));
    return info;
  }
  info.set_sets((*streams)->sets().size());
  uint64_t bytes = 0;
  for (size_t camera = 0; camera < (*streams)->camera_ids().size(); ++camera)
    for (const IndexRecord& record : (*streams)->stream(camera).records())
      bytes += kBlockBytes + PaddedBytes(record.payload_bytes);
  info.set_bytes(bytes);
  const bool is_closed =
      info.take().state() == v1::TAKE_STATE_COMPLETE || info.take().state() == v1::TAKE_STATE_STOPPED;
  const UsableClockLog clocks = ReadClockLog(folder, {info.take().clocks_checksum(), is_closed});
  if (!clocks.damage.empty())
    AddFinding(*info.mutable_verdict(), v1::GRADE_USABLE, clocks.damage,
               "Put the file of a copy of the take in its place, or run `weft take recover --force`.");
  const CommonTimes times(**streams, clocks.readings, info.take());
  DescribeTiming(**streams, times, info);
  DescribeCauses(**streams, info);
  for (const std::string& warning : (*streams)->warnings()) info.add_warnings(warning);
  AssessTake(**streams, info);
  return info;
}

}  // namespace weft
