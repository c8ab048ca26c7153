#include "capture/sync/ledger.h"
#include "capture/take/take_format.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (const auto index = weft::ParseIndex(bytes); index.ok()) {
    weft::FuzzRequire((index->records.size() + 1) * weft::kIndexRecordBytes + index->ignored_bytes == size);
    std::string again = weft::IndexHeader(index->take);
    for (const weft::IndexRecord& record : index->records) AppendTo(again, record);
    weft::FuzzRequire(again.substr(weft::kIndexRecordBytes) ==
                      bytes.substr(weft::kIndexRecordBytes, again.size() - weft::kIndexRecordBytes));
  }
  if (const auto ledger = weft::ParseLedger(bytes); ledger.ok()) {
    weft::FuzzRequire(ledger->damage.empty() == (ledger->damaged_lines == 0));
    std::string again = weft::LedgerHeading();
    uint64_t checksum = weft::LedgerStart();
    for (const weft::LedgerEntry& entry : ledger->entries) again += ToCsvLine(entry, checksum);
    const auto reread = weft::ParseLedger(again);
    weft::FuzzRequire(reread.ok() && reread->entries.size() == ledger->entries.size());
    weft::FuzzRequire(reread->damaged_lines == 0 && reread->checksum == checksum);
  }
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  std::string index = IndexHeader(5);
  AppendTo(index, {0, 4096, 0, 1, 2, 5000, 77, false});
  AppendTo(index, {1, 16384, 3, 10, 20, 0, 0, true});
  std::string ledger = LedgerHeading();
  uint64_t checksum = LedgerStart();
  for (const LedgerEntry& entry : {LedgerEntry{LedgerEvent::kRecorded, 0, 0, 1, 2, "", ""},
                                   LedgerEntry{LedgerEvent::kDropped, 1, 9, 1, 2, "", "disk \"slow\", full"},
                                   LedgerEntry{LedgerEvent::kMissing, 10, 10, 1, 2, "cam", "lost"},
                                   LedgerEntry{LedgerEvent::kEnd, 0, 10, 0, 2, "", "complete"}})
    ledger += ToCsvLine(entry, checksum);
  const std::string old =
      "event,first_set,last_set,device_time_ns,host_time_ns,camera,cause\n"
      "recorded,0,0,1,2,,\nmissing,0,0,1,2,\"cam\",\"lost\"\n";
  return {index, ledger, old};
}
