#include "capture/ledger.h"

#include <array>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr std::array<std::pair<LedgerEvent, std::string_view>, 4> kEvents = {{
    {LedgerEvent::kRecorded, "recorded"},
    {LedgerEvent::kMissing, "missing"},
    {LedgerEvent::kDropped, "dropped"},
    {LedgerEvent::kNote, "note"},
}};

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

}  // namespace

std::string LedgerHeading() { return "event,first_set,last_set,device_time_ns,host_time_ns,camera,cause\n"; }

std::string ToCsvLine(const LedgerEntry& entry) {
  std::string name;
  for (const auto& [event, text] : kEvents)
    if (event == entry.event) name = std::string(text);
  return absl::StrCat(name, ",", entry.first_set, ",", entry.last_set, ",", entry.device_time_ns, ",",
                      entry.host_time_ns, ",", entry.camera_id.empty() ? "" : Quoted(entry.camera_id), ",",
                      entry.cause.empty() ? "" : Quoted(entry.cause), "\n");
}

absl::StatusOr<ParsedLedger> ParseLedger(std::string_view csv) {
  const std::string heading = LedgerHeading();
  if (csv.substr(0, heading.size()) != heading) {
    return absl::InvalidArgumentError("no ledger: the heading of its columns is missing");
  }
  ParsedLedger ledger;
  ledger.intact_bytes = heading.size();
  for (size_t line_number = 2; ledger.intact_bytes < csv.size(); ++line_number) {
    const size_t end = csv.find('\n', ledger.intact_bytes);
    LedgerEntry entry;
    if (end == std::string_view::npos) {
      ledger.damage = absl::StrCat("line ", line_number, " is cut off");
      break;
    }
    if (!ParseLine(csv.substr(ledger.intact_bytes, end - ledger.intact_bytes), entry)) {
      ledger.damage = absl::StrCat("line ", line_number, " is damaged");
      break;
    }
    ledger.entries.push_back(std::move(entry));
    ledger.intact_bytes = end + 1;
  }
  return ledger;
}

}  // namespace weft
