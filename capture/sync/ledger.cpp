#include "capture/sync/ledger.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "capture/file/checksum.h"

namespace weft {
namespace {

constexpr std::array<std::pair<LedgerEvent, std::string_view>, 5> kEvents = {{
    {LedgerEvent::kRecorded, "recorded"},
    {LedgerEvent::kMissing, "missing"},
    {LedgerEvent::kDropped, "dropped"},
    {LedgerEvent::kNote, "note"},
    {LedgerEvent::kEnd, "end"},
}};

constexpr std::string_view kOldHeading =
    "event,first_set,last_set,device_time_ns,host_time_ns,camera,cause\n";
constexpr size_t kChecksumDigits = 16;

uint64_t Chained(uint64_t before, std::string_view text) {
  std::string bytes(reinterpret_cast<const char*>(&before), sizeof before);
  bytes.append(text);
  return Checksum(bytes.data(), bytes.size());
}

std::string Quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c == '\n' || c == '\r' || c == '\0' ? ' ' : c;
  }
  return out + '"';
}

// The fields of a line; false where quotes are not closed or stand where they may not.
bool Split(std::string_view line, std::vector<std::string>& fields) {
  size_t at = 0;
  while (true) {
    std::string field;
    if (at < line.size() && line[at] == '"') {
      for (++at;; ++at) {
        if (at >= line.size()) return false;
        if (line[at] != '"') {
          field += line[at];
        } else if (at + 1 < line.size() && line[at + 1] == '"') {
          field += line[++at];
        } else {
          break;
        }
      }
      ++at;
      if (at < line.size() && line[at] != ',') return false;
    } else {
      for (; at < line.size() && line[at] != ','; ++at) field += line[at];
    }
    fields.push_back(std::move(field));
    if (at >= line.size()) return true;
    ++at;
  }
}

bool ParseLine(std::string_view line, LedgerEntry& entry) {
  std::vector<std::string> fields;
  if (!Split(line, fields) || fields.size() != 7) return false;
  bool known = false;
  for (const auto& [event, name] : kEvents) {
    if (name != fields[0]) continue;
    entry.event = event;
    known = true;
  }
  entry.camera_id = std::move(fields[5]);
  entry.cause = std::move(fields[6]);
  return known && absl::SimpleAtoi(fields[1], &entry.first_set) &&
         absl::SimpleAtoi(fields[2], &entry.last_set) && absl::SimpleAtoi(fields[3], &entry.device_time_ns) &&
         absl::SimpleAtoi(fields[4], &entry.host_time_ns) && entry.first_set <= entry.last_set;
}

// A line with its checksum in the last column.
bool ParseSealedLine(std::string_view line, LedgerChain& chain, LedgerEntry& entry) {
  const bool is_long = line.size() > kChecksumDigits && line[line.size() - kChecksumDigits - 1] == ',';
  const size_t text = is_long ? line.size() - kChecksumDigits - 1 : line.size();
  const std::string digits(is_long ? line.substr(text + 1) : "");
  uint64_t printed = 0;
  const bool has_digits =
      absl::SimpleHexAtoi(digits, &printed) && digits == absl::StrCat(absl::Hex(printed, absl::kZeroPad16));
  const std::string_view own = line.substr(0, text);
  const LedgerChain before = chain;
  chain = {printed, Chained(before.computed, own)};
  if (!has_digits) return false;
  for (const uint64_t start : {before.computed, before.printed}) {
    if (Chained(start, own) != printed || !ParseLine(own, entry)) continue;
    chain.computed = printed;
    return true;
  }
  return false;
}

}  // namespace

std::string LedgerHeading() {
  return "event,first_set,last_set,device_time_ns,host_time_ns,camera,cause,checksum\n";
}

std::string NameOf(LedgerEvent event) {
  std::string name;
  for (const auto& [known, text] : kEvents)
    if (known == event) name = std::string(text);
  return name;
}

uint64_t LedgerStart() { return Checksum(LedgerHeading().data(), LedgerHeading().size()); }

std::string ToCsvLine(const LedgerEntry& entry, uint64_t& before) {
  const std::string line =
      absl::StrCat(NameOf(entry.event), ",", entry.first_set, ",", entry.last_set, ",", entry.device_time_ns,
                   ",", entry.host_time_ns, ",", entry.camera_id.empty() ? "" : Quoted(entry.camera_id), ",",
                   entry.cause.empty() ? "" : Quoted(entry.cause));
  before = Chained(before, line);
  return absl::StrCat(line, ",", absl::Hex(before, absl::kZeroPad16), "\n");
}

absl::StatusOr<ParsedLedger> ParseLedger(std::string_view csv) {
  ParsedLedger ledger;
  const size_t first_end = csv.find('\n');
  const std::string_view first =
      csv.substr(0, first_end == std::string_view::npos ? csv.size() : first_end + 1);
  const auto damaged = [&](size_t line_number, const char* how) {
    if (ledger.damaged_lines++ == 0) ledger.damage = absl::StrCat("line ", line_number, " is ", how);
  };
  LedgerChain chain;
  size_t at = first.size();
  if (first == kOldHeading) {
    ledger.has_checksums = false;
  } else if (first != LedgerHeading()) {
    const std::string_view second = csv.substr(at, csv.find('\n', at) - at);
    LedgerEntry entry;
    LedgerChain joined = chain;  // where the line feed is damaged, the first line is the end of the heading
    ParseSealedLine(first.substr(0, first_end), joined, entry);
    if (joined.printed != 0) chain.printed = joined.printed;
    LedgerChain of_second = chain;
    ledger.has_checksums = ParseSealedLine(second, of_second, entry);
    if (!ledger.has_checksums && (second.empty() || !ParseLine(second, entry)))
      return absl::InvalidArgumentError("no ledger: the heading of its columns is missing");
    damaged(1, "damaged");
  }
  for (size_t line_number = 2; at < csv.size(); ++line_number) {
    const size_t end = csv.find('\n', at);
    const std::string_view line = csv.substr(at, end == std::string_view::npos ? end : end - at);
    at += line.size() + 1;
    LedgerEntry entry;
    const bool is_whole = ledger.has_checksums ? ParseSealedLine(line, chain, entry) : ParseLine(line, entry);
    if (end == std::string_view::npos) {
      damaged(line_number, "cut off");
    } else if (is_whole) {
      ledger.entries.push_back(std::move(entry));
    } else {
      damaged(line_number, "damaged");
    }
  }
  ledger.checksum = chain.computed;
  return ledger;
}

std::vector<LedgerEntry> LedgerTail::Add(std::string_view lines) {
  std::vector<LedgerEntry> entries;
  for (size_t at = 0; at < lines.size();) {
    const size_t end = std::min(lines.find('\n', at), lines.size());
    const std::string_view line = lines.substr(at, end - at);
    at = end + 1;
    if (columns_ == Columns::kUnknown) {
      columns_ = std::string(line) + "\n" == kOldHeading ? Columns::kOld : Columns::kSealed;
      continue;
    }
    LedgerEntry entry;
    const bool is_whole =
        columns_ == Columns::kOld ? ParseLine(line, entry) : ParseSealedLine(line, chain_, entry);
    if (is_whole) entries.push_back(std::move(entry));
    damaged_lines_ += is_whole ? 0 : 1;
  }
  return entries;
}

}  // namespace weft
