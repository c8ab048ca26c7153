#include "capture/file/plain_text.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(PlainText, ReadableTextOfAnyLanguageStaysAsItIs) {
  for (const char* text :
       {"", "c01", "J\xc3\xbcrgen", "\xe5\xb8\x83", "\xf0\x9f\xa7\xb5", "\\x41 \"quoted\""}) {
    EXPECT_TRUE(IsPlainText(text)) << text;
    EXPECT_EQ(EscapedText(text), text);
  }
}

TEST(PlainText, BytesThatAreNoneAreEscapedAndTheRestIsKept) {
  EXPECT_EQ(EscapedText("c\xff\xfe.png"), "c\\xff\\xfe.png");
  EXPECT_EQ(EscapedText("\xc3"), "\\xc3");                      // cut in the middle
  EXPECT_EQ(EscapedText("\xc0\xaf"), "\\xc0\\xaf");             // overlong
  EXPECT_EQ(EscapedText("\xed\xa0\x80z"), "\\xed\\xa0\\x80z");  // surrogate
  EXPECT_EQ(EscapedText("a\nb\x1b[2J"), "a\\x0ab\\x1b[2J");
  EXPECT_EQ(EscapedText("\xc2\x9b"), "\\xc2\\x9b");  // C1
  for (const char* text : {"\xff", "a\nb", "\x7f", "\xc2\x9b"})
    EXPECT_FALSE(IsPlainText(text)) << EscapedText(text);
  EXPECT_TRUE(IsUtf8("a\nb"));
  EXPECT_FALSE(IsUtf8("a\xff"));
}

TEST(PlainText, MessagesKeepTheirLinesAndTheirBeginning) {
  EXPECT_EQ(MessageText("two\nlines\x1b[2J\n"), "two\nlines\\x1b[2J\n");
  EXPECT_EQ(MessageText("rig.json: unknown field"), "rig.json: unknown field");
  EXPECT_EQ(MessageText(std::string(10, 'a') + "b", 10), "aaaaaaaaaa... (1 more bytes)");
  EXPECT_EQ(MessageText("ab\xc3\xbc", 3), "ab... (2 more bytes)");  // no character is cut
  EXPECT_EQ(MessageText(std::string(5000, '\xff')).size(),
            2000 * 4 + std::string("... (3000 more bytes)").size());
}

}  // namespace
}  // namespace weft
