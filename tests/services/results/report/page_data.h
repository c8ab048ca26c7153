// What a page holds for its program, read back.
#pragma once

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <string>

namespace weft {

// A member of the page's data, which is a line; empty where the page has none.
template <typename Message>
Message MemberOf(const std::string& page, const std::string& name) {
  Message message;
  const std::string begin = "\n\"" + name + "\":";
  const size_t at = page.find(begin);
  EXPECT_NE(at, std::string::npos) << name;
  if (at == std::string::npos) return message;
  std::string json = page.substr(at + begin.size(), page.find('\n', at + 1) - at - begin.size());
  if (json.ends_with(",")) json.pop_back();
  const auto read = google::protobuf::util::JsonStringToMessage(json, &message);
  EXPECT_TRUE(read.ok()) << read;
  return message;
}

}  // namespace weft
