#include "services/tools/installation/redaction.h"

#include <gtest/gtest.h>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

constexpr char kKey[] = "-----BEGIN EC PRIVATE KEY-----\nMHcCAQEEIA==\nAbCd\n-----END EC PRIVATE KEY-----\n";

TEST(Redaction, RemovesWhatLooksLikeASecret) {
  const Redaction redaction;
  EXPECT_EQ(redaction.Apply("a weft_0123456789abcdef0123 b"), "a [redacted] b");
  EXPECT_EQ(redaction.Apply("authorization: Bearer x.y-z\nnext"), "authorization: Bearer [redacted]\nnext");
  EXPECT_EQ(redaction.Apply("to https://anna:pw@host/p?key=1&b=2 now"),
            "to https://[redacted]@host/[redacted] now");
  EXPECT_EQ(redaction.Apply("on_end_url: \"https://hooks.example/services/T0/B0/secret\" # x"),
            "on_end_url: \"https://hooks.example/[redacted]\" # x");
  EXPECT_EQ(redaction.Apply("HTTPS://a.example/s, http://b.example:80?t=1 and http://c.example/"),
            "HTTPS://a.example/[redacted] http://b.example:80?[redacted] and http://c.example/");
  EXPECT_EQ(redaction.Apply("rtsp://anna:pw@camera/stream and file:///etc/weft"),
            "rtsp://[redacted]@camera/stream and file:///etc/weft");
  const std::string long_one(1 << 20, 'x');
  EXPECT_EQ(redaction.Apply("http://a/" + long_one), "http://a/[redacted]");
  EXPECT_EQ(redaction.Apply(std::string("before\n") + kKey + "after " + kKey + "end"),
            "before\n-----BEGIN EC PRIVATE KEY-----[redacted]\nafter -----BEGIN EC PRIVATE "
            "KEY-----[redacted]\nend");
  EXPECT_EQ(redaction.Apply("-----BEGIN PRIVATE KEY-----\nMHcC"), "-----BEGIN PRIVATE KEY-----[redacted]");
}

TEST(Redaction, RemovesKnownSecretsEverywhereAndNothingElse) {
  Redaction redaction;
  redaction.AddSecret(" 0123456789abcdef\n");
  redaction.AddSecret("short");
  redaction.AddSecretUrl("https://hooks.example/services/T0AAAAAA/B0BBBBBBBB?key=0011223344");
  EXPECT_EQ(redaction.Apply("no T0AAAAAA, B0BBBBBBBB, 0011223344 at hooks.example/services"),
            "no [redacted], [redacted], [redacted] at hooks.example/[redacted]");
  EXPECT_EQ(redaction.Apply("x0123456789abcdefy0123456789abcdef"), "x[redacted]y[redacted]");
  const std::string plain =
      "weft_worker: a short line, https://host/ and -----BEGIN CERTIFICATE-----\nMIIB\n";
  EXPECT_EQ(redaction.Apply(plain), plain);
}

TEST(Redaction, SecretsOfAFileAreItsLines) {
  const TempFolder folder;
  WriteBytes(folder / "key",
             "-----BEGIN PRIVATE KEY-----\nAAAABBBB\n short \nCCCCDDDD\n-----END PRIVATE KEY-----\n");
  Redaction redaction;
  redaction.AddSecretFile(folder / "key");
  redaction.AddSecretFile(folder / "none");
  redaction.AddSecretFile("");
  EXPECT_EQ(redaction.Apply("AAAABBBB short CCCCDDDD -----BEGIN"), "[redacted] short [redacted] -----BEGIN");
}

TEST(Redaction, SecretsHaveEightCharactersAtLeast) {
  Redaction redaction;
  redaction.AddSecret("1234567");
  redaction.AddSecret("abcdefgh");
  EXPECT_EQ(redaction.Apply("1234567 abcdefgh"), "1234567 [redacted]");
}

}  // namespace
}  // namespace weft
