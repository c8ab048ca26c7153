// What is read line by line: events of workers, and the ledger of a take that grows. However the bytes
// arrive, they say the same.
#include <algorithm>

#include "capture/sync/ledger.h"
#include "services/work/executor/child_process.h"
#include "services/work/worker/worker_event.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using weft::FuzzRequire;

std::vector<std::string> LinesOf(std::string_view bytes, size_t piece) {
  weft::LineSplitter splitter;
  std::vector<std::string> lines;
  for (size_t at = 0; at < bytes.size(); at += piece) {
    for (std::string& line : splitter.Add(bytes.substr(at, piece))) lines.push_back(std::move(line));
  }
  lines.push_back(splitter.TakeRest());
  return lines;
}

// What is accepted can be printed and is accepted again.
void TryEvent(const std::string& line) {
  const auto event = weft::ParseWorkerEvent(line);
  if (!event.ok()) return;
  const auto again = weft::ParseWorkerEvent(weft::WorkerEventLine(*event));
  FuzzRequire(again.ok() && again->SerializeAsString() == event->SerializeAsString());
}

void TryLedger(std::string_view bytes, size_t piece) {
  const auto whole = weft::ParseLedger(bytes);
  const size_t heading = bytes.find('\n');
  weft::LedgerTail tail;
  std::vector<weft::LedgerEntry> entries;
  size_t given = 0;
  for (size_t at = 0; at < bytes.size(); at += piece) {
    const size_t known = std::min(at + piece, bytes.size());
    const size_t end = bytes.substr(0, known).rfind('\n');
    if (end == std::string_view::npos || end + 1 <= given) continue;
    for (weft::LedgerEntry& entry : tail.Add(bytes.substr(given, end + 1 - given)))
      entries.push_back(std::move(entry));
    given = end + 1;
  }
  // Where the heading is damaged, the whole knows more than one line at a time.
  if (whole.ok() && heading != std::string_view::npos && whole->damage != "line 1 is damaged")
    FuzzRequire(entries == whole->entries);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const size_t piece = 1 + data[0];
  const std::vector<std::string> lines = LinesOf(bytes, piece);
  FuzzRequire(lines == LinesOf(bytes, bytes.size() + 1));
  for (const std::string& line : lines) TryEvent(line);
  TryLedger(bytes, piece);
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  uint64_t checksum = LedgerStart();
  std::string ledger = LedgerHeading();
  ledger += ToCsvLine({LedgerEvent::kRecorded, 0, 0, -5, 17, "", ""}, checksum);
  ledger +=
      ToCsvLine({LedgerEvent::kMissing, 0, 0, -5, 17, "cam_1", "2 of 80 packets lost; \"cable\""}, checksum);
  ledger += ToCsvLine({LedgerEvent::kEnd, 0, 0, 0, 20, "", "complete"}, checksum);
  return {"\x05" + ledger,
          "\x10"
          "event,first_set,last_set,device_time_ns,host_time_ns,camera,cause\n"
          "recorded,0,0,-5,17,,\nnote,0,0,0,9,\"a\",\"b\"\n",
          "\x20{\"started\": {\"frame\": \"0001\"}}\n{\"advanced\": {\"frame\": \"0001\", \"share_done\": "
          "0.5}}\n",
          "\x07{\"finished\": {\"frame\": \"0001\", \"state\": \"FRAME_STATE_DONE\", \"coverage\": 0.5}}\n"
          "{\"error\": {\"code\": \"RESOURCE_EXHAUSTED\", \"message\": \"disk\"}}\n"};
}
