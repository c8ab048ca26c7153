// Messages written out in tests.
#pragma once

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace weft {

// A message from text with breaks where they read best, as its DebugString; for comparison with that of
// another.
template <typename Message>
std::string TextOf(std::string text) {
  std::ranges::replace(text, '\n', ' ');  // breaks may be within texts
  Message message;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &message)) << text;
  return message.DebugString();
}

}  // namespace weft
