// What is said of takes, wherever it is said.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "capture/take/recorded_take.h"
#include "weft/v1/take.pb.h"

namespace weft {

// 17953431873: "17,953,431,873".
std::string WithSeparators(uint64_t count);

// "29 s", "12 min", "2.7 h".
std::string Duration(double seconds);

// "76 GB free: 2.7 h at this session's 7.9 MB/s (29 s at the disk's full speed)"; without what is 0.
std::string RoomText(double free_bytes, double session_bytes_per_s, double disk_bytes_per_s,
                     double kept_bytes = 0);

// "c01", "c01 and c02", "c01, c02, c03 and 21 more".
std::string NamesInShort(const std::vector<std::string>& names);

// Fills `causes` and `notes` from the ledger. Causes of a camera that differ in their numbers alone are one,
// which gives the range of each number.
void DescribeCauses(const RecordedTake& take, v1::TakeInfo& info);

// Why frames and frame sets are not in the take, a line each; the greatest losses first. Cameras with the
// same cause are one line.
std::vector<std::string> CauseLines(const google::protobuf::RepeatedPtrField<v1::TakeCause>& causes);

// "c01: text" per pair of camera and text; cameras with the same text are one line.
std::vector<std::string> CameraLines(const std::vector<std::pair<std::string, std::string>>& said,
                                     size_t cameras);

}  // namespace weft
