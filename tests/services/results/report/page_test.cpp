#include "services/results/report/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <openssl/evp.h>

#include <array>
#include <limits>

#include "absl/strings/escaping.h"
#include "weft/v1/page.pb.h"
#include "weft/v1/verdict.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string TextBetween(const std::string& html, const std::string& begin, const std::string& end) {
  const size_t at = html.find(begin);
  EXPECT_NE(at, std::string::npos) << begin;
  if (at == std::string::npos) return "";
  const size_t start = at + begin.size();
  return html.substr(start, html.find(end, start) - start);
}

std::string PageOfReason(const std::string& reason) {
  v1::Verdict verdict;
  verdict.set_reason(reason);
  return MakePage({.title = "<a&b>", .kind = "job", .data = {{"verdict", &verdict}}});
}

std::string HashOf(const std::string& text) {
  std::array<unsigned char, 32> hash{};
  unsigned length = 0;
  EVP_Digest(text.data(), text.size(), hash.data(), &length, EVP_sha256(), nullptr);
  return absl::StrCat("'sha256-", absl::Base64Escape(std::string(hash.begin(), hash.end())), "'");
}

TEST(Page, ThePolicyNamesTheOnlyProgramAndStyleThatMayRun) {
  const std::string html = PageOfReason("good");
  EXPECT_THAT(html, HasSubstr(absl::StrCat("content=\"default-src 'none'; img-src data:; style-src ",
                                           HashOf(TextBetween(html, "<style>", "</style>")), "; script-src ",
                                           HashOf(TextBetween(html, "<script>", "</script>")), "\"")));
  EXPECT_THAT(html, HasSubstr("<title>&lt;a&amp;b&gt;</title>"));
}

TEST(Page, LoadsNothing) {
  const std::string html = PageOfReason("good");
  for (const char* what : {"<link", "http:", "https:", "@import", "url(", "fetch(", "eval(", "innerHTML",
                           "import ", "export ", "insertAdjacentHTML", "document.write"}) {
    const size_t at = html.find(what);
    // The one address is the name of SVG's elements.
    EXPECT_TRUE(at == std::string::npos || html.substr(at, 26) == "http://www.w3.org/2000/svg") << what;
  }
}

TEST(Page, TextsCannotEndTheData) {
  const std::string html = PageOfReason("</script><script>alert(1)</script><!-- \xE2\x80\xA8");
  const std::string data = TextBetween(html, "data-kind=\"job\">", "</script>");
  EXPECT_THAT(data, HasSubstr("\\u003c/script\\u003e\\u003cscript\\u003ealert(1)"));
  EXPECT_THAT(data, Not(HasSubstr("<")));
  EXPECT_THAT(data, Not(HasSubstr("\xE2\x80\xA8")));
  EXPECT_EQ(html, PageOfReason("</script><script>alert(1)</script><!-- \xE2\x80\xA8"));
}

TEST(Page, MembersAreNamedAndZerosAreWritten) {
  v1::PageScale scale;
  scale.set_high(std::numeric_limits<double>::quiet_NaN());
  const v1::PageMap map;
  const std::string html = MakePage({.title = "", .kind = "x", .data = {{"scale", &scale}, {"map", &map}}});
  EXPECT_EQ(TextBetween(html, "data-kind=\"x\">", "</script>"),
            "{\n\"scale\":{\"low\":0,\"high\":\"NaN\",\"label\":\"\",\"unit\":\"\",\"bounded\":false,"
            "\"colors\":[]},\n\"map\":{\"title\":\"\",\"pictures\":[]}\n}");
}

}  // namespace
}  // namespace weft
