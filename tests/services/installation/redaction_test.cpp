#include "services/installation/redaction.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

constexpr char kKey[] = "-----BEGIN EC PRIVATE KEY-----\nMHcCAQEEIA==\nAbCd\n-----END EC PRIVATE KEY-----\n";

TEST(Redaction, RemovesWhatLooksLikeASecret) {
  const Redaction redaction;
  EXPECT_EQ(redaction.Apply("a weft_0123456789abcdef0123 b"), "a [redacted] b");
  EXPECT_EQ(redaction.Apply("authorization: Bearer x.y-z\nnext"), "authorization: Bearer [redacted]\nnext");
  EXPECT_EQ(redaction.Apply("to https://anna:pw@host/p?key=1&b=2 now"),
            "to https://[redacted]@host/p?[redacted] now");
  EXPECT_EQ(redaction.Apply(std::string("before\n") + kKey + "after " + kKey + "end"),
            "before\n-----BEGIN EC PRIVATE KEY-----[redacted]\nafter -----BEGIN EC PRIVATE "
            "KEY-----[redacted]\nend");
  EXPECT_EQ(redaction.Apply("-----BEGIN PRIVATE KEY-----\nMHcC"), "-----BEGIN PRIVATE KEY-----[redacted]");
}

TEST(Redaction, RemovesKnownSecretsEverywhereAndNothingElse) {
  Redaction redaction;
  redaction.AddSecret(" 0123456789abcdef\n");
  redaction.AddSecret("short");
  EXPECT_EQ(redaction.Apply("x0123456789abcdefy0123456789abcdef"), "x[redacted]y[redacted]");
  const std::string plain =
      "weft_worker: a short line, https://host/page, -----BEGIN CERTIFICATE-----\nMIIB\n";
  EXPECT_EQ(redaction.Apply(plain), plain);
}

}  // namespace
}  // namespace weft
