// What protobuf's parser of text complains of.
#pragma once

#include <google/protobuf/io/tokenizer.h>

#include <string>

namespace weft {

// Keeps the first error of a parser.
class FirstError : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int line, google::protobuf::io::ColumnNumber, const std::string& message) override {
    if (!message_.empty()) return;
    line_ = line + 1;
    message_ = message;
  }
  int line() const { return line_; }  // from 1
  const std::string& message() const { return message_; }

 private:
  int line_ = 0;
  std::string message_;
};

}  // namespace weft
