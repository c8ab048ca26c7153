#include "capture/ledger.h"

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
  };
  return entries;
}

std::string Text() {
  std::string text = LedgerHeading();
  for (const LedgerEntry& entry : Entries()) text += ToCsvLine(entry);
  return text;
}

TEST(Ledger, ReadsBackWhatWasWritten) {
  const auto ledger = ParseLedger(Text());
  ASSERT_TRUE(ledger.ok());
  EXPECT_EQ(ledger->entries, Entries());
  EXPECT_EQ(ledger->damage, "");
  EXPECT_EQ(ledger->intact_bytes, Text().size());
}

TEST(Ledger, KeepsCausesOnOneLine) {
  const std::string line = ToCsvLine({LedgerEvent::kNote, 1, 1, 2, 3, "", "first\nsecond"});
  EXPECT_EQ(line, "note,1,1,2,3,,\"first second\"\n");
}

TEST(Ledger, KeepsWhatStandsBeforeACutAtAnyByte) {
  const std::string text = Text();
  for (size_t size = LedgerHeading().size(); size < text.size(); ++size) {
    const auto ledger = ParseLedger(std::string_view(text).substr(0, size));
    ASSERT_TRUE(ledger.ok());
    ASSERT_LE(ledger->intact_bytes, size);
    EXPECT_EQ(ledger->damage.empty(), ledger->intact_bytes == size) << size;
    for (size_t i = 0; i < ledger->entries.size(); ++i) EXPECT_EQ(ledger->entries[i], Entries()[i]);
  }
  EXPECT_FALSE(ParseLedger("something else").ok());
}

TEST(Ledger, StopsAtADamagedLine) {
  const auto ledger = ParseLedger(LedgerHeading() + ToCsvLine(Entries()[0]) + "recorded,1,x,0,0,,\n" +
                                  ToCsvLine(Entries()[3]));
  ASSERT_TRUE(ledger.ok());
  EXPECT_EQ(ledger->entries.size(), 1u);
  EXPECT_EQ(ledger->damage, "line 3 is damaged");
}

}  // namespace
}  // namespace weft
