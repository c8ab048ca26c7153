// take.json: what stands beside the streams of a recorded take.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "capture/take/take_writer.h"
#include "services/studio/recording/recorder.h"
#include "weft/v1/take.pb.h"

namespace weft {

std::string TakeJsonFile(const std::string& take);

// A take that begins now, with a random id.
v1::Take NewTake(const std::string& origin);
// The id as the streams carry it.
uint64_t TakeNumber(const v1::Take& take);

// With its checksum.
absl::Status WriteTakeFile(const std::string& folder, const v1::Take& take);
// NotFound: there is none. DataLoss: it is damaged. Its checksum has been compared and is cleared.
struct TakeFile {
  v1::Take take;
  bool has_checksum = false;  // false: an earlier version wrote it
};
absl::StatusOr<TakeFile> ReadTakeFileStrictly(const std::string& folder);
// Takes whose take.json is missing (a crash at the very start) get one from their streams. DataLoss: it is
// damaged, with the remedy.
absl::StatusOr<v1::Take> ReadTakeFile(const std::string& folder);
// What the heads and ends of the streams tell of the take: all but what receivers counted.
absl::StatusOr<v1::Take> TakeFromStreams(const std::string& folder);

// What a stream's head keeps of take.json: everything of the take and of this camera, the names of the
// others.
std::string StreamDescription(const v1::Take& take, int camera);
// Number and descriptions for the streams of a take that begins. Call it before Recorder::Start.
void DescribeStreams(const v1::Take& take, TakeWriterOptions& options);
// State, cause and totals of a take whose recorder has stopped.
void SetOutcome(const RecorderCounters& counters, v1::Take& take);

// Numbers of a take from its streams and ledger, and the verdict: what `weft take info` shows. A take that is
// so damaged that it cannot be opened gets a verdict alone. NotFound: no recorded take.
absl::StatusOr<v1::TakeInfo> DescribeTake(const std::string& folder);

}  // namespace weft
