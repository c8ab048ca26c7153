#include "capture/sync/ledger.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

const std::vector<LedgerEntry>& Entries() {
  static const std::vector<LedgerEntry> entries = {
      {LedgerEvent::kRecorded, 0, 0, -5, 17, "", ""},
      {LedgerEvent::kMissing, 0, 0, -5, 17, "cam_1", "2 of 80 packets lost; \"cable\", says the switch"},
      {LedgerEvent::kDropped, 1, 900, 33, 18, "", "disk too slow: the queue of 64 MiB is full"},
      {LedgerEvent::kNote, 0, 0, 0, 19, "cam_1", "clock jumped by -3.2 s"},
      {LedgerEvent::kEnd, 0, 0, 0, 20, "", "complete"},
  };
  return entries;
}

std::string Text() {
  std::string text = LedgerHeading();
  uint64_t checksum = LedgerStart();
  for (const LedgerEntry& entry : Entries()) text += ToCsvLine(entry, checksum);
  return text;
}

TEST(Ledger, ReadsBackWhatWasWritten) {
  const auto ledger = ParseLedger(Text());
  ASSERT_TRUE(ledger.ok());
  EXPECT_EQ(ledger->entries, Entries());
  EXPECT_EQ(ledger->damage, "");
  EXPECT_TRUE(ledger->has_checksums);
}

TEST(Ledger, KeepsCausesOnOneLine) {
  uint64_t checksum = LedgerStart();
  const std::string line = ToCsvLine({LedgerEvent::kNote, 1, 1, 2, 3, "", "first\nsecond"}, checksum);
  EXPECT_EQ(line.substr(0, line.rfind(',')), "note,1,1,2,3,,\"first second\"");
}

TEST(Ledger, KeepsWhatStandsBeforeACutAtAnyByte) {
  const std::string text = Text();
  for (size_t size = LedgerHeading().size(); size < text.size(); ++size) {
    const auto ledger = ParseLedger(std::string_view(text).substr(0, size));
    ASSERT_TRUE(ledger.ok());
    EXPECT_EQ(ledger->damage.empty(), text[size - 1] == '\n') << size;
    for (size_t i = 0; i < ledger->entries.size(); ++i) EXPECT_EQ(ledger->entries[i], Entries()[i]);
  }
  EXPECT_FALSE(ParseLedger("something else").ok());
}

TEST(Ledger, SeesEveryFlippedBitAndReadsTheOtherLines) {
  const std::string text = Text();
  for (size_t bit = 0; bit < 8 * text.size(); ++bit) {
    std::string damaged = text;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ 1 << bit % 8);
    const auto ledger = ParseLedger(damaged);
    ASSERT_TRUE(ledger.ok()) << bit;
    EXPECT_NE(ledger->damage, "") << bit;
    EXPECT_GE(ledger->entries.size(), Entries().size() - 2) << bit;  // a line feed joins or parts two lines
  }
}

TEST(Ledger, SeesALineThatIsGone) {
  const std::string text = Text();
  const size_t second = text.find('\n', LedgerHeading().size()) + 1;
  const auto ledger = ParseLedger(LedgerHeading() + text.substr(second));
  ASSERT_TRUE(ledger.ok());
  EXPECT_EQ(ledger->damage, "line 2 is damaged");
}

TEST(LedgerTail, ReadsInPiecesWhatTheWholeSays) {
  const std::string old = "event,first_set,last_set,device_time_ns,host_time_ns,camera,cause\n";
  std::string damaged = Text();
  damaged[damaged.find("cable")] ^= 1;
  for (const std::string& text :
       {Text(), damaged, old + "recorded,0,0,-5,17,,\nnote,0,0,0,9,\"a\",\"b\"\n"}) {
    const auto whole = ParseLedger(text);
    ASSERT_TRUE(whole.ok());
    for (size_t cut = 0; cut < text.size(); ++cut) {
      if (cut > 0 && text[cut - 1] != '\n') continue;
      LedgerTail tail;
      std::vector<LedgerEntry> entries = tail.Add(std::string_view(text).substr(0, cut));
      for (LedgerEntry& entry : tail.Add(std::string_view(text).substr(cut)))
        entries.push_back(std::move(entry));
      EXPECT_EQ(entries, whole->entries) << cut;
    }
  }
}

TEST(Ledger, ReadsThoseWithoutChecksums) {
  const std::string old = "event,first_set,last_set,device_time_ns,host_time_ns,camera,cause\n";
  const auto ledger =
      ParseLedger(old + "recorded,0,0,-5,17,,\nrecorded,1,x,0,0,,\nnote,0,0,0,9,\"a\",\"b\"\n");
  ASSERT_TRUE(ledger.ok());
  EXPECT_FALSE(ledger->has_checksums);
  EXPECT_EQ(ledger->entries.size(), 2u);
  EXPECT_EQ(ledger->damage, "line 3 is damaged");
}

}  // namespace
}  // namespace weft
