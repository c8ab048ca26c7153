#include "services/server/console/request_target.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(ParseTarget, DecodesPathAndQuery) {
  const auto target = ParseTarget("/file/Jobs/FetchResult?path=a%2Fb+c&kind=&x=1=2#part");
  ASSERT_TRUE(target.ok()) << target.status();
  EXPECT_EQ(target->path, "/file/Jobs/FetchResult");
  ASSERT_EQ(target->query.size(), 3u);
  EXPECT_EQ(target->query[0], (std::pair<std::string, std::string>("path", "a/b c")));
  EXPECT_EQ(target->query[1], (std::pair<std::string, std::string>("kind", "")));
  EXPECT_EQ(target->query[2], (std::pair<std::string, std::string>("x", "1=2")));
  EXPECT_EQ(ParseTarget("/")->path, "/");
}

TEST(ParseTarget, RefusesWhatIsNoPathOfAServer) {
  for (const char* text : {"", "x", "/../a", "/a/./b", "/a//b", "/%2e%2e/a", "/a%00", "/%", "/%4", "/%zz",
                           "/a%5Cb", "/a?x=%0a", "http://elsewhere/"})
    EXPECT_FALSE(ParseTarget(text).ok()) << text;
  EXPECT_FALSE(ParseTarget("/" + std::string(2048, 'a')).ok());
}

TEST(CookieValue, FindsTheOneOfTheNameAlone) {
  EXPECT_EQ(CookieValue("a=1; weft_80=abc; b=2", "weft_80"), "abc");
  EXPECT_EQ(CookieValue("weft_80=abc", "weft_8"), "");
  EXPECT_EQ(CookieValue("xweft_80=abc", "weft_80"), "");
  // Somebody else may have set one of the name on a wider path: none is trusted.
  EXPECT_EQ(CookieValue("weft_80=abc; weft_80=def", "weft_80"), "");
  EXPECT_EQ(CookieValue("", "weft_80"), "");
}

TEST(ParseRange, KnowsTheTwoFormsThatPagesUse) {
  const auto open = ParseRange("bytes=100-");
  ASSERT_TRUE(open);
  EXPECT_EQ(open->first, 100);
  EXPECT_FALSE(open->last);
  const auto closed = ParseRange("bytes=0-0");
  ASSERT_TRUE(closed);
  EXPECT_EQ(closed->last, 0);
  for (const char* text : {"", "bytes=", "bytes=-5", "bytes=5", "bytes=9-3", "bytes=1-2,4-5", "items=1-2",
                           "bytes=+1-", "bytes=99999999999999999999-"})
    EXPECT_FALSE(ParseRange(text)) << text;
}

TEST(ParseSocketOrder, HasANumberAMethodAndARequest) {
  const auto order = ParseSocketOrder("7 Jobs.WatchJob\n{\"job_id\":\"a\"}");
  ASSERT_TRUE(order.ok()) << order.status();
  EXPECT_EQ(order->id, 7u);
  EXPECT_EQ(order->method, "Jobs.WatchJob");
  EXPECT_EQ(order->json, "{\"job_id\":\"a\"}");
  const auto cancel = ParseSocketOrder("7 cancel");
  ASSERT_TRUE(cancel.ok());
  EXPECT_TRUE(cancel->method.empty());
  for (const char* text :
       {"", "7", "-1 cancel", " cancel", "x cancel", "7 ", "7 Jobs.WatchJob", "99999999999 cancel"})
    EXPECT_FALSE(ParseSocketOrder(text).ok()) << text;
}

TEST(BearerOf, FindsTheTokenOfItsSchemeAlone) {
  EXPECT_EQ(BearerOf("Bearer abc"), "abc");
  EXPECT_EQ(BearerOf("bearer abc"), "abc");
  for (const char* header : {"", "Bearer ", "Basic abc", "abc"}) EXPECT_EQ(BearerOf(header), "") << header;
}

TEST(IsHostOfOurs, ComparesNamesAsCertificatesDo) {
  const std::vector<std::string> names = {"vm.Studio.example", "*.farm.example"};
  for (const char* ours :
       {"localhost", "127.0.0.1:80", "[::1]:80", "VM.studio.example:7512", "a.farm.example"})
    EXPECT_TRUE(IsHostOfOurs(ours, names)) << ours;
  for (const char* foreign : {"", "vm", "studio.example", "farm.example", "a.b.farm.example", ".farm.example",
                              "vm.studio.example.evil.example", "*.farm.example.evil.example",
                              "[::1].evil.example", "[::1", "127.evil.example", "127.0.0.1.evil.example"})
    EXPECT_FALSE(IsHostOfOurs(foreign, names)) << foreign;
}

TEST(ParseTarget, DecodesLettersAndBlanks) {
  EXPECT_EQ(ParseTarget("/a%41%5a%5A%7e%20b+c")->path, "/aAZZ~ b+c");
  EXPECT_EQ(ParseTarget("/a?b%3Dc=d+e%2B")->query[0], (std::pair<std::string, std::string>("b=c", "d e+")));
  EXPECT_EQ(ParseTarget("/a?&&b")->query.size(), 1u);
  EXPECT_TRUE(ParseTarget("/a#?b=c")->query.empty());
  EXPECT_EQ(ParseTarget("/" + std::string(2047, 'a'))->path.size(), 2048u);
  for (const char* text :
       {"/a%4g", "/a%g4", "/a%/4", "/a%:4", "/a%@4", "/a%4`", "/a%1f", "/a%7f", "/a/", "/a?%zz=1", "/a?b=%0"})
    EXPECT_FALSE(ParseTarget(text).ok()) << text;
  EXPECT_EQ(ParseTarget("x").status(), absl::InvalidArgumentError("this is no path of this server"));
}

TEST(ParseRange, TakesSingleNumbersAlone) {
  EXPECT_EQ(ParseRange("bytes=3-3")->last, 3);
  EXPECT_EQ(ParseRange("bytes=3-4")->first, 3);
  for (const char* text : {"bytes=3-2", "bytes=1-x", "bytes=1--2", "bytes=-", "bytes=1-99999999999999999999"})
    EXPECT_FALSE(ParseRange(text)) << text;
}

TEST(ParseSocketOrder, TakesNamesOfAHundredLetters) {
  EXPECT_TRUE(ParseSocketOrder("1 " + std::string(100, 'm') + "\n{}").ok());
  EXPECT_EQ(ParseSocketOrder("1 " + std::string(101, 'm') + "\n{}").status(),
            absl::InvalidArgumentError("an order names a method, and its request follows on the next line"));
  EXPECT_EQ(ParseSocketOrder("x cancel").status(),
            absl::InvalidArgumentError("an order begins with a number and a space"));
  EXPECT_EQ(ParseSocketOrder("1 m\n")->json, "");
}

TEST(CookieValue, MayHaveEqualsSigns) { EXPECT_EQ(CookieValue(" a = 1;weft_80=b=c ;", "weft_80"), "b=c"); }

}  // namespace
}  // namespace weft
